"""Finds the files of image sequences by name only: patterns, folders and single files."""

from __future__ import annotations

import difflib
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from palette4d.common.arguments import MAX_FRAMES
from palette4d.common.message import Arg
from palette4d.common.text import counted
from palette4d.media.clip_base import ClipError, describe

# fmt: off
IMAGE_EXTENSIONS = frozenset({
    "avif", "bmp", "cin", "dpx", "exr", "hdr", "heic", "j2k", "jp2", "jpe", "jpeg", "jpg", "jxl",
    "pgm", "pic", "png", "pnm", "ppm", "psd", "rgb", "sgi", "tga", "tif", "tiff", "webp",
})
MOVIE_EXTENSIONS = frozenset({
    "3gp", "avi", "flv", "gif", "m2ts", "m4v", "mkv", "mov", "mp4", "mpeg", "mpg", "mts",
    "mxf", "nut", "ogv", "ts", "webm", "wmv", "y4m",
})
# fmt: on

# The last number of a stem. A minus is a sign only at the start or after another separator:
# "shot-0010" is frame 10 of "shot-", "shot.-0010" is frame -10 of "shot.".
_NUMBER = re.compile(r"((?:(?<=[._ ])|\A)-)?[0-9]+\Z")
# Names for the kind of file, not for the shot. Names of one letter, or of a letter and a digit, do
# not count either. Names of two letters (cg, bg) do.
_ANONYMOUS = re.compile(
    r".?|.?[\W\d_].?|(frame|image|img|out|output|pic|picture|plate|render|still)s?|seq(uence)?"
    r"|dpx|exr|jpe?g|png|tiff?",
    re.IGNORECASE,
)
_FOLDERS_TO_NAME_BY = 3
# The mark for the frame number in a pattern, and a range before it: numbers with a separator before
# them, as in "name.1001-1100#.exr", "name.1-10x2,15#.exr". No mark is in "logo@2x.png".
_PADDING = re.compile(r"#+|@+(?![A-Za-z0-9@])|(%[0-9]{0,2}d|\$F[0-9]{0,2})(?![A-Za-z])")
_ONE_RANGE = r"-?[0-9]+(--?[0-9]+(x[0-9]+)?)?"
_RANGE = re.compile(rf"((?<=[._ ])|\A){_ONE_RANGE}(,{_ONE_RANGE})*\Z")
# "shot_v2" is version 2, not frame 2.
_VERSION = re.compile(r"(^|.*[._ -])[vV]\Z", re.DOTALL)


@dataclass(frozen=True)
class ImageSequence:
    """Numbered files in one folder: `prefix` + zero-padded number + `suffix`."""

    folder: Path
    prefix: str
    suffix: str
    width: int
    files: dict[int, Path]

    @property
    def pattern(self) -> str:
        """The path with one `#` for each digit."""
        return str(self.folder / f"{self.prefix}{'#' * self.width}{self.suffix}")

    @property
    def numbers(self) -> list[int]:
        """Frame numbers found, rising."""
        return sorted(self.files)

    @property
    def name(self) -> str:
        """The prefix without its separator; for files such as f.0001.png, the name of the nearest
        folder that names the shot."""
        own = self.prefix.rstrip("._- ")
        if not self.width:  # a single image, not a sequence
            return own or "clip"
        folder = self.folder.resolve()
        above = [folder, *folder.parents][:_FOLDERS_TO_NAME_BY]
        names = [own, *(parent.name for parent in above)]
        telling = (name for name in names if not _ANONYMOUS.fullmatch(name))
        return next(telling, own or folder.name or "clip")

    def path(self, frame: int) -> Path:
        """The file of a frame, whether it exists or not."""
        file = self.files.get(frame)
        return file or self.folder / f"{self.prefix}{frame:0{self.width}d}{self.suffix}"

    def __str__(self) -> str:
        """Pattern and frames, for a message."""
        return f"{Path(self.pattern).name} ({describe(self.numbers)})"


def extension(path: str | Path) -> str:
    """File name extension in lower case without its dot."""
    return Path(path).suffix.lower().lstrip(".")


def frame_number(stem: str) -> tuple[str, str] | None:
    """(prefix, number as written) of a numbered stem, or None.

    >>> frame_number("beach.0012"), frame_number("beach_v2"), frame_number("beach.-0003")
    (('beach.', '0012'), None, ('beach.', '-0003'))
    """
    match = _NUMBER.search(stem)
    if match is None or _VERSION.fullmatch(stem[: match.start()]):
        return None
    return stem[: match.start()], match[0]


def _digits_fit(number: str, width: int) -> bool:
    """Whether a written number fits a sequence padded to `width` digits."""
    digits = number.lstrip("-")
    return (
        len(digits) == width or len(number) == width or (len(digits) > width and digits[0] != "0")
    )


def _file_names(folder: Path) -> list[str]:
    try:
        with os.scandir(folder) as entries:
            return sorted(entry.name for entry in entries if not entry.name.startswith("."))
    except OSError as error:
        raise ClipError(
            f"{folder}: the folder cannot be listed ({error.strerror}); expected a folder that "
            "exists and may be read. Check the path."
        ) from error


def sequences_in(folder: Path) -> list[ImageSequence]:
    """All image sequences of a folder, single numbered images included, by name."""
    groups: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for name in _file_names(folder):
        if extension(name) not in IMAGE_EXTENSIONS:
            continue
        stem, suffix = Path(name).stem, Path(name).suffix
        numbered = frame_number(stem)
        if numbered is not None:
            groups.setdefault((numbered[0], suffix), []).append((numbered[1], name))
    return [
        sequence
        for (prefix, suffix), members in sorted(groups.items())
        for sequence in _by_width(folder, prefix, suffix, members)
    ]


def _by_width(
    folder: Path, prefix: str, suffix: str, members: list[tuple[str, str]]
) -> Iterator[ImageSequence]:
    """Split names that differ only in their number into sequences of one padding each."""
    rest = members
    while rest:
        lengths = [len(number.lstrip("-")) for number, _ in rest]
        padded = [
            len(number.lstrip("-"))
            for number, _ in rest
            if number.lstrip("-")[0] == "0" and len(number.lstrip("-")) > 1
        ]
        same = min(lengths) == max(lengths)
        width = max(padded) if padded else (lengths[0] if same else 1)
        fits = [(number, name) for number, name in rest if _digits_fit(number, width)]
        files = {int(number): folder / name for number, name in fits}
        yield ImageSequence(folder, prefix, suffix, width, files)
        rest = [member for member in rest if member not in fits]


def in_folder(folder: Path) -> ImageSequence | Path:
    """The only image sequence of a folder, or its only image if that has no number."""
    sequences = sequences_in(folder)
    names = _file_names(folder)
    images = [name for name in names if extension(name) in IMAGE_EXTENSIONS]
    movies = [name for name in names if extension(name) in MOVIE_EXTENSIONS]
    # One numbered image among other images (beach.png, sky2.png) is not a sequence.
    if len(sequences) == 1 and (len(sequences[0].files) > 1 or len(images) == 1):
        return sequences[0]
    if not sequences and len(images) == 1:
        return folder / images[0]
    if len(sequences) > 1:
        what = f"{len(sequences)} image sequences"
        listed = [f"{sequence.pattern}  {describe(sequence.numbers)}" for sequence in sequences]
    elif images:
        what = f"{len(images)} images that are no sequence"
        listed = [str(folder / name) for name in images]
    else:
        what = counted(len(movies), "movie file") if movies else counted(len(names), "file")
        what += " and no image" if names else ""
        listed = [str(folder / name) for name in movies]
    more = [f"… and {len(listed) - 12} more"] if len(listed) > 12 else []
    lines = "".join(f"\n  {line}" for line in [*listed[:12], *more])
    raise ClipError(
        f"{folder}: found {what}, expected one image sequence such as name.0001.exr, "
        f"name.0002.exr, …{':' * bool(listed)}{lines}"
        + ("\nGive the pattern, image or movie that you mean." if listed else "")
    )


@dataclass(frozen=True)
class Pattern:
    """The parts of a name for frames: `prefix`, a number of at least `width` digits, `suffix`.

    `padding` is the mark for the number: `####`, `%04d`, `@@@@`, `$F4`. `frames` is a range that
    stands before it in some programs' names, or ""; `prefix` ends before the range.
    """

    prefix: str
    frames: str
    padding: str
    suffix: str

    @classmethod
    def parse(cls, name: str) -> Pattern | None:
        """Read the last mark of a name; None if there is none.

        >>> Pattern.parse("sh010-####.exr").prefix, Pattern.parse("a.1-10x2#.exr").frames
        ('sh010-', '1-10x2')
        """
        marks = list(_PADDING.finditer(name))
        if not marks:
            return None
        before, suffix = name[: marks[-1].start()], name[marks[-1].end() :]
        found = _RANGE.search(before)
        frames = found[0] if found else ""
        return cls(before.removesuffix(frames), frames, marks[-1][0], suffix)

    @property
    def width(self) -> int:
        """The least number of digits."""
        digits = re.sub(r"[^0-9]", "", self.padding)
        return int(digits) if digits else 1 if self.padding[0] in "%$" else len(self.padding)

    @property
    def literal(self) -> Pattern:
        """The pattern whose range is a part of the name."""
        return Pattern(self.prefix + self.frames, "", self.padding, self.suffix)


def of_pattern(spec: str) -> tuple[ImageSequence, str | None]:
    """(sequence, embedded range or None) of `name.####.exr`, `%04d`, `@@@`, `1-10x2#`."""
    path = Path(spec)
    folder = path.parent
    parsed = Pattern.parse(path.name)
    if parsed is None:
        raise ClipError(
            f"{spec}: the pattern cannot be understood; expected one such as name.####.exr, "
            "name.%04d.exr, name.@@@@.exr or name.1001-1100#.exr"
        )
    if extension(path.name) not in IMAGE_EXTENSIONS:
        raise ClipError(
            f'{spec}: found the extension "{extension(path.name)}", expected an image format '
            f"({', '.join(sorted(IMAGE_EXTENSIONS))})"
        )
    if not folder.is_dir():
        raise ClipError(f"{spec}: the folder {folder} does not exist; check the path")

    names = _file_names(folder)
    sequence = _matching(parsed.literal, folder, names)
    if sequence.files or not parsed.frames:
        found: str | None = None
    else:
        # Each frame of "1-9999999x2,1-9999999x3" would be listed, for minutes.
        ends = re.findall(r"([0-9]+)-+([0-9]+)", parsed.frames)
        if sum(abs(int(last) - int(first)) for first, last in ends) > MAX_FRAMES:
            raise ClipError(
                f"{spec}: the pattern's own range holds more than {MAX_FRAMES} frames; expected "
                f"fewer, or one of {Arg('frames')}"
            )
        sequence, found = _matching(parsed, folder, names), parsed.frames
    if not sequence.files:
        raise ClipError(f"{spec}: no file matches the pattern; {_near(spec, folder)}")
    return sequence, found


def _matching(pattern: Pattern, folder: Path, names: Iterable[str]) -> ImageSequence:
    """Return the sequence of the files with a pattern's prefix, digits and suffix."""
    prefix, suffix, width = pattern.prefix, pattern.suffix, pattern.width
    number = re.compile(re.escape(prefix) + r"(-?[0-9]+)" + re.escape(suffix))
    matches = [(match[1], name) for name in names if (match := number.fullmatch(name))]
    # A single `#` means any number in some programs, four digits in others: the files decide.
    if pattern.padding == "#" and matches:
        sequences = list(_by_width(folder, prefix, suffix, matches))
        return max(sequences, key=lambda each: len(each.files))
    files = {int(n): folder / name for n, name in matches if _digits_fit(n, width)}
    return ImageSequence(folder, prefix, suffix, width, files)


def _near(spec: str, folder: Path) -> str:
    """The folder's sequences for the error message, the most similar first."""
    patterns = {Path(sequence.pattern).name: str(sequence) for sequence in sequences_in(folder)}
    if not patterns:
        return f"{folder} holds no image sequence"
    wanted = Path(spec).name
    ranked = sorted(patterns, key=lambda name: -difflib.SequenceMatcher(None, wanted, name).ratio())
    return "found there: " + ", ".join(patterns[name] for name in ranked[:5])


def of_file(path: Path) -> tuple[ImageSequence, int]:
    """A single image as a one-frame sequence, with its frame number (0 when it has none)."""
    numbered = frame_number(path.stem)
    if numbered is None:
        return ImageSequence(path.parent, path.stem, path.suffix, 0, {0: path}), 0
    prefix, number = numbered
    frame = int(number)
    width = len(number.lstrip("-"))
    return ImageSequence(path.parent, prefix, path.suffix, width, {frame: path}), frame
