"""A process that confines itself, for good, before it reads files of strangers (Linux).

Landlock says which files it may read and where it may write; seccomp refuses sockets, other
programs, and calls by which a fault in a decoder would get further. Processes that it starts are
confined as it is.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import platform
import stat
import struct
import sys
import time
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from typing import Any, Literal

from palette4d.common.errors import Palette4dError
from palette4d.common.syscalls import AUDIT_ARCH, LANDLOCK, REFUSED, STARTS, number

Mode = Literal["auto", "on", "off"]

#: What the command line asks for; "auto": where the kernel can.
mode: Mode = "auto"
#: Whether this process is a command of its own, which decodes nothing where it is not confined.
is_command = False

#: Landlock's first version that covers opening with O_TRUNC (Linux 6.2).
_OLDEST = 3
# linux/landlock.h
_EXECUTE, _WRITE, _READ, _LIST, _TRUNCATE = 1 << 0, 1 << 1, 1 << 2, 1 << 3, 1 << 14
_IN_FOLDER = 1 << 4 | 1 << 5 | 1 << 7 | 1 << 8  # remove folders and files, make folders and files
_ALL = {3: (1 << 15) - 1, 5: (1 << 16) - 1}  # by version: from 5 on with devices
_TCP, _SCOPES = 0b11, 0b11  # bind, connect; abstract sockets, signals
# linux/prctl.h, linux/seccomp.h, linux/filter.h
_NO_NEW_PRIVILEGES, _SECCOMP_FILTER = 38, 1
_ALLOW, _ERRNO, _KILL = 0x7FFF0000, 0x00050000, 0x80000000
_EPERM, _ENOSYS = 1, 38
_LOAD, _EQUAL, _AT_LEAST, _ANY_BIT, _RETURN = 0x20, 0x15, 0x35, 0x45, 0x06
_NEW_NAMESPACES, _THREAD = 0x7E020000, 0x00010000  # of clone: any CLONE_NEW…, CLONE_THREAD
_LOCAL, _NO_STREAM = 1, 0b1110  # of socketpair: AF_UNIX, all types but SOCK_STREAM
#: All that ioctl may do: TCGETS, TIOCGWINSZ, FIONREAD, FIONBIO, FIONCLEX, FIOCLEX, TCGETS2. Others
#: type on the user's terminal, change flags of files, or have signals sent.
_CONTROLS = (0x5401, 0x5413, 0x541B, 0x5421, 0x5450, 0x5451, 0x802C542A)
#: Of fcntl: F_SETOWN, F_SETSIG, F_SETOWN_EX have a signal sent to any process; F_SETLEASE holds up
#: who opens a file, F_NOTIFY tells of a folder.
_REFUSED_COMMANDS = (8, 10, 15, 1024, 1026)
# linux/capability.h
_CAPABILITIES, _OPENING = 0x20080522, 0b1110  # version 3; DAC_OVERRIDE, DAC_READ_SEARCH, FOWNER


@functools.cache
def missing() -> str:
    """Return why this system confines no process; "" where it does."""
    if sys.platform != "linux":
        return f"{platform.system()} has no Landlock"
    if platform.machine() not in AUDIT_ARCH or sys.maxsize < 2**32:
        return f"palette4d knows no system calls of {platform.machine()}"
    version = _landlock_version()
    if version < _OLDEST:
        found = f"Landlock {version}" if version > 0 else "no Landlock"
        return f"the kernel has {found}, and {_OLDEST} or newer is needed (Linux 6.2)"
    return ""


def wanted() -> bool:
    """Whether processes are to be confined.

    Raises
    ------
    Palette4dError
        They must be, and cannot.
    """
    if mode == "on" and missing():
        raise Palette4dError(
            f"--sandbox on: {missing()}; use --sandbox auto, or a machine that holds nothing else"
        )
    return mode != "off" and not missing()


def of_command() -> bool:
    """Whether this is a command whose files of strangers are for confined processes alone."""
    return is_command and wanted()


def kept_closed(path: Path) -> str:
    """Return what is said of a link that a confined process may not follow; "" of other files."""
    if not (path.is_symlink() and wanted()):
        return ""
    try:
        path.open("rb").close()
    except PermissionError:
        return (
            f"; it is a link to {os.path.realpath(path)}, and the sandbox opens files of such "
            "names alone: use --sandbox off, or links to files of the same kind of name"
        )
    except OSError:
        pass
    return ""


def may_fork() -> bool:
    """Whether this is a command of one thread, whose forks are confined."""
    return of_command() and _is_alone()


def confine(
    reads: Iterable[Path] = (), writes: Iterable[Path] = (), *, starts: bool = False
) -> None:
    """Let this process read some files and folders, write in others, and no more, for good.

    Python, the libraries and what describes the processors can be read, too, and the names of all
    files. The process has one thread.

    Parameters
    ----------
    reads, writes : paths of files and folders; folders with all that is in them, now and later.
    starts : whether it may start Python, which is confined alike.

    Raises
    ------
    Palette4dError
        The system refuses it; nothing of a stranger may be read.
    """
    _wait_until_alone()
    version = _landlock_version()
    handled = _ALL[5 if version >= 5 else 3]
    attributes = [handled]
    attributes += [_TCP] * (version >= 4) + [_SCOPES] * (version >= 6)
    packed = struct.pack(f"={len(attributes)}Q", *attributes)
    rules = _call("landlock_create_ruleset", packed, len(packed), 0)
    try:
        _allow(rules, Path(os.sep), _LIST)
        for path in (*_own_files(), *reads):
            _allow(rules, path, _READ | _LIST)
        for path in writes:
            _allow(rules, path, _READ | _LIST | _WRITE | _TRUNCATE | _IN_FOLDER)
        _allow(rules, Path(os.devnull), _READ | _WRITE)
        for path in _python() if starts else ():
            _allow(rules, path, _READ | _EXECUTE)
        if _libc().prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0) != 0:
            raise _refused("prctl")
        _call("landlock_restrict_self", rules, 0)
    finally:
        os.close(rules)
    _drop_capabilities()
    _filter_calls(starts)


def parts(folder: Path, extensions: Collection[str]) -> Iterator[Path]:
    """Yield what to read for the files of a folder that have an extension, such as "p4d.json".

    That is the folder, with the files of these extensions that its links lead to. Of a user's home
    folder, one above it and a hidden one it is the files alone: ``.ssh`` lies beside them.
    """
    endings = tuple(f".{extension}" for extension in extensions)
    whole = not holds_home(folder) and not any(
        part.startswith(".") for part in Path(os.path.realpath(folder)).parts
    )
    if whole:
        yield folder
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if entry.is_symlink() or not whole:
                found = Path(os.path.realpath(entry))  # a link may lead to a key, or to a folder
                alike = all(name.lower().endswith(endings) for name in (entry.name, found.name))
                if alike and not found.is_dir():
                    yield found


def holds_home(folder: Path) -> bool:
    """Whether a user's home folder is a folder, or lies in it."""
    own, homes = os.path.realpath(folder), set[str]()
    with contextlib.suppress(RuntimeError):  # a user that the system does not know
        homes.add(os.fspath(Path.home()))
    if sys.platform != "win32":
        import pwd

        # Those of people, not of services such as /usr/sbin.
        homes |= {user.pw_dir for user in pwd.getpwall() if 1000 <= user.pw_uid < 65534}
    return any(Path(os.path.realpath(home)).is_relative_to(own) for home in homes)


def _drop_capabilities() -> None:
    """Keep those of root that open files of others, if this is root."""
    head = struct.pack("=Ii", _CAPABILITIES, 0)
    buffer = ctypes.create_string_buffer(24)  # twice effective, permitted and inheritable
    if _libc().syscall(ctypes.c_long(number("capget")), head, buffer) < 0:
        raise _refused("capget")
    kept = struct.unpack("=6I", buffer.raw)[1] & _OPENING
    _call("capset", head, struct.pack("=6I", kept, kept, 0, 0, 0, 0))


def _filter_calls(starts: bool) -> None:
    program = _program(starts)
    steps = b"".join(struct.pack("=HBBI", *step) for step in program)
    buffer = ctypes.create_string_buffer(steps, len(steps))
    head = struct.pack("@HP", len(program), ctypes.addressof(buffer))
    _call("seccomp", _SECCOMP_FILTER, 0, head)


def _program(starts: bool) -> list[tuple[int, int, int, int]]:
    """Return the filter in the kernel's own code (BPF): (operation, if true, if false, value)."""
    deny, gone = (_RETURN, 0, 0, _ERRNO | _EPERM), (_RETURN, 0, 0, _ERRNO | _ENOSYS)
    steps = [
        *((_LOAD, 0, 0, 4), (_EQUAL, 1, 0, AUDIT_ARCH[platform.machine()]), (_RETURN, 0, 0, _KILL)),
        *((_LOAD, 0, 0, 0), (_AT_LEAST, 0, 1, 0x40000000), deny),  # x86's second table of calls
        # Its flags lie in memory, where a filter cannot look; the C library then uses clone.
        *((_EQUAL, 0, 1, number("clone3")), gone),
    ]
    for name in REFUSED if starts else (*REFUSED, *STARTS):
        if (call := number(name)) >= 0:
            steps += [(_EQUAL, 0, 1, call), deny]
    if not starts:  # before Linux 6.12 Landlock has no word on signals
        for name, own in (("tgkill", os.getpid()), ("prlimit64", 0)):
            steps += [(_EQUAL, 0, 4, number(name)), (_LOAD, 0, 0, 16), (_EQUAL, 1, 0, own), deny]
            steps += [(_LOAD, 0, 0, 0)]
    # A fork would outlive the command; a datagram goes to any address, whatever its pair.
    most, last = len(_CONTROLS), len(_REFUSED_COMMANDS) - 1
    alone = [] if starts else [(_ANY_BIT, 1, 0, _THREAD), deny]
    steps += [
        *((_EQUAL, 0, 3 + len(alone), number("clone")), (_LOAD, 0, 0, 16)),
        *((_ANY_BIT, 0, 1, _NEW_NAMESPACES), deny, *alone, (_LOAD, 0, 0, 0)),
        *((_EQUAL, 0, 5, number("socketpair")), (_LOAD, 0, 0, 16), (_EQUAL, 0, 2, _LOCAL)),
        *((_LOAD, 0, 0, 24), (_ANY_BIT, 0, 1, _NO_STREAM), deny, (_LOAD, 0, 0, 0)),
        *((_EQUAL, 0, 4 + last, number("fcntl")), (_LOAD, 0, 0, 24)),
        *((_EQUAL, last - i, int(i == last), asked) for i, asked in enumerate(_REFUSED_COMMANDS)),
        *(deny, (_LOAD, 0, 0, 0)),
        *((_EQUAL, 0, 2 + most, number("ioctl")), (_LOAD, 0, 0, 24)),
        *((_EQUAL, most - i, 0, asked) for i, asked in enumerate(_CONTROLS)),
        *(deny, (_RETURN, 0, 0, _ALLOW)),
    ]
    return steps


def _own_files() -> list[Path]:
    """Return the files and folders of Python, of the libraries, and of the system's own data."""
    import palette4d

    folders = {sys.prefix, sys.base_prefix, sys.exec_prefix, *palette4d.__path__, *sys.path}
    folders |= set(os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep))
    system = (
        *("/usr", "/lib", "/lib64", "/nix/store", "/gnu/store", "/etc/ld.so.cache"),
        *("/etc/localtime", "/sys/devices/system/cpu", "/proc/self", "/proc/cpuinfo"),
        *("/proc/meminfo", "/proc/stat", "/dev/urandom", "/dev/zero"),
    )
    own = [Path(path) for path in sorted(folders) if path and not holds_home(Path(path))]
    return [*own, *map(Path, system)]


def _python() -> list[Path]:
    """Return what is opened to run Python: itself, and what loads it."""
    loaders = [Path(path) for path in ("/lib64", "/lib")]
    return [Path(sys.executable), *(each for at in loaders for each in at.glob("ld-linux*.so.*"))]


def _is_alone() -> bool:
    return len(list(Path("/proc/self/task").iterdir())) == 1


def _wait_until_alone() -> None:
    """Wait for the end of other threads, which would not be confined."""
    deadline = time.monotonic() + 2
    while not _is_alone():
        if time.monotonic() > deadline:
            raise Palette4dError(
                "the process has other threads already, which would not be confined; use "
                "--sandbox off, and report this"
            )
        time.sleep(0.002)


def _allow(rules: int, path: Path, rights: int) -> None:
    if sys.platform != "linux":
        return
    try:
        handle = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return  # not there, or not to be read
    try:
        if not stat.S_ISDIR(os.fstat(handle).st_mode):
            rights &= _EXECUTE | _WRITE | _READ | _TRUNCATE
        rule = struct.pack("=Qi", rights, handle)
        _call("landlock_add_rule", rules, 1, rule, 0)
    finally:
        os.close(handle)


@functools.cache
def _landlock_version() -> int:
    if sys.platform != "linux":
        return 0
    return int(_libc().syscall(ctypes.c_long(LANDLOCK), None, ctypes.c_size_t(0), ctypes.c_uint(1)))


def _call(name: str, *arguments: int | bytes) -> int:
    given = [ctypes.c_char_p(a) if isinstance(a, bytes) else ctypes.c_long(a) for a in arguments]
    found = int(_libc().syscall(ctypes.c_long(number(name)), *given))
    if found < 0:
        raise _refused(name)
    return found


def _refused(name: str) -> Palette4dError:
    why = os.strerror(ctypes.get_errno())
    return Palette4dError(
        f"the process cannot be confined ({name}: {why}); use --sandbox off, and report this"
    )


@functools.cache
def _libc() -> Any:
    return ctypes.CDLL(None, use_errno=True)
