"""The metadata of a clip's files, for the movie or the frames that are made of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

from palette4d.media.colour_tags import ColourTags

Fields = Literal["", "tff", "bff"]


@dataclass(frozen=True)
class Stated:
    """Properties that a delivery keeps.

    Attributes
    ----------
    tags : primaries, transfer, matrix and range.
    headroom : code values below 0 and above 1 may be picture, as in Y'CbCr.
    pixel_aspect : width of a pixel over its height.
    fields : which field of a frame comes first, "tff" or "bff"; "" for progressive pictures.
    field_order : FFmpeg's number for the order in which the file stores and shows fields.
    reel : name of the reel or the camera's roll, or "".
    timecode : `HH:MM:SS:FF` of frame 0 of a movie, or "".
    texts : (name, text) of a movie's other metadata, such as its title and time of creation.
    handler : name of a movie's video track, or "".
    hdr10 : mastering display and light levels, as the options of x265; "" if there are none.
    made_by : program and grade that made a movie, in its video track's title, or "".
    """

    tags: ColourTags = field(default_factory=ColourTags)
    headroom: bool = False
    pixel_aspect: Fraction = Fraction(1)
    fields: Fields = ""
    field_order: int = 0
    reel: str = ""
    timecode: str = ""
    texts: tuple[tuple[str, str], ...] = ()
    handler: str = ""
    hdr10: str = ""
    made_by: str = ""
