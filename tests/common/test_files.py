"""The atomic writer: whatever happens, a reader finds the old file or the new one."""

import errno
import os
import secrets
import shutil
import stat
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path, PureWindowsPath

import access_lists
import pytest
from access_lists import NOBODY, for_one
from posix_files import as_user, folders, gifts, links, lists, locks, make_deep, modes, pipes

from palette4d.colour.ocio_config import config_of_sidecar
from palette4d.common import files, locking
from palette4d.common.errors import Palette4dError, WriteError
from palette4d.common.files import replacing
from palette4d.media.source_clip import candidates


def names(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


def replace(path: Path, then: Callable[[], object], *, force: bool = True) -> None:
    """Write a new content, with something that happens just after it."""
    with replacing(path, force=force) as temporary:
        temporary.write_bytes(b"new")
        then()


def failing(problem: BaseException) -> Callable[..., None]:
    def fail(*_: object) -> None:
        raise problem

    return fail


def test_the_old_file_stays_until_the_new_one_is_complete(old: Path) -> None:
    with replacing(old, force=True) as temporary:
        assert temporary.parent == old.parent
        assert temporary.suffix == ".cube"
        assert temporary.read_bytes() == b""
        temporary.write_bytes(b"new")
        assert old.read_bytes() == b"old"
    assert old.read_bytes() == b"new"
    assert names(old.parent) == [old.name]


def test_two_writers_at_once_have_a_file_each(old: Path) -> None:
    with replacing(old, force=True) as a, replacing(old, force=True) as b:
        assert a != b
        a.write_bytes(b"a")
        b.write_bytes(b"b")
    assert old.read_bytes() == b"a"
    assert names(old.parent) == [old.name]


@pytest.mark.parametrize(
    "problem", [KeyboardInterrupt(), OSError(errno.ENOSPC, "full"), ValueError()]
)
def test_errors_leave_the_old_file_and_nothing_else(old: Path, problem: BaseException) -> None:
    expected = WriteError if isinstance(problem, OSError) else type(problem)
    with pytest.raises(expected):
        replace(old, failing(problem))
    assert old.read_bytes() == b"old"
    assert names(old.parent) == [old.name]


@pytest.mark.parametrize(("owner", "name"), [(os, "fsync"), (Path, "replace")])
@pytest.mark.parametrize("problem", [KeyboardInterrupt(), OSError(errno.ENOSPC, "full")])
def test_failures_of_the_disk_leave_the_old_file(
    old: Path,
    monkeypatch: pytest.MonkeyPatch,
    owner: object,
    name: str,
    problem: BaseException,
) -> None:
    with pytest.raises((WriteError, KeyboardInterrupt)):
        replace(old, lambda: monkeypatch.setattr(owner, name, failing(problem)))
    monkeypatch.undo()
    assert old.read_bytes() == b"old"
    assert names(old.parent) == [old.name]


@folders
def test_file_and_folder_are_synced(old: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In this order: the content, the rename, the folder that holds the new name."""
    events: list[str] = []
    real, rename = os.fsync, Path.replace

    def fsync(handle: int) -> None:
        events.append("folder" if stat.S_ISDIR(os.fstat(handle).st_mode) else "file")
        real(handle)

    def renamed(self: Path, target: Path) -> Path:
        events.append("rename")
        return rename(self, target)

    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(Path, "replace", renamed)
    with replacing(old, force=True) as temporary:
        temporary.write_bytes(b"new")
    assert events == ["file", "rename", "folder"]


@modes
@pytest.mark.parametrize("mode", [0o640, 0o600, 0o200])
def test_permissions_are_kept(old: Path, mode: int) -> None:
    old.chmod(mode)
    with replacing(old, force=True) as temporary:
        temporary.write_bytes(b"new")
    assert stat.S_IMODE(old.stat().st_mode) == mode


@modes
def test_a_read_only_file_stays(old: Path) -> None:
    """As Perforce leaves files that nobody checked out."""
    old.chmod(0o444)
    with pytest.raises(WriteError, match=r"read-only .*chmod u\+w"), replacing(old, force=True):
        pass
    assert old.read_bytes() == b"old"


FOR_ONE = for_one(6, 4)
ACL = access_lists.NAME


@pytest.mark.skipif(sys.platform != "linux", reason="needs Linux's extended attributes")
def test_attributes_and_access_lists_are_kept(old: Path) -> None:
    os.setxattr(old, "user.reviewed", b"yes")
    os.setxattr(old, ACL, FOR_ONE)
    replace(old, lambda: None)
    assert old.read_bytes() == b"new"
    assert os.getxattr(old, "user.reviewed") == b"yes"
    assert os.getxattr(old, ACL) == FOR_ONE


@pytest.mark.skipif(sys.platform != "linux", reason="needs Linux's extended attributes")
def test_what_the_folder_gives_to_new_files_does_not_widen_an_old_ones_rights(old: Path) -> None:
    old.chmod(0o600)
    os.setxattr(old.parent, "system.posix_acl_default", FOR_ONE)
    replace(old, lambda: None)
    assert stat.S_IMODE(old.stat().st_mode) == 0o600
    assert ACL not in os.listxattr(old)


@pytest.mark.skipif(sys.platform != "linux", reason="needs Linux's extended attributes")
def test_an_access_list_that_cannot_be_copied_gives_its_rights_to_nobody(
    old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    os.setxattr(old, ACL, FOR_ONE)
    monkeypatch.setattr(os, "setxattr", failing(OSError(errno.ENOTSUP, "none here")))
    replace(old, lambda: None)
    assert stat.S_IMODE(old.stat().st_mode) == 0o600


@lists
@pytest.mark.parametrize("given", ["", "group"])
@pytest.mark.parametrize("listed", [False, True])
def test_who_cannot_give_the_file_away_names_its_owner_and_group(
    old: Path, listed: bool, given: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They and others by name keep their rights; the new group has no more than all have."""
    os.chown(old, 12345, 12346)
    old.chmod(0o664)
    os.setxattr(old, "user.reviewed", b"yes")
    if listed:
        os.setxattr(old, ACL, access_lists.for_one(6, 4, user=777))
    real = os.fchown

    def fchown(handle: int, owner: int, group: int) -> None:
        if not (given and owner == -1):
            raise PermissionError(errno.EPERM, "not you")
        real(handle, owner, group)

    monkeypatch.setattr(os, "fchown", fchown)
    replace(old, lambda: None)
    assert (old.stat().st_uid, old.stat().st_gid) == (0, 12346 if given else 0)
    assert os.getxattr(old, "user.reviewed") == b"yes"
    group, others = (0, 0) if listed else (6, 4)
    expected = [(1, 6, NOBODY), (2, 6, 12345), (16, 6, NOBODY), (32, others, NOBODY)]
    expected += [(2, 4, 777)] if listed else []
    expected += [(4, group if given else group & others, NOBODY)]
    expected += [] if given else [(8, group, 12346)]
    assert sorted(access_lists.entries(old)) == sorted(expected)


@lists
def test_users_that_a_list_names_write_one_file_in_turn() -> None:
    with tempfile.TemporaryDirectory() as folder:  # pytest's are closed to other users
        Path(folder).chmod(0o777)
        file = Path(folder, "shot.p4d.json")
        file.write_bytes(b"old")
        os.chown(file, 12345, 12345)
        os.setxattr(file, ACL, access_lists.for_one(6, 6, user=777))
        for user in (777, 12345, 777):
            with as_user(user):
                replace(file, lambda: None)
            assert file.stat().st_uid == user
        with as_user(888), pytest.raises(PermissionError):
            file.read_bytes()


@lists
@pytest.mark.parametrize("how", ["list", "mode"])
def test_a_group_that_is_kept_out_stays_out(how: str) -> None:
    """A group with fewer rights than all others, by name in a list or as the file's group."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o777)
        file = Path(folder, "shot.p4d.json")
        file.write_bytes(b"old")
        os.chown(file, 12345, 12345 if how == "list" else 999)
        file.chmod(0o644 if how == "list" else 0o604)
        if how == "list":  # 777, who edits it, is of the group that is kept out
            entries = [(1, 6, NOBODY), (2, 6, 777), (4, 4, NOBODY), (8, 0, 999)]
            os.setxattr(file, ACL, access_lists.of(*entries, (16, 6, NOBODY), (32, 4, NOBODY)))
        with as_user(777 if how == "list" else 12345, 999 if how == "list" else 12345):
            replace(file, lambda: None)
        with as_user(888, 999), pytest.raises(PermissionError):
            file.read_bytes()
        with as_user(888):
            assert file.read_bytes() == b"new"


@gifts
def test_owner_and_group_are_kept(old: Path) -> None:
    os.chown(old, 12345, 12346)
    old.chmod(0o664)
    replace(old, lambda: None)
    about = old.stat()
    assert (about.st_uid, about.st_gid, stat.S_IMODE(about.st_mode)) == (12345, 12346, 0o664)
    assert sys.platform != "linux" or ACL not in os.listxattr(old)


@lists
def test_without_access_lists_the_rights_of_a_group_that_is_not_kept_go(
    old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    os.chown(old, 12345, 12346)
    old.chmod(0o664)
    monkeypatch.setattr(os, "fchown", failing(PermissionError(errno.EPERM, "not you")))
    monkeypatch.setattr(os, "setxattr", failing(OSError(errno.ENOTSUP, "none here")))
    replace(old, lambda: None)
    assert stat.S_IMODE(old.stat().st_mode) == 0o644


@modes
def test_while_it_is_written_nobody_reads_what_will_be_closed(old: Path) -> None:
    old.chmod(0o640)
    with replacing(old, force=True) as temporary:
        assert stat.S_IMODE(temporary.stat().st_mode) == 0o600
        temporary.write_bytes(b"new")


def test_a_file_with_two_names_is_not_parted_from_the_other(old: Path) -> None:
    other = old.with_name("other.cube")
    other.hardlink_to(old)
    with pytest.raises(Palette4dError, match="of 2 names"):
        replace(old, lambda: None)
    assert old.samefile(other)
    assert old.read_bytes() == b"old"


def test_a_new_file_has_the_usual_permissions(tmp_path: Path) -> None:
    (tmp_path / "reference").touch()
    with replacing(tmp_path / "new.txt") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "new.txt").stat().st_mode == (tmp_path / "reference").stat().st_mode


@modes
def test_a_library_may_replace_the_temporary_file(old: Path) -> None:
    old.chmod(0o640)
    with replacing(old, force=True) as temporary:
        temporary.unlink()
        temporary.write_bytes(b"new")
    assert old.read_bytes() == b"new"
    assert stat.S_IMODE(old.stat().st_mode) == 0o640


@links
def test_a_link_stays_a_link(old: Path) -> None:
    folder = old.parent / "links"
    folder.mkdir()
    link = folder / "link.cube"
    link.symlink_to(old)
    with replacing(link, force=True) as temporary:
        temporary.write_bytes(b"new")
    assert link.is_symlink()
    assert old.read_bytes() == b"new"
    assert names(folder) == ["link.cube"]


@links
def test_a_link_of_another_user_is_not_followed(old: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shared = old.parent / "shared"
    shared.mkdir()
    link = shared / "out.cube"
    link.symlink_to(old)
    real = Path.lstat

    class Stranger:
        st_uid = 4711
        st_mode = stat.S_IFLNK

    monkeypatch.setattr(Path, "lstat", lambda self: Stranger() if self == link else real(self))
    with pytest.raises(Palette4dError, match="link of another user"):
        replace(link, lambda: None)
    assert old.read_bytes() == b"old"
    assert names(shared) == ["out.cube"]


@links
def test_no_link_on_the_way_may_be_of_another_user(
    old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A link of ours leads to a folder where another user put one that leads to a file of ours."""
    shared = old.parent / "shared"
    shared.mkdir()
    (shared / "theirs.cube").symlink_to(old)
    own = old.with_name("own.cube")
    own.symlink_to(shared / "theirs.cube")
    assert files.link_target(own) == old
    real = Path.lstat

    class Stranger:
        st_uid = 4711
        st_mode = stat.S_IFLNK

    monkeypatch.setattr(
        Path, "lstat", lambda self: Stranger() if self.parent == shared else real(self)
    )
    with pytest.raises(Palette4dError, match="link of another user"):
        files.link_target(own)


@links
def test_a_link_that_is_swapped_while_it_is_read_is_not_followed(
    old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mine = old.with_name("mine.cube")
    mine.write_bytes(b"mine")
    link = old.with_name("link.cube")
    link.symlink_to(mine)
    real = Path.readlink

    def swapped(path: Path) -> Path:
        path.unlink()
        path.symlink_to(old)
        return real(path)

    monkeypatch.setattr(Path, "readlink", swapped)
    with pytest.raises(Palette4dError, match="link that another program changes"):
        replace(link, lambda: None)
    assert (old.read_bytes(), mine.read_bytes()) == (b"old", b"mine")


@links
def test_a_link_in_place_of_the_temporary_file_is_refused(old: Path) -> None:
    """Neither the file's name nor its permissions go to what the link leads to."""
    other = old.with_name("other")
    other.write_bytes(b"other")
    other.chmod(0o600)
    old.chmod(0o666)

    def swap() -> None:
        (temporary,) = old.parent.glob(".*.p4d-tmp*")
        temporary.unlink()
        temporary.symlink_to(other)

    with pytest.raises(Palette4dError, match="link in place of the temporary file"):
        replace(old, swap)
    assert (old.read_bytes(), other.read_bytes()) == (b"old", b"other")
    assert stat.S_IMODE(other.stat().st_mode) == 0o600
    assert names(old.parent) == [old.name, "other"]


@links
@links
def test_a_relative_path_leads_back_through_links(tmp_path: Path) -> None:
    """`..` goes up from where a link leads, not from where it stands."""
    far, near = tmp_path / "far" / "away", tmp_path / "near"
    far.mkdir(parents=True)
    near.mkdir()
    (near / "out").symlink_to(far)
    clip = near / "clip.####.png"
    assert files.beside(clip, near) == "clip.####.png"
    assert files.beside(clip, near / "grades") == "../clip.####.png"
    for folder in (near / "out", near / "out" / "below"):
        relative = files.beside(clip, folder)
        assert not Path(relative).is_absolute()
        assert Path(os.path.realpath(folder / relative)) == clip
    assert files.beside(near / "out" / "a.mov", near / "out") == "a.mov"


def test_a_link_that_leads_nowhere_is_replaced(tmp_path: Path) -> None:
    link = tmp_path / "link.cube"
    link.symlink_to("gone")
    with replacing(link, force=True) as temporary:
        temporary.write_bytes(b"new")
    assert not link.is_symlink()
    assert link.read_bytes() == b"new"
    assert names(tmp_path) == ["link.cube"]


def test_a_file_that_exists_is_replaced_only_on_request(old: Path) -> None:
    with pytest.raises(Palette4dError), replacing(old):
        raise AssertionError("the body must not run")
    new = old.with_name("new.cube")
    with pytest.raises(Palette4dError):
        replace(new, lambda: new.write_bytes(b"of another program"), force=False)
    assert new.read_bytes() == b"of another program"
    assert names(old.parent) == [old.name, new.name]


def test_the_last_check_can_still_refuse(old: Path) -> None:
    check = failing(Palette4dError("changed"))
    with (
        pytest.raises(Palette4dError),
        replacing(old, force=True, check=check) as temporary,
    ):
        temporary.write_bytes(b"new")
    assert old.read_bytes() == b"old"
    assert names(old.parent) == [old.name]


@pytest.mark.parametrize("name", ["x" * 250, "\N{GRINNING FACE}" * 60 + ".cube"])
def test_the_longest_names(tmp_path: Path, name: str) -> None:
    with replacing(tmp_path / name) as temporary:
        temporary.write_bytes(b"new")
    assert names(tmp_path) == [name]


KILLED = """
import os, sys
from pathlib import Path
from palette4d.common.files import replacing
with replacing(Path(sys.argv[1]), force=True) as temporary:
    temporary.write_bytes(b"half")
    os.kill(os.getpid(), 9)
"""

KILLED_IN_FOLDER = """
import os, sys
from pathlib import Path
from palette4d.common.files import temporary_folder
with temporary_folder(Path(sys.argv[1]).parent) as folder:
    (folder / "below" / "deeper").mkdir(parents=True)
    (folder / "below" / "file").touch()
    (folder / "file").touch()
    os.kill(os.getpid(), 9)
"""


def test_a_name_of_a_temporary_file_is_no_output(
    old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would be removed by the next program that writes there."""
    named = old.with_name(".clip.0123456789abcdef.p4d-tmp.json")
    named.write_bytes(b"precious")
    monkeypatch.setattr(files, "_swept", set())
    with pytest.raises(Palette4dError, match="gives its temporary files"):
        replace(named, lambda: None)
    assert named.read_bytes() == b"precious"


@locks
@pytest.mark.parametrize("program", [KILLED, KILLED_IN_FOLDER])
def test_the_next_process_removes_what_a_killed_one_left(
    old: Path, program: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    killed = subprocess.run([sys.executable, "-c", program, old], check=False)
    assert killed.returncode == -9
    assert old.read_bytes() == b"old"
    assert len(names(old.parent)) == 2
    alike = old.with_name(".grade.tmp.cube")
    alike.touch()
    monkeypatch.setattr(files, "_swept", set())
    replace(old, lambda: None)
    assert names(old.parent) == [alike.name, old.name]


@pytest.fixture
def deep_folder(tmp_path: Path) -> Iterator[Callable[[Path], None]]:
    """Makes a folder that is deeper than any path, and than Python's stack."""
    yield lambda path: make_deep(path, 3000)
    subprocess.run(["rm", "-rf", *tmp_path.iterdir()], check=True)


@links
@gifts
def test_what_another_user_left_stays(
    old: Path, deep_folder: Callable[[Path], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only he could tell whether it is left over; nothing of it holds up a writer."""
    stranger = 65534
    made = [old.with_name(f".a.{digit * 16}.p4d-tmp.cube") for digit in "0123"]
    made[0].touch()
    os.mkfifo(made[1])
    made[2].symlink_to(old)
    deep_folder(made[3])
    lock = old.with_name(".b.cube.lock")
    lock.write_text(locking._computer() + f" {2**22 + 1} {'0' * 16}")
    for path in (*made, lock):
        os.chown(path, stranger, stranger, follow_symlinks=False)
    monkeypatch.setattr(files, "_swept", set())
    replace(old, lambda: None)
    assert names(old.parent) == sorted([lock.name, old.name, *(one.name for one in made)])
    assert names(made[3]) == ["a"]


@modes
@pytest.mark.parametrize("mode", [0o700, 0o755])
def test_a_folder_that_was_renamed_to_look_left_over_keeps_its_files(
    old: Path, mode: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a shared folder others may rename the user's folders, and change nothing in them."""
    folder = old.with_name(f".palette4d.{'0' * 16}.p4d-tmp")
    folder.mkdir(mode)
    (folder / "precious").touch()
    monkeypatch.setattr(files, "_swept", set())
    replace(old, lambda: None)
    assert names(folder) == ["precious"]


@links
def test_a_folder_too_deep_to_remove_holds_up_no_writer(
    old: Path, deep_folder: Callable[[Path], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    with files.temporary_folder(old.parent) as own:
        deep_folder(own / "a")
    assert names(old.parent) == [own.name, old.name]
    monkeypatch.setattr(files, "_swept", set())
    replace(old, lambda: None)
    assert old.read_bytes() == b"new"


@pipes
def test_a_pipe_that_takes_a_leftovers_place_holds_up_no_writer(
    old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, left = os.open, old.with_name(f".a.{'0' * 16}.p4d-tmp")
    # Who reads a pipe waits until somebody has it open for writing.
    at_last = threading.Timer(3, lambda: ends.append(real(left, os.O_RDWR)))
    ends: list[int] = []

    def opened(path: Path | str, flags: int, *mode: int, **where: int | None) -> int:
        if os.fspath(path) == str(left) and left.is_dir():
            left.rmdir()
            os.mkfifo(left)
            at_last.start()
        return real(path, flags, *mode, **where)

    left.mkdir()
    monkeypatch.setattr(os, "open", opened)
    monkeypatch.setattr(files, "_swept", set())
    start = time.monotonic()
    replace(old, lambda: None)
    waited = time.monotonic() - start
    at_last.cancel()
    at_last.join()
    for end in ends:
        os.close(end)
    assert waited < 2
    assert stat.S_ISFIFO(left.stat().st_mode)


def test_files_that_are_being_written_are_no_leftovers(
    old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = old.with_name("other.cube")
    with replacing(other) as temporary:
        temporary.write_bytes(b"slow")
        monkeypatch.setattr(files, "_swept", set())  # as if another process began
        replace(old, lambda: None)
        assert temporary.exists()
    assert other.read_bytes() == b"slow"


@locks
def test_what_a_library_put_in_the_temporary_files_place_is_no_leftover(
    old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def sweep() -> None:
        monkeypatch.setattr(files, "_swept", set())
        replace(old.with_name("other.cube"), lambda: None)

    with replacing(old, force=True, check=sweep) as temporary:
        of_library = old.with_name("library")
        of_library.write_bytes(b"new")
        of_library.replace(temporary)
    assert old.read_bytes() == b"new"


def test_nobody_waits_for_a_lock_on_a_new_file(old: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another user sees the new file first, and keeps a lock on it."""
    fcntl = pytest.importorskip("fcntl")
    real, kept = os.open, []

    def opened(path: Path, flags: int, *mode: int) -> int:
        handle = real(path, flags, *mode)
        if flags & os.O_EXCL and not kept:
            kept.append(real(path, os.O_RDONLY))
            fcntl.flock(kept[0], fcntl.LOCK_EX)
        return handle

    monkeypatch.setattr(os, "open", opened)
    with replacing(old, force=True) as temporary:
        temporary.write_bytes(b"new")
    os.close(kept[0])
    assert old.read_bytes() == b"new"
    assert names(old.parent) == [old.name]


@folders
def test_a_new_folder_that_another_process_removes_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Until it is locked, it may be taken for a leftover."""
    real, removed = os.open, []

    def opened(path: Path, *flags: int, **where: int | None) -> int:
        if Path(path).parent == tmp_path and not removed:
            removed.append(path)
            Path(path).rmdir()
        return real(path, *flags, **where)

    monkeypatch.setattr(os, "open", opened)
    with files.temporary_folder(tmp_path) as folder:
        assert folder.is_dir()
    assert removed
    assert names(tmp_path) == []


@gifts
def test_a_temporary_folder_gives_its_files_the_folders_group(tmp_path: Path) -> None:
    """Of a team's folder, with the set-group bit; what a kill leaves over is found as well."""
    os.chown(tmp_path, -1, 12345)
    tmp_path.chmod(0o2775)
    with files.temporary_folder(tmp_path) as folder:
        made = folder / "out" / "a.png"
        made.parent.mkdir()
        made.touch()
        assert (made.stat().st_gid, made.parent.stat().st_gid) == (12345, 12345)
        assert folder.stat().st_mode & 0o777 == 0o700
        copy = folder.with_name(f".palette4d.{files._mark()}{'0' * 10}.p4d-tmp")
        shutil.copytree(folder, copy)
        copy.chmod(folder.stat().st_mode)
    files._swept.clear()
    with files.temporary_folder(tmp_path):
        pass
    assert names(tmp_path) == []


def test_without_locks_only_old_files_are_leftovers(
    old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fcntl = pytest.importorskip("fcntl")
    monkeypatch.setattr(fcntl, "flock", failing(OSError(errno.ENOLCK, "no locks")))
    fresh, stale = (old.with_name(f".a.{digit * 16}.p4d-tmp.cube") for digit in "01")
    fresh.touch()
    stale.touch()
    os.utime(stale, (0, 0))
    monkeypatch.setattr(files, "_swept", set())
    replace(old, lambda: None)
    assert names(old.parent) == [fresh.name, old.name]


@modes
def test_what_another_computer_writes_is_no_leftover_for_a_day(
    old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On shares such as those of sshfs each computer has locks of its own."""
    own = old.with_name(f".a.{files._mark()}{'1' * 10}.p4d-tmp.cube")
    other = f"{int(files._mark(), 16) ^ 1:06x}"
    fresh, stale = (old.with_name(f".a.{other}{digit * 10}.p4d-tmp.cube") for digit in "01")
    for path in (own, fresh, stale):
        path.touch()
    os.utime(stale, (0, 0))
    monkeypatch.setattr(files, "_swept", set())
    replace(old, lambda: None)
    assert names(old.parent) == [fresh.name, old.name]


@links
def test_a_link_in_the_place_of_the_temporary_file_is_not_followed(
    old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even if the name could be guessed."""
    monkeypatch.setattr(secrets, "token_hex", lambda _: "0" * 16)
    victim = old.with_name("victim")
    victim.write_bytes(b"precious")
    files._swept.add(old.parent)
    files._temporary_name(old).symlink_to(victim)
    with pytest.raises(WriteError):
        replace(old, lambda: None)
    assert (victim.read_bytes(), old.read_bytes()) == (b"precious", b"old")


@links
def test_a_link_replaces_a_file_at_once(old: Path) -> None:
    files.replace_by_link(old, "other.cube")
    assert old.readlink() == Path("other.cube")
    assert names(old.parent) == [old.name]


def test_targets_that_cannot_be_written(tmp_path: Path) -> None:
    for target in (tmp_path, tmp_path / "missing" / "new.cube"):
        with pytest.raises(Palette4dError), replacing(target):
            raise AssertionError("the body must not run")
    if os.name == "posix" and os.geteuid() != 0:  # root may write everywhere
        locked = tmp_path / "locked"
        locked.mkdir(mode=0o500)
        with pytest.raises(WriteError), replacing(locked / "new.cube"):
            raise AssertionError("the body must not run")


@pipes
def test_a_pipe_or_device_is_never_replaced(tmp_path: Path) -> None:
    pipe, link = tmp_path / "pipe", tmp_path / "link"
    os.mkfifo(pipe)
    link.symlink_to(pipe)
    for path in (pipe, link):
        with (
            pytest.raises(Palette4dError, match="device or a pipe"),
            replacing(path, force=True) as temporary,
        ):
            temporary.write_text("x")
    assert pipe.is_fifo()
    assert [each.name for each in tmp_path.iterdir() if each not in (pipe, link)] == []


@pytest.mark.parametrize(
    ("path", "named_in", "other"),
    [
        ("\\\\server\\share\\shot.mov", "C:/show/a.p4d.json", True),
        ("//server/share/shot.mov", "C:/show/a.p4d.json", True),
        ("\\/server/share/shot.mov", "C:/show/a.p4d.json", True),
        ("\\\\?\\UNC\\server\\share\\shot.mov", "C:/show/a.p4d.json", True),
        ("\\\\server\\share\\shot.mov", "//other/share/a.p4d.json", True),
        ("\\\\SERVER\\share\\shot.mov", "//server/share/a.p4d.json", False),
        ("C:\\show\\shot.mov", "C:/show/a.p4d.json", False),
        ("shot.mov", "//server/share/a.p4d.json", False),
    ],
)
def test_windows_asks_no_server_that_only_a_file_names(
    path: str, named_in: str, other: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would log in there, with the user's name and a hash of the password."""
    if sys.platform != "win32":
        monkeypatch.setattr(sys, "platform", "win32")
        monkeypatch.setattr(Path, "absolute", lambda self: PureWindowsPath(str(self)))
    assert files.names_a_server(path, Path(named_in)) == other
    if other:
        assert candidates(Path(named_in), path) == []
        assert files.names_a_server(path, Path("C:/"))
        with pytest.raises(Palette4dError, match="the sidecar names"):
            config_of_sidecar(path, "--ocio-config")


def test_a_file_is_the_same_while_it_is_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another program renames a new file to it between two looks."""
    path = tmp_path / "a"
    path.touch()
    monkeypatch.setattr(Path, "samefile", lambda *_: False)
    assert files.same_file(path, path)
    monkeypatch.chdir(tmp_path)
    assert files.same_file(Path("a"), path)
