"""Calls of Windows that Python lacks: jobs, ended processes, and who holds a file."""

import contextlib
import ctypes
import sys
from collections.abc import Iterator
from ctypes import wintypes
from pathlib import Path
from typing import Any

assert sys.platform == "win32"

_kernel: Any = ctypes.WinDLL("kernel32", use_last_error=True)
_kernel.OpenProcess.restype = _kernel.CreateJobObjectW.restype = wintypes.HANDLE

# winbase.h, winnt.h, winerror.h
_QUERY, _STILL_ACTIVE, _NO_SUCH_PROCESS = 0x1000, 259, 87
_EXTENDED_LIMITS = 9
_PROCESS_MEMORY, _NO_DIALOG, _END_WITH_JOB = 0x100, 0x400, 0x2000


class _Limits(ctypes.Structure):  # JOBOBJECT_EXTENDED_LIMIT_INFORMATION
    _fields_ = (
        *((name, ctypes.c_int64) for name in ("process_time", "job_time")),
        ("flags", wintypes.DWORD),
        *((name, ctypes.c_size_t) for name in ("least_set", "most_set")),
        ("processes", wintypes.DWORD),
        ("affinity", ctypes.c_size_t),
        *((name, wintypes.DWORD) for name in ("priority", "scheduling")),
        ("io", ctypes.c_uint64 * 6),
        *((name, ctypes.c_size_t) for name in ("process_memory", "job_memory", "peak", "job_peak")),
    )


class _Holder(ctypes.Structure):  # RM_PROCESS_INFO
    _fields_ = (
        ("process", wintypes.DWORD),
        ("started", wintypes.FILETIME),
        ("program", wintypes.WCHAR * 256),
        ("service", wintypes.WCHAR * 64),
        ("rest", wintypes.DWORD * 4),
    )


def has_ended(process: int) -> bool:
    """Whether no process has this id any more."""
    handle = _kernel.OpenProcess(_QUERY, False, process & 0xFFFFFFFF)
    if not handle:
        return bool(ctypes.get_last_error() == _NO_SUCH_PROCESS)
    status = wintypes.DWORD()
    known = _kernel.GetExitCodeProcess(wintypes.HANDLE(handle), ctypes.byref(status))
    _close(handle)
    return bool(known) and status.value != _STILL_ACTIVE


@contextlib.contextmanager
def limited(process: int, megabytes: int | None) -> Iterator[None]:
    """Limit a process: its memory, and its life to the body's and to that of this process.

    `process` is its handle. What it starts belongs to it.

    Raises
    ------
    OSError
        Windows refuses it.
    """
    job = _kernel.CreateJobObjectW(None, None)
    try:
        limits = _Limits(flags=_NO_DIALOG | _END_WITH_JOB)
        if megabytes is not None:
            limits.flags |= _PROCESS_MEMORY
            limits.process_memory = megabytes << 20
        told, handle = ctypes.byref(limits), wintypes.HANDLE(job)
        if not (
            job
            and _kernel.SetInformationJobObject(
                handle, _EXTENDED_LIMITS, told, ctypes.sizeof(limits)
            )
            and _kernel.AssignProcessToJobObject(handle, wintypes.HANDLE(process))
        ):
            raise ctypes.WinError(ctypes.get_last_error())
        yield
    finally:
        if job:
            _close(job)


def holders(path: Path) -> list[str]:
    """Return the names of programs that have a file open, as far as Windows tells them."""
    with contextlib.suppress(OSError):
        manager: Any = ctypes.WinDLL("rstrtmgr")
        session, key = wintypes.DWORD(), ctypes.create_unicode_buffer(33)
        if manager.RmStartSession(ctypes.byref(session), 0, key):
            return []
        try:
            files = (wintypes.LPCWSTR * 1)(str(path))
            count, most, why = wintypes.UINT(), wintypes.UINT(8), wintypes.DWORD()
            found = (_Holder * 8)()
            if manager.RmRegisterResources(session, 1, files, 0, None, 0, None):
                return []
            if manager.RmGetList(
                session, ctypes.byref(count), ctypes.byref(most), found, ctypes.byref(why)
            ):
                return []
            return [holder.program for holder in found[: min(count.value, most.value)]]
        finally:
            manager.RmEndSession(session)
    return []


def show_error(text: str) -> None:
    """Show a message in a window, and wait until the user has closed it."""
    ctypes.WinDLL("user32").MessageBoxW(None, text, "palette4d", 0x10)


def _close(handle: int) -> None:
    _kernel.CloseHandle(wintypes.HANDLE(handle))
