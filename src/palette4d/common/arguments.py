"""Command line values of several verbs: frames, times, numbers, colours.

Values that are wrong for every file are refused here as wrong usage (exit status 2).
"""

import argparse
import math
import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NoReturn

from palette4d.common.errors import Arg, Palette4dError

#: The most frames that a command works on: eleven hours. Dates and ids are not read as frames.
MAX_FRAMES = 1_000_000

# Without this pattern argparse reads "-3", "-5--4" and "-0.1,0.2,0.3" as options.
_NEGATIVE = re.compile(r"-(?:\.?[0-9][0-9.,eEx+-]*|inf|nan)$")
_RANGE = re.compile(r"(-?[0-9]{1,12})(?:-(-?[0-9]{1,12})(?:x([0-9]{1,12}))?)?")

_HEX = re.compile(r"#([0-9a-fA-F]{2})([0-9a-fA-F]{2})([0-9a-fA-F]{2})")

_FRAMES_ARE = "expected A, A-B or A-BxN with A <= B, or several with commas, such as 1001-1100x2"


class Parser(argparse.ArgumentParser):
    """A parser with errors of two lines; argparse would print a verb's whole usage first.

    Verbs and their actions inherit it. The arguments that it parses have it as `parser`.
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        """Make an empty parser."""
        super().__init__(*args, **options)
        self.set_defaults(parser=self)

    def error(self, message: str) -> NoReturn:
        """Say what is wrong on stderr and exit with 2."""
        verb = " VERB" if self.prog == "palette4d" else ""
        self.exit(
            2,
            f"usage: {self.prog}{verb} … ({self.prog} --help)\n{self.prog}: error: {message}\n",
        )

    def parse_known_args(
        self, args: Iterable[str] | None = None, namespace: Any = None
    ) -> tuple[Any, list[str]]:
        """Parse as argparse does, but report unknown words as the verb's error."""
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return found, unknown


def accept_negative_values(subparsers: "argparse._SubParsersAction[Any]") -> None:
    """Allow option values that begin with a minus in these parsers."""
    for parser in subparsers.choices.values():
        parser._negative_number_matcher = _NEGATIVE


def parse_frames(text: str) -> list[int]:
    """Return the frame numbers of `A`, `A-B`, `A-BxN` or several with commas, in rising order.

    Raises
    ------
    Palette4dError
        The text is not such a list, a range descends, or it has more than `MAX_FRAMES` frames.

    >>> parse_frames("1001-1007x2,1003-1004")
    [1001, 1003, 1004, 1005, 1007]
    >>> parse_frames("-2-1")
    [-2, -1, 0, 1]
    """
    frames: set[int] = set()
    for part in text.split(","):
        found = _range(part)
        if found is None:
            raise Palette4dError(f'frame range "{text}" cannot be understood; {_FRAMES_ARE}')
        if len(frames) + len(found) > MAX_FRAMES:
            raise Palette4dError(
                f'frame range "{text}" holds more than {MAX_FRAMES} frames; choose fewer'
            )
        frames.update(found)
    return sorted(frames)


def frames_between(first: int, last: int, step: int = 1) -> range:
    """Return every `step`-th frame from `first` to `last`.

    Raises
    ------
    Palette4dError
        There are more than `MAX_FRAMES`.

    >>> list(frames_between(1001, 1006, 2))
    [1001, 1003, 1005]
    """
    frames = range(first, last + 1, step)
    if (last - first) // step >= MAX_FRAMES:
        raise Palette4dError(
            f"frames {first} to {last} hold more than {MAX_FRAMES} frames; choose fewer, with "
            f"{Arg('frames')} or a larger step"
        )
    return frames


def _range(part: str) -> range | None:
    match = _RANGE.fullmatch(part.strip())
    if match is None:
        return None
    first, last, step = int(match[1]), int(match[2] or match[1]), int(match[3] or 1)
    return range(first, last + 1, step) if first <= last and step else None


def frame_range(text: str) -> str:
    """Argparse type of --frames: the text itself, after `parse_frames` has checked it."""
    try:
        parse_frames(text)
    except Palette4dError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


def frame_range_or_all(text: str) -> str:
    """Argparse type: a frame range, or the word "all"."""
    return text if text == "all" else frame_range(text)


def times(text: str) -> list[float]:
    """Argparse type: times in rising order, from a frame range; single numbers may be fractions.

    >>> times("12.5,0-4x2")
    [0.0, 2.0, 4.0, 12.5]
    """
    found: set[float] = set()
    for part in text.split(","):
        try:
            found.add(number()(part))
        except argparse.ArgumentTypeError:
            found.update(map(float, parse_frames(frame_range(part))))
    return sorted(found)


def number(low: float = -math.inf, high: float = math.inf) -> Callable[[str], float]:
    """Return an argparse type for finite numbers from low to high."""

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f"found {text!r}, expected a finite number{_limits(low, high)}"
            )
        return value

    return parse


def whole(low: float = -math.inf, high: float = math.inf) -> Callable[[str], int]:
    """Return an argparse type for whole numbers from low to high."""

    def parse(text: str) -> int:
        try:
            value: int | None = int(text)
        except ValueError:
            value = None
        if value is None or not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f"found {text!r}, expected a whole number{_limits(low, high)}"
            )
        return value

    return parse


class ColourAction(argparse.Action):
    """Read three numbers: R G B, R,G,B or #rrggbb (nargs="+")."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        """Store the colour; exit with status 2 if the words are not a colour."""
        colour = parse_colour(values)
        if colour is None:
            # The last word may be the id, which the option has taken.
            order = "" if parse_colour(values[:-1]) is None else ", with the id before the option"
            raise argparse.ArgumentError(
                self,
                f"found {' '.join(values)!r}, expected three finite numbers (R G B or R,G,B) or "
                f"#rrggbb{order}",
            )
        setattr(namespace, self.dest, colour)


def parse_colour(words: Sequence[str]) -> tuple[float, float, float] | None:
    """Return the colour written as R G B, "R G B", R,G,B or #rrggbb; None if it is not a colour.

    >>> parse_colour(["0.5", "-0.1", "1e0"])
    (0.5, -0.1, 1.0)
    >>> parse_colour(["#ff0033"])
    (1.0, 0.0, 0.2)
    """
    if len(words) == 1 and (match := _HEX.fullmatch(words[0])):
        r, g, b = (int(digits, 16) / 255 for digits in match.groups())
        return (r, g, b)
    parts = words[0].replace(",", " ").split() if len(words) == 1 else words
    try:
        r, g, b = (number()(part) for part in parts)
    except (argparse.ArgumentTypeError, ValueError):
        return None
    return (r, g, b)


def checked(parse: Callable[[str], Any], check: Callable[[Any], object]) -> Callable[[str], Any]:
    """Return an argparse type that parses; a Palette4dError of `check` becomes wrong usage."""

    def both(text: str) -> Any:
        try:
            value = parse(text)
            check(value)
        except Palette4dError as error:
            raise argparse.ArgumentTypeError(str(error)) from None
        return value

    return both


def _limits(low: float, high: float) -> str:
    if low == -math.inf:
        return ""
    return f" of at least {low:.10g}" if high == math.inf else f" from {low:.10g} to {high:.10g}"
