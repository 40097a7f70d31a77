"""Messages that name arguments of the API, which each surface says in its own words.

Python says ``force=True``, the command line ``--force``, a dialog of Studio the name of a field. An
`Arg` leaves a mark in an f-string. `Message` takes the marks out, and keeps the arguments.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

_MARK = "\0"
_marked: dict[str, Arg] = {}


@dataclasses.dataclass(frozen=True)
class Arg:
    """An argument of the API that a message advises."""

    name: str
    value: object = ...  #: ``...`` is any
    python: str = ""  #: what Python says, if not ``name=value``

    def __str__(self) -> str:
        """Return it as Python says it."""
        value = "…" if self.value is ... else self.value
        if isinstance(self.value, str):
            value = f'"{value}"'
        if isinstance(value, float):
            value = f"{value:.3g}"
        return self.python or f"{self.name}={value}"

    def __format__(self, spec: str) -> str:
        """Return it with marks around it, for `Message`."""
        _marked[str(self)] = self
        return f"{_MARK}{self!s}{_MARK}"


#: The function that analyses all shots: an option on the command line.
ANALYZE_SHOTS = Arg("detect_shots", True, "analyze_shots()")


class Message(str):
    """A text as Python says it; `parts` are its texts and, between them, arguments.

    >>> text = Message(f"choose {Arg('frames')}, or replace it with {Arg('force', True)}")
    >>> print(text)
    choose frames=…, or replace it with force=True
    >>> text.said(lambda arg: f"--{arg.name}")
    'choose --frames, or replace it with --force'
    """

    parts: tuple[str | Arg, ...]

    def __new__(cls, text: str) -> Message:
        """Take the marks out of a text; a message stays as it is."""
        if isinstance(text, Message):
            return text
        pieces: list[str | Arg] = list(text.split(_MARK))
        pieces[1::2] = [_marked.get(str(piece), piece) for piece in pieces[1::2]]
        made = super().__new__(cls, "".join(map(str, pieces)))
        made.parts = tuple(pieces)
        return made

    @property
    def marked(self) -> str:
        """The text with its marks, to be a part of another message."""
        return self.said("{}".format)

    @property
    def remedies(self) -> tuple[Arg, ...]:
        """The arguments that it names."""
        return tuple(part for part in self.parts if isinstance(part, Arg))

    def said(self, words: Callable[[Arg], str]) -> str:
        """Return the text with other words for the arguments."""
        return "".join(words(part) if isinstance(part, Arg) else part for part in self.parts)
