"""What frames of a movie state: rate, timecode, reel, pixel aspect and colours, for each format."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from palette4d.media.clip_base import Clip
from palette4d.media.colour_tags import chromaticities, interop_name
from palette4d.media.timecode import TIMECODE, decoded, encoded, moved, nominal

#: Metadata of one frame alone; OpenImageIO states the timecode of a DPX twice.
_OF_ONE_FRAME = (TIMECODE, "dpx:TimeCode", "smpte:KeyCode")
Metadata = tuple[tuple[str, Any, Any], ...]


def of_movie(clip: Clip, frame: int) -> Metadata:
    """Return the metadata of one frame of a movie, for OpenImageIO."""
    import OpenImageIO as oiio

    stated = clip.stated
    rate = (clip.rate.numerator, clip.rate.denominator)
    metadata: list[tuple[str, Any, Any]] = [
        ("FramesPerSecond", oiio.TypeDesc("rational"), rate),
        ("dpx:FrameRate", "float", float(clip.rate)),
        ("PixelAspectRatio", "float", float(stated.pixel_aspect)),
        *of_colours(clip),
    ]
    if stated.reel:
        metadata.append(("reelName", "string", stated.reel))
    if stated.timecode and _counts(clip.rate):
        word = encoded(moved(stated.timecode, frame, clip.rate))
        if word is not None:
            metadata.append((TIMECODE, oiio.TypeTimeCode, (word, 0)))
    return tuple(metadata)


def of_another_frame(metadata: Metadata, later: int, rate: Fraction) -> Metadata:
    """Return the metadata for another frame, `frames` later, with its own timecode."""
    kept = tuple(entry for entry in metadata if entry[0] not in _OF_ONE_FRAME)
    for name, kind, value in metadata:
        if name == TIMECODE and _counts(rate):
            word = encoded(moved(decoded(int(value[0])), later, rate))
            if word is not None:
                kept += ((name, kind, (word, *value[1:])),)
    return kept


def _counts(rate: Fraction) -> bool:
    """Whether a frame's 32 bits can count frames: above 30 a second they count pairs."""
    return nominal(rate) <= 30


def of_colours(clip: Clip) -> Metadata:
    """Return the colour tags of a clip as OpenImageIO's attributes."""
    tags = clip.stated.tags
    metadata: list[tuple[str, Any, Any]] = []
    if name := interop_name(tags):
        metadata.append(("oiio:ColorSpace", "string", name))
    if xy := chromaticities(tags.primaries):
        metadata.append(("chromaticities", "float[8]", xy))
    if tags.known:
        metadata.append(("CICP", "int[4]", (tags.primaries, tags.transfer, 0, 1)))
    return tuple(metadata)


def frame_notes(clip: Clip, extension: str) -> list[str]:
    """Return notes on the clip's metadata that frames of this format cannot hold."""
    tags, named = clip.stated.tags, clip.encoding
    notes = []
    if clip.stated.timecode and extension in ("exr", "dpx") and not _counts(clip.rate):
        notes.append(
            f"the frames have no timecode: {float(clip.rate):.6g} frames per second are above 30"
        )
    fits = {
        # EXR names spaces; those of other EXR are carried over.
        "exr": bool(interop_name(tags)) or not clip.is_movie,
        "png": tags.known,
        "dpx": named in ("sRGB", "Rec.709") or "linear" in named or not clip.is_movie,
    }.get(extension, named in ("sRGB", "Rec.709"))
    if named == "unknown" or fits:
        return notes
    return [
        *notes,
        f"the frames cannot say that their colours are {named}: .{extension} has no such tag",
    ]
