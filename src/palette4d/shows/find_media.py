"""Finds a timeline's media: the file that it names, or a file of that name in a folder.

A folder is listed once, with all its subfolders; only names count. The extension may differ (a
proxy). For a sequence the timeline may name the first file or the pattern.
"""

from __future__ import annotations

import os
import re
import sys
import urllib.parse
import urllib.request
from collections.abc import Iterable, Iterator
from pathlib import Path

from palette4d.common.errors import Arg, Palette4dError
from palette4d.media import clip_sequence

# name.####.exr, name.%04d.exr, name.@@@@.exr, name.[1001-1100].exr, name.1001.exr
_NUMBERS = re.compile(r"(%0?[0-9]*d|#+|@+|\[[0-9]+-[0-9]+\]|(?<![0-9])[0-9]+)(?=\.[A-Za-z0-9]+$)")

# A drive's letter or a server, with backslashes; S:/show/x.mov, too.
_WINDOWS = re.compile(r"[A-Za-z]:[\\/]|\\\\")

#: Extensions of camera originals, whose proxies are analysed.
CAMERA = frozenset({"mxf", "r3d", "braw", "ari", "arx", "dng"})


def local_path(url: str) -> Path:
    """Return the path for a media reference's URL or path."""
    parts = urllib.parse.urlsplit(url)
    if _WINDOWS.match(url):  # S:\show\x.mov and \\server\show\x.mov, on any system
        return Path(url if os.name == "nt" else url.replace("\\", "/"))
    if parts.scheme == "":
        return Path(url)
    if parts.scheme == "file":
        path = urllib.request.url2pathname(parts.path)
        server = sys.platform == "win32" and parts.netloc not in ("", "localhost")
        return Path(rf"\\{parts.netloc}{path}" if server else path)
    raise Palette4dError(
        f"found the media {url!r}, expected a file; relink it, or name its folder with "
        f"{Arg('media')}"
    )


def is_elsewhere(url: str) -> bool:
    """Whether a file:// URL names another computer. Windows reads the files of these."""
    parts = urllib.parse.urlsplit(url)
    return (
        sys.platform != "win32" and parts.scheme == "file" and parts.netloc not in ("", "localhost")
    )


class Folder:
    """The media under a folder, by name."""

    def __init__(self, path: Path) -> None:
        """List the folder; `Palette4dError` if it is not a folder."""
        if not path.is_dir():
            raise Palette4dError(
                f"{path}: found no such folder; expected one with media in it for {Arg('media')}"
            )
        self.path = path
        #: By the whole name; by the name without a number, sequences and single images.
        self._exact: dict[str, list[Path]] = {}
        self._sequences: dict[str, list[Path]] = {}
        self._stills: dict[str, list[Path]] = {}
        for folder, files in _folders(path):
            self._list(folder, files)

    def _list(self, folder: Path, files: list[str]) -> None:
        """List a folder's movies, image sequences as patterns, and single images."""
        numbered = set()
        for sequence in clip_sequence.sequences_in(folder):
            pattern, names = Path(sequence.pattern), [p.name for p in sequence.files.values()]
            numbered |= set(names)
            single = len(names) == 1
            name, index = (names[0], self._stills) if single else (pattern.name, self._sequences)
            self._exact.setdefault(_stem(name), []).append(pattern)
            index.setdefault(_plain(name), []).append(pattern)
        for name in files:
            extension = clip_sequence.extension(name)
            known = clip_sequence.MOVIE_EXTENSIONS | clip_sequence.IMAGE_EXTENSIONS
            if extension in known and name not in numbered and not name.startswith("."):
                self._exact.setdefault(_stem(name), []).append(folder / name)

    def find(self, names: Iterable[str]) -> Path | None:
        """Return the media for the first of the names that exists.

        The name's own number and extension come before others; a still of another number is none.
        If several folders hold the name, the folder path most like the name's path wins.
        """
        for name in names:
            path = Path(name.replace("\\", "/"))  # an EDL may name the whole path of another system
            files = self._named(path.name)
            same = [f for f in files if f.suffix.lower() == path.suffix.lower()]
            if best := _most_alike(same or files, path):
                if len(best) > 1:
                    listed = " and ".join(str(file) for file in best[:4])
                    raise Palette4dError(
                        f"found {len(best)} media named {path.name!r} under {self.path}: {listed}; "
                        "expected one, keep the others out of the folder"
                    )
                return best[0]
        return None

    def _named(self, name: str) -> list[Path]:
        plain, stem = _plain(name), _stem(name)
        files = self._exact.get(stem) or self._sequences.get(stem) or self._sequences.get(plain)
        files = files or self._stills.get(stem)
        if files is None and clip_sequence.frame_number(stem) is None:
            files = self._stills.get(plain)
        return files or []


def _folders(path: Path) -> Iterator[tuple[Path, list[str]]]:
    """Yield a folder and those below it, each with the names of its files, in order.

    Unlike `os.walk` of Python 3.11 it goes as deep as paths do. Links to folders are not followed,
    and what cannot be read is passed over.
    """
    left = [path]
    while left:
        folder = left.pop()
        try:
            with os.scandir(folder) as entries:
                found = sorted(entries, key=lambda entry: entry.name)
        except OSError:
            continue
        below = [Path(entry) for entry in found if entry.is_dir(follow_symlinks=False)]
        links = {entry.name for entry in found if entry.is_symlink() and Path(entry).is_dir()}
        no_files = links.union(one.name for one in below)
        yield folder, [entry.name for entry in found if entry.name not in no_files]
        left += reversed(below)


def _plain(name: str) -> str:
    """Return a file's name without extension and frame number, for comparison.

    >>> _plain("A001C003.mov"), _plain("sh010.1001.exr"), _plain("sh010.####.exr"), _plain("v2.mov")
    ('a001c003', 'sh010', 'sh010', 'v2')
    """
    stem = _stem(name)
    if clip_sequence.extension(name) not in clip_sequence.IMAGE_EXTENSIONS:
        return stem
    pattern = re.search(r"[._ -]?(%0?[0-9]*d|#+|@+|\[[0-9]+-[0-9]+\])$", stem)
    if pattern:
        return stem[: pattern.start()]
    numbered = clip_sequence.frame_number(stem)
    return stem if numbered is None else numbered[0].rstrip("._- ") or stem


def _stem(name: str) -> str:
    """Return a file's name without extension, in lower case."""
    # The text after the last dot of a clip's name need not be an extension.
    known = clip_sequence.MOVIE_EXTENSIONS | clip_sequence.IMAGE_EXTENSIONS | CAMERA
    return (Path(name).stem if clip_sequence.extension(name) in known else name).lower()


def _most_alike(files: list[Path], path: Path) -> list[Path]:
    """Return the media whose folders agree longest with a path's folders, from the file upwards."""
    if len(files) < 2:
        return files

    def agreement(file: Path) -> int:
        count = 0
        for a, b in zip(reversed(file.parent.parts), reversed(path.parent.parts), strict=False):
            if a.lower() != b.lower():
                break
            count += 1
        return count

    most = max(agreement(file) for file in files)
    return [file for file in files if agreement(file) == most]


def as_clip(path: Path) -> str | None:
    """Return the `open_clip` name for a path in a timeline; None if the media does not exist.

    The first file of a sequence, or a pattern with a range, means the whole sequence.
    """
    match = _NUMBERS.search(path.name)
    image = clip_sequence.extension(path) in clip_sequence.IMAGE_EXTENSIONS
    if match and image and path.parent.is_dir():
        before, after = path.name[: match.start()], path.name[match.end() :]
        for sequence in clip_sequence.sequences_in(path.parent):
            if (sequence.prefix, sequence.suffix) == (before, after):
                return sequence.pattern
    return str(path) if path.exists() else None
