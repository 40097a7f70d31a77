"""The codecs of movies that can be written, and which one a file gets."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from palette4d.media.colour_tags import HLG, PQ
from palette4d.media.frame_writer import OutputError


@dataclass(frozen=True)
class Codec:
    """A codec of FFmpeg, and the samples that it takes.

    Attributes
    ----------
    layout, alpha_layout : FFmpeg's pixel formats, without and with alpha; "" if it has no alpha.
    bits : of a sample.
    across, down : pixels that share a chroma sample.
    options : of the encoder; a "crf" may be chosen by the user.
    extensions : of the files that hold it.
    full_range, interlaced : whether it can hold these.
    least : the smallest width and height.
    """

    name: str
    encoder: str
    layout: str
    bits: int
    across: int
    down: int
    options: dict[str, str]
    extensions: tuple[str, ...] = ("mov",)
    alpha_layout: str = ""
    full_range: bool = False
    interlaced: bool = True
    least: tuple[int, int] = (1, 1)


_PRORES = {"vendor": "apl0"}
_BOTH = ("mp4", "mov")
_HEVC = {"crf": "14", "x265-params": "log-level=error"}
CODECS = {
    codec.name: codec
    for codec in (
        Codec("prores422hq", "prores_ks", "yuv422p10le", 10, 2, 1, _PRORES | {"profile": "hq"}),
        Codec(
            "prores4444",
            "prores_ks",
            "yuv444p10le",
            10,
            1,
            1,
            _PRORES | {"profile": "4444", "alpha_bits": "16"},
            alpha_layout="yuva444p10le",
        ),
        Codec(
            "dnxhr-hqx",
            "dnxhd",
            "yuv422p10le",
            10,
            2,
            1,
            {"profile": "dnxhr_hqx"},
            interlaced=False,
            least=(256, 120),
        ),
        Codec(
            "dnxhr-444",
            "dnxhd",
            "yuv444p10le",
            10,
            1,
            1,
            {"profile": "dnxhr_444"},
            interlaced=False,
            least=(256, 120),
        ),
        Codec("h264", "libx264", "yuv420p", 8, 2, 2, {"crf": "14"}, _BOTH, full_range=True),
        Codec("hevc", "libx265", "yuv420p10le", 10, 2, 2, _HEVC, _BOTH, "", True, False, (16, 16)),
    )
}
MOVIES = tuple(dict.fromkeys(end for codec in CODECS.values() for end in codec.extensions))


def is_movie(path: Path) -> bool:
    """Return whether a name has the extension of a movie that can be written."""
    return path.suffix.lower().lstrip(".") in MOVIES


def codec_for(path: Path, asked: str | None, transfer: int) -> Codec:
    """Return the codec of a movie: the one that is asked for, else by its name and its transfer.

    8 bits of PQ and HLG show bands, so these get HEVC in 10 bits.
    """
    extension = path.suffix.lower().lstrip(".")
    if asked is None:
        by_name = {"mov": "prores422hq", "mp4": "hevc" if transfer in (PQ, HLG) else "h264"}
        return CODECS[by_name[extension]]
    codec = CODECS.get(asked)
    if codec is None:
        raise OutputError(f"found the codec {asked!r}, expected one of {', '.join(CODECS)}")
    if extension not in codec.extensions:
        raise OutputError(
            f"output {path}: found the codec {asked} for .{extension}, expected "
            f"{' or '.join(f'.{one}' for one in codec.extensions)}; name the movie so"
        )
    return codec
