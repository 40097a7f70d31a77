"""How a clip is read, as a part of its name: `comp.####.exr?layer=diffuse&view=left`.

A sidecar's `clip.source` holds it, so that every program reads the clip in the same way.
"""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass, replace
from typing import Any

from palette4d.common.errors import Palette4dError
from palette4d.media.clip_sequence import IMAGE_EXTENSIONS, MOVIE_EXTENSIONS, extension
from palette4d.media.colour_tags import MATRICES

_SUFFIX = re.compile(r"\?((?:layer|view|matrix)=[^?&]*(?:&(?:layer|view|matrix)=[^?&]*)*)$")


@dataclass(frozen=True)
class Reading:
    """What to read of a clip's files.

    Attributes
    ----------
    layer, view : of EXR; None for the first that has red, green and blue; "" is the main one.
    matrix : of Y'CbCr movies that state none: a name of `MATRICES`; None for the rule.
    """

    layer: str | None = None
    view: str | None = None
    matrix: str | None = None

    def __post_init__(self) -> None:
        """Check the matrix."""
        if self.matrix is not None and self.matrix not in MATRICES:
            raise Palette4dError(
                f"found the matrix {self.matrix!r}, expected one of {', '.join(MATRICES)}"
            )

    def __str__(self) -> str:
        """Return the end of a clip's name; "" for the usual way."""
        given = [f"{name}={value}" for name, value in asdict(self).items() if value is not None]
        return "?" + "&".join(given) if given else ""


def split(spec: str) -> tuple[str, Reading]:
    """Return a clip's name without and with the way in which it is read.

    >>> split("a.####.exr?layer=diffuse")
    ('a.####.exr', Reading(layer='diffuse', view=None, matrix=None))
    """
    match = _SUFFIX.search(spec)
    if match is None:
        return spec, Reading()
    given = dict(pair.split("=", 1) for pair in match[1].split("&"))
    return spec[: match.start()], Reading(**given)


def read_as(spec: str, **asked: Any) -> str:
    """Add layer, view and matrix to a clip's name; None keeps the name's own.

    >>> read_as("a.mov?matrix=709", matrix=None), read_as("a.exr", view="left")
    ('a.mov?matrix=709', 'a.exr?view=left')
    """
    name, before = split(spec)
    chosen = asdict(before) | {key: value for key, value in asked.items() if value is not None}
    return name + str(Reading(**chosen))


def like_source(spec: str, source: str) -> str:
    """Return a clip's name, read as a sidecar's source is unless it says itself how.

    Only EXR has layers and views, and only movies have a matrix: a proxy may be another kind.

    >>> like_source("a.mov", "b.####.exr?view=left"), like_source("a.exr?layer=", "b.exr?layer=id")
    ('a.mov', 'a.exr?layer=')
    """
    name, own = split(spec)
    if str(own):
        return spec
    given, kind = split(source)[1], extension(name)
    if kind in IMAGE_EXTENSIONS:
        given = replace(given, matrix=None)
    if kind in MOVIE_EXTENSIONS or (kind in IMAGE_EXTENSIONS and kind != "exr"):
        given = replace(given, layer=None, view=None)
    return name + str(given)
