"""What the command line prints: names from files must not act on the terminal.

Messages of the API name its arguments. Here they become the options of the verb.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import sys
from collections.abc import Iterator
from typing import Any, TextIO

from palette4d.analysis.options import OPTIONS
from palette4d.cli import job, swatches
from palette4d.common.message import Arg, Message
from palette4d.common.text import printable
from palette4d.studio import texts

if sys.platform == "win32":
    from palette4d.common import windows


class _Printable:
    """A text stream that makes what is written to it printable."""

    def __init__(self, stream: TextIO) -> None:
        self._wrapped = stream  # tqdm's name for it, by which it knows a stream again

    def write(self, text: str) -> int:
        # What the command itself sends to terminals: patches of colour.
        parts = swatches.PATCH.split(text)
        parts[::2] = map(printable, parts[::2])
        parts[1::2] = map(swatches.drawn, parts[1::2])
        self._wrapped.write("".join(parts))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._wrapped, name)


def unfiltered_stderr() -> TextIO:
    """Return standard error for a progress bar, which moves the cursor."""
    return sys.stderr._wrapped if isinstance(sys.stderr, _Printable) else sys.stderr


@contextlib.contextmanager
def printable_output() -> Iterator[None]:
    """Make standard output and standard error printable in the body (`common.text.printable`)."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # Files and pipes have the code page of Windows, which lacks most characters.
            page = sys.platform == "win32" and not stream.isatty()
            encoding = "utf-8" if page else stream.encoding
            stream.reconfigure(encoding=encoding, errors="backslashreplace")
    # Windows' pythonw, which starts the window without a console, has neither.
    unseen = io.StringIO()
    streams: Any = (_Printable(sys.stdout or io.StringIO()), _Printable(sys.stderr or unseen))
    try:
        with contextlib.redirect_stdout(streams[0]), contextlib.redirect_stderr(streams[1]):
            yield
    finally:
        if sys.platform == "win32" and unseen.getvalue():
            windows.show_error(unseen.getvalue())


def option_of(arg: Arg, parser: argparse.ArgumentParser) -> str:
    """Return an argument of the API as the option of a verb."""
    given = arg.value is not ... and not isinstance(arg.value, bool)
    value = str(arg).partition("=")[2].strip('"') if given else ""
    name = arg.name.removesuffix("_")
    if name in OPTIONS and name != "vertices":
        return f"--set {name}={value or '…'}"
    ours = [action for action in parser._actions if action.dest == arg.name]
    for action in ours:
        if action.const is not None and action.const == arg.value:
            return action.option_strings[-1]
    flags = [flag for action in ours for flag in action.option_strings if flag.startswith("--")]
    elsewhere = name.replace("_", "-")  # an option of another verb or action
    flags = flags or [f"--{elsewhere}", f"--no-{elsewhere}"]
    return f"{flags[-1 if arg.value is False else 0]} {value}".rstrip()


def field_of(arg: Arg) -> str | None:
    """Return an argument of the API as a field of Studio's dialog, or None."""
    if str(arg) in texts.FIELDS:
        return f"'{texts.FIELDS[str(arg)]}'"
    value = "" if arg.value in (..., True) else f" {arg.value}"
    return f"'{texts.FIELDS[arg.name]}'{value}" if arg.name in texts.FIELDS else None


def tell(args: argparse.Namespace, kind: str, text: str) -> None:
    """Print a message, and tell it a program that waits: an "error", a "warning" or a "note"."""
    message = Message(text)
    job.event(**{kind: [_event(part, args.parser) for part in message.parts]})
    if job.stream is not sys.stderr:
        # A name with a line break must not look like a message of its own.
        words = message.said(lambda arg: option_of(arg, args.parser)).replace("\n", "\n  ")
        print(
            f"palette4d: {kind}: {words.encode('utf-8', 'backslashreplace').decode()}",
            file=sys.stderr,
        )


def _event(part: str | Arg, parser: argparse.ArgumentParser) -> object:
    if isinstance(part, str):
        return job.shown(part)
    return {"argument": str(part), "option": option_of(part, parser), "field": field_of(part)}
