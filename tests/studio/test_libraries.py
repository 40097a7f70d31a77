"""Libraries of the system that Qt needs: all that are missing are named, with their packages."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from palette4d.studio import libraries

README = Path(__file__).resolve().parent.parent.parent / "README.md"
#: Every Linux with Python and a compiler's runtime has these.
USUAL = re.compile(
    r"(libc|libm|libdl|librt|libpthread|libresolv|libstdc\+\+|libgcc_s)\.so\.\d|ld-.*"
)
#: Hides libraries from a program; the machine outside of it still has them.
HIDE = 'for each in $HIDDEN; do mount --bind /dev/null "$each"; done; exec "$@"'
BARE = ("libxcb-icccm.so.4", "libxcb-keysyms.so.1", "libxkbcommon-x11.so.0")


def needed(path: Path, seen: set[Path]) -> set[str]:
    """The system's libraries that a file of Qt asks for, itself or through others of Qt."""
    if path in seen:
        return set()
    seen.add(path)
    said = subprocess.run(["readelf", "-d", path], capture_output=True, text=True, check=True)
    found: set[str] = set()
    for name in re.findall(r"\(NEEDED\).*\[(.+)\]", said.stdout):
        own = path.parent.parent.parent / "lib" / name  # from plugins/platforms
        beside = path.with_name(name)
        for inside in (own, beside):
            if inside.exists():
                found |= needed(inside, seen)
                break
        else:
            found |= set() if USUAL.match(name) or "icu" in name else {name}
    return found


@pytest.mark.parametrize("platform", ["xcb", "wayland"])
def test_the_table_has_all_that_qt_asks_for(platform: str) -> None:
    files, seen = libraries.qt_files(platform), set[Path]()
    if not files:
        pytest.skip("Qt came from the system's packages, which bring its libraries")
    asked = set().union(*(needed(path, seen) for path in files))
    assert "libEGL.so.1" in asked
    assert not asked - libraries.PACKAGES.keys()


def test_the_readme_names_every_package() -> None:
    words = set(README.read_text(encoding="utf-8").replace("`", " ").split())
    for names in libraries.PACKAGES.values():
        assert set(names) <= words


def _hide(names: tuple[str, ...]) -> list[str]:
    """A command before a command, which then does not find these libraries."""
    listed = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True, text=True, check=True)
    paths = [
        line.split("=> ")[1] for line in listed.stdout.splitlines() if line.split()[0] in names
    ]
    hidden = f"HIDDEN={' '.join(os.path.realpath(path) for path in paths)}"
    return ["unshare", "--map-root-user", "--mount", "env", hidden, "sh", "-c", HIDE, "sh"]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere Qt brings all")
@pytest.mark.parametrize(
    ("platform", "hidden", "packages"),
    [
        ("xcb", BARE, ("libxcb-icccm4", "xcb-util-wm", "xcb-util-keysyms", "libxkbcommon-x11-0")),
        ("offscreen", ("libEGL.so.1",), ("libegl1", "libglvnd-egl")),
    ],
)
def test_a_bare_system_is_told_all_that_it_lacks(
    tmp_path: Path, platform: str, hidden: tuple[str, ...], packages: tuple[str, ...]
) -> None:
    before = _hide(hidden)
    if subprocess.run([*before, "true"], capture_output=True, check=False).returncode != 0:
        pytest.skip("this system lets no program hide files from another")
    done = subprocess.run(
        [*before, sys.executable, "-m", "palette4d", "studio"],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path), "QT_QPA_PLATFORM": platform},
    )
    assert done.returncode == 1, done.stderr  # 134 where Qt aborts
    for name in (*hidden, *packages):
        assert name in done.stderr
    assert "libX11" not in done.stderr
