"""`palette4d install-plugin`: into a fresh folder, over an earlier version, over something else."""

from __future__ import annotations

import argparse
import errno
import os
import re
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import access_lists
import pytest
from posix_files import gifts, links, modes

from palette4d import _core
from palette4d.cli import install_plugin
from palette4d.common.errors import Palette4dError
from palette4d.common.files import temporary_folder
from palette4d.common.text import quoted
from palette4d.hosts import bundle as bundles
from palette4d.hosts.bundle import (
    BUNDLE,
    PROGRAM,
    architecture,
    default_destination,
    find_bundle,
    install_bundle,
    system_destination,
)


@pytest.fixture(autouse=True)
def quick(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests of other things than root's look at all of Python do without it: it takes a second."""
    if "root_installs_no" not in request.node.name:
        monkeypatch.setattr(bundles, "_refuse_others_program", lambda _: None)


def make_bundle(root: Path, content: bytes = b"code") -> Path:
    bundle = root / BUNDLE
    binary = bundle / "Contents" / "Linux-x86-64" / "Palette4D.ofx"
    binary.parent.mkdir(parents=True)
    binary.write_bytes(content)
    binary.chmod(0o755)
    return bundle


def files(root: Path) -> dict[str, bytes]:
    """What is in a bundle, but for the file that its installation adds."""
    return {
        path.relative_to(root).as_posix(): path.read_bytes()
        for path in sorted(root.rglob("*"))
        if path.is_file() and path != root / PROGRAM
    }


@pytest.fixture
def bundle(tmp_path: Path) -> Path:
    return make_bundle(tmp_path / "package")


def test_copies_the_whole_bundle_and_leaves_nothing_else(bundle: Path, tmp_path: Path) -> None:
    destination = tmp_path / "new" / "OFX"
    target = install_bundle(bundle, destination)
    assert target == destination / BUNDLE
    assert not target.is_symlink()
    assert files(target) == files(bundle)
    assert os.access(target / "Contents/Linux-x86-64/Palette4D.ofx", os.X_OK)
    assert [path.name for path in destination.iterdir()] == [BUNDLE]


@pytest.mark.parametrize("link", [False, pytest.param(True, marks=links)])
def test_the_bundle_knows_which_python_has_palette4d(
    bundle: Path, tmp_path: Path, link: bool
) -> None:
    old = os.umask(0)
    try:
        target = install_bundle(bundle, tmp_path / "OFX", link=link)
    finally:
        os.umask(old)
    assert (target / PROGRAM).read_text("utf-8") == f"{sys.executable}\n"
    # The node believes no file that everybody may change; Windows has access lists for that.
    assert os.name == "nt" or stat.S_IMODE((target / PROGRAM).stat().st_mode) == 0o644


@modes
def test_a_closed_umask_makes_no_closed_plugin(bundle: Path, tmp_path: Path) -> None:
    for path in (bundle, *bundle.rglob("*")):  # pip had the same umask
        path.chmod(0o700 if path.is_dir() else 0o600)
    old = os.umask(0o077)
    try:
        target = install_bundle(bundle, tmp_path / "new" / "OFX")
    finally:
        os.umask(old)
    modes = {path.name: stat.S_IMODE(path.stat().st_mode) for path in target.rglob("*")}
    assert modes.pop("program") == 0o644
    assert set(modes.values()) == {0o755}
    if os.geteuid() == 0:
        folders = (target, target.parent, target.parent.parent)
        assert {stat.S_IMODE(path.stat().st_mode) for path in folders} == {0o755}


@gifts
@pytest.mark.parametrize("how", ["theirs", "open", *(["list"] if sys.platform == "linux" else [])])
@pytest.mark.parametrize("what", ["package", "library", "link"])
def test_root_installs_nothing_that_another_user_could_change(
    bundle: Path, tmp_path: Path, what: str, how: str
) -> None:
    """Else each user's node would run what that one puts there."""
    changed = {"package": bundle.parent, "library": bundle, "link": bundle}[what]
    given = bundle
    if what == "link":
        given = tmp_path / "link"
        given.symlink_to(bundle)
    if how == "theirs":
        os.chown(changed, 12345, 12345)
    elif how == "list":  # root's own group, but the list names one more
        changed.chmod(0o775)
        os.setxattr(changed, access_lists.NAME, access_lists.for_one(7, 7))
    else:
        changed.chmod(0o777)
    with pytest.raises(Palette4dError, match="root"):
        install_bundle(given, tmp_path / "OFX")
    assert not (tmp_path / "OFX").exists()


@gifts
def test_root_installs_no_sources_of_another_user(
    bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in an editable installation (`pip install -e`) of a folder of theirs."""
    sources = tmp_path / "sources"
    (sources / "hosts").mkdir(parents=True)
    monkeypatch.setattr(bundles, "__file__", str(sources / "hosts" / "bundle.py"))
    os.chown(sources, 12345, 12345)
    with pytest.raises(Palette4dError, match=r"sources .*belongs to another user"):
        install_bundle(bundle, tmp_path / "OFX")


@gifts
@pytest.mark.parametrize("relative", [False, True])
def test_root_installs_nothing_that_a_link_of_another_user_leads_to(
    bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, relative: bool
) -> None:
    """Where the links lead is root's; the one on the way may lead elsewhere tomorrow."""
    theirs = tmp_path / "theirs"
    theirs.mkdir()
    (theirs / "python").symlink_to(sys.executable)
    (tmp_path / "python").symlink_to("theirs/../theirs/python" if relative else theirs / "python")
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    install_bundle(bundle, tmp_path / "OFX")
    os.chown(theirs, 12345, 12345)
    with pytest.raises(Palette4dError, match=r"theirs belongs to another user"):
        install_bundle(bundle, tmp_path / "OFX")


@gifts
@pytest.mark.parametrize(
    "what",
    ["base", "pth", "hidden", "later", "led", "module", "settings", "linked", "linked later"],
)
def test_root_installs_no_environment_of_another_users_python(
    bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    """Its library lies elsewhere; so do modules that a file *.pth names."""
    theirs = tmp_path / "theirs"
    theirs.mkdir()
    venv = pytest.importorskip("venv", reason="Windows' embedded Python has none")
    venv.create(tmp_path / "venv")
    monkeypatch.setattr(sys, "executable", str(tmp_path / "venv/bin/python"))
    (site,) = (tmp_path / "venv/lib").glob("*/site-packages")
    if what == "base":
        monkeypatch.setattr(sys, "base_prefix", str(theirs))
    elif what == "pth":
        (site / "other.pth").write_text(f"{theirs}\n", "utf-8")
    elif what == "hidden":
        (site / ".other.pth").write_text(f"\ufeff{theirs}\n", "utf-8")
    elif what == "led":
        (tmp_path / "link").symlink_to(theirs / "later")
        (site / "other.pth").write_text(f"{tmp_path / 'link'}/lib\n", "utf-8")
    elif what == "linked later":
        (site / "sitecustomize.py").symlink_to(theirs / "later.py")
    elif what == "later":
        (site / "other.pth").write_text(f"# a comment\n{theirs}/later/lib\n", "utf-8")
    elif what == "module":
        theirs = site / "package" / "theirs"
        theirs.mkdir(parents=True)
    elif what == "linked":
        (site / "package").symlink_to(theirs)
    else:
        theirs = (tmp_path / "venv/pyvenv.cfg").rename(tmp_path / "venv/theirs")
        (tmp_path / "venv/pyvenv.cfg").symlink_to("theirs")
        monkeypatch.setattr(sys, "prefix", str(tmp_path / "venv"))
    install_bundle(bundle, tmp_path / "OFX")
    os.chown(theirs, 12345, 12345)
    with pytest.raises(Palette4dError, match=r"theirs belongs to another user"):
        install_bundle(bundle, tmp_path / "OFX")


@gifts
def test_root_installs_no_environment_that_names_what_all_may_make(
    bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder such as /tmp keeps the files of others, but not names that are free."""
    venv = pytest.importorskip("venv", reason="Windows' embedded Python has none")
    venv.create(tmp_path / "venv")
    monkeypatch.setattr(sys, "executable", str(tmp_path / "venv/bin/python"))
    (site,) = (tmp_path / "venv/lib").glob("*/site-packages")
    (tmp_path / "open" / "there").mkdir(parents=True)
    (tmp_path / "open").chmod(0o1777)
    (site / "other.pth").write_text(f"{tmp_path / 'open/there'}\n", "utf-8")
    (site / "folder.pth").mkdir()
    (site / "gone.pth").symlink_to("nowhere")
    install_bundle(bundle, tmp_path / "OFX")
    (site / "other.pth").write_text(f"{tmp_path / 'open/later'}\n", "utf-8")
    with pytest.raises(Palette4dError, match=r"open may be changed by other users"):
        install_bundle(bundle, tmp_path / "OFX")


def test_replaces_an_earlier_version(bundle: Path, tmp_path: Path) -> None:
    destination = tmp_path / "OFX"
    old = make_bundle(destination, b"old code")
    (old / "Contents" / "left-over").write_text("of an older version")
    target = install_bundle(bundle, destination)
    assert files(target) == files(bundle)
    assert [path.name for path in destination.iterdir()] == [BUNDLE]


def test_replaces_what_cannot_be_renamed(
    bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder of a container's image, for example."""
    old = make_bundle(tmp_path / "OFX", b"old code")
    rename = Path.rename

    def refused(self: Path, target: Path) -> Path:
        if self == old:
            raise OSError(errno.EXDEV, "Invalid cross-device link")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", refused)
    target = install_bundle(bundle, tmp_path / "OFX")
    assert files(target) == files(bundle)
    assert [path.name for path in (tmp_path / "OFX").iterdir()] == [BUNDLE]


@links
def test_links(bundle: Path, tmp_path: Path) -> None:
    destination = tmp_path / "OFX"
    for _ in range(2):
        target = install_bundle(bundle, destination, link=True)
        assert target.is_symlink()
        assert target.resolve() == bundle.resolve()
    # A copy replaces the link, not what it leads to.
    target = install_bundle(bundle, destination)
    assert not target.is_symlink()
    assert files(target) == files(bundle)


@links
def test_a_link_that_leads_nowhere_is_replaced(bundle: Path, tmp_path: Path) -> None:
    destination = tmp_path / "OFX"
    destination.mkdir()
    (destination / BUNDLE).symlink_to(tmp_path / "gone")
    assert files(install_bundle(bundle, destination)) == files(bundle)


@pytest.mark.parametrize("kind", ["file", "folder"])
def test_refuses_to_replace_something_else(bundle: Path, tmp_path: Path, kind: str) -> None:
    destination = tmp_path / "OFX"
    other = destination / BUNDLE
    if kind == "file":
        destination.mkdir()
        other.write_text("precious")
    else:
        other.mkdir(parents=True)
        (other / "precious").write_text("precious")
    with pytest.raises(Palette4dError, match="force=True"):
        install_bundle(bundle, destination)
    assert other.exists()
    assert [path.name for path in destination.iterdir()] == [BUNDLE]
    install_bundle(bundle, destination, force=True)
    assert files(other) == files(bundle)


def test_says_what_to_do_without_the_right_to_write(
    bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    destination = tmp_path / "OFX"
    destination.mkdir()
    old = make_bundle(destination, b"old code")
    if os.name == "nt" or os.geteuid() == 0:
        # The superuser may write anywhere: let the copying meet the refusal instead.
        def refuse(*_: object, **__: object) -> None:
            raise PermissionError(13, "Permission denied", str(destination))

        monkeypatch.setattr(shutil, "copytree", refuse)
    else:
        destination.chmod(0o555)
    with pytest.raises(Palette4dError, match=r"administrator.*dest=….*OFX_PLUGIN_PATH"):
        install_bundle(bundle, destination)
    destination.chmod(0o755)
    assert files(old) == {"Contents/Linux-x86-64/Palette4D.ofx": b"old code"}
    assert [path.name for path in destination.iterdir()] == [BUNDLE]


def test_a_file_in_the_folders_place_is_named(bundle: Path, tmp_path: Path) -> None:
    (tmp_path / "OFX").touch()
    with pytest.raises(Palette4dError, match=r"OFX: found a file, expected a folder.*dest=…"):
        install_bundle(bundle, tmp_path / "OFX")


def test_a_drive_that_is_not_there_is_named(
    bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On Windows; elsewhere the root is always there."""
    gone = Path("D:/gone/OFX" if os.name == "nt" else "/gone/OFX")
    exists = Path.exists
    monkeypatch.setattr(Path, "exists", lambda path: path != Path(gone.anchor) and exists(path))
    with pytest.raises(Palette4dError, match="there is no such drive"):
        install_bundle(bundle, gone)


def test_a_failed_rename_puts_the_old_bundle_back(
    bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    destination = tmp_path / "OFX"
    make_bundle(destination, b"old code")
    rename = Path.rename

    def fail_on_the_fresh_one(self: Path, target: Path) -> Path:
        if self.name != "old" and self.parent.name.endswith(".p4d-tmp"):
            raise OSError(28, "No space left on device")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", fail_on_the_fresh_one)
    with pytest.raises(Palette4dError, match="No space left"):
        install_bundle(bundle, destination)
    assert files(destination / BUNDLE) == {"Contents/Linux-x86-64/Palette4D.ofx": b"old code"}


INSTALL = """
import os, shutil, sys
from pathlib import Path
from palette4d.hosts.bundle import install_bundle
if sys.argv[3] == "killed":
    shutil.copytree = lambda _, to, **how: (to.mkdir(), os.kill(os.getpid(), 9))
install_bundle(Path(sys.argv[1]), Path(sys.argv[2]))
"""


@pytest.mark.skipif(os.name == "nt", reason="folders cannot be locked there")
def test_the_next_run_removes_what_a_killed_one_left(bundle: Path, tmp_path: Path) -> None:
    destination = tmp_path / "OFX"

    def install(how: str) -> int:
        words = [sys.executable, "-c", INSTALL, bundle, destination, how]
        return subprocess.run(words, check=False, timeout=120).returncode

    assert install("killed") == -9
    (left,) = destination.iterdir()
    # Hosts look for bundles in hidden folders too, by their names.
    assert [path.suffix for path in left.iterdir()] == [""]
    with temporary_folder(destination) as used:  # by a run that goes on
        assert [path.name for path in destination.iterdir()] == [used.name]
        assert install("whole") == 0
        assert {path.name for path in destination.iterdir()} == {used.name, BUNDLE}
    assert [path.name for path in destination.iterdir()] == [BUNDLE]


def test_default_destinations(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("OFX_PLUGIN_PATH", "COMMONPROGRAMW6432", "COMMONPROGRAMFILES"):
        monkeypatch.delenv(name, raising=False)
    assert default_destination("linux") == Path("/usr/OFX/Plugins")
    assert default_destination("darwin") == Path("/Library/OFX/Plugins")
    windows = default_destination("win32")
    assert windows.as_posix() == "C:/Program Files/Common Files/OFX/Plugins"
    monkeypatch.setenv("COMMONPROGRAMFILES", "D:/Gemeinsame Dateien")
    assert default_destination("win32").as_posix() == "D:/Gemeinsame Dateien/OFX/Plugins"
    # Where hosts look first.
    monkeypatch.setenv("OFX_PLUGIN_PATH", os.pathsep.join(["", str(tmp_path), "/elsewhere"]))
    assert default_destination(sys.platform) == tmp_path
    assert system_destination("linux") == Path("/usr/OFX/Plugins")


def test_each_system_has_its_folder_in_the_bundle() -> None:
    assert architecture("linux", "x86_64") == "Linux-x86-64"
    assert architecture("linux", "aarch64") == "Linux-aarch64"
    assert architecture("darwin", "arm64") == architecture("darwin", "x86_64") == "MacOS"
    assert architecture("win32", "AMD64") == "Win64"


def test_says_which_systems_a_bundle_is_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    library = make_bundle(tmp_path / "_ofx") / "Contents" / "Linux-x86-64"
    library.rename(library.with_name("Linux-riscv64"))
    monkeypatch.setattr(_core, "__file__", str(tmp_path / "_core.so"))
    with pytest.raises(Palette4dError, match=r"Linux-riscv64, expected .*pip install"):
        find_bundle()


def test_the_verb_installs_the_packaged_node(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    parser = argparse.ArgumentParser()
    install_plugin.add_parser(parser.add_subparsers())
    args = parser.parse_args(["install-plugin", "--dest", str(tmp_path / "OFX")])
    assert args.run(args) == 0
    out = capsys.readouterr().out
    assert re.search(rf"OFX_PLUGIN_PATH[= ]{re.escape(quoted(tmp_path / 'OFX'))}\n", out)
    packaged = find_bundle()
    assert files(tmp_path / "OFX" / BUNDLE) == files(packaged)
    binary = tmp_path / "OFX" / BUNDLE / "Contents" / architecture() / "Palette4D.ofx"
    assert binary.stat().st_size > 100_000
    # In the standard's folder hosts look by themselves.
    monkeypatch.setattr(install_plugin, "system_destination", lambda: tmp_path / "OFX")
    assert args.run(args) == 0
    assert "OFX_PLUGIN_PATH" not in capsys.readouterr().out


def test_without_a_folder_the_verb_says_first_where_it_installs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "plugins"
    monkeypatch.setenv("OFX_PLUGIN_PATH", str(folder))
    parser = argparse.ArgumentParser()
    install_plugin.add_parser(parser.add_subparsers())
    args = parser.parse_args(["install-plugin"])
    assert args.run(args) == 0
    first, second = capsys.readouterr().out.splitlines()[:2]
    assert str(folder) in first
    assert "--dest" in first
    assert str(folder / BUNDLE) in second
    folder.rename(tmp_path / "file")
    folder.touch()
    with pytest.raises(Palette4dError):
        args.run(args)
    assert str(folder) in capsys.readouterr().out
