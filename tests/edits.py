"""Media and timelines for the tests of edits, written as real files."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import opentimelineio as otio
from any_clips import harbour, landscape
from clip_files import write_image, write_movie

SMALL = slice(None, None, 4)


def picture(i: int, scene: Any = landscape) -> Any:
    """(16, 24, 3) 8-bit picture number `i` of a scene."""
    return np.ascontiguousarray(
        np.rint(np.clip(scene(i / 30)[SMALL, SMALL], 0, 1) * 255).astype(np.uint8)
    )


def sequence(folder: Path, name: str, first: int, count: int, scene: Any = landscape) -> Path:
    """Write NAME.FFFF.png; return the pattern."""
    for i in range(count):
        write_image(folder / f"{name}.{first + i:04d}.png", picture(i, scene))
    return folder / f"{name}.####.png"


def movie(
    path: Path, count: int, *, timecode: str = "", cut: int | None = None, scene: Any = landscape
) -> Path:
    """Write a movie; with `cut`, another picture from that frame on."""
    path.parent.mkdir(parents=True, exist_ok=True)
    pictures = [picture(i, scene if cut is None or i < cut else harbour) for i in range(count)]

    def prepare(stream: Any) -> None:
        if timecode:
            stream.metadata["timecode"] = timecode

    rate = Fraction(24)
    write_movie(path, "png", "rgb24", pictures, "rgb24", rate=rate, prepare=prepare)
    return path


def span(first: float, count: float, rate: float = 24) -> otio.opentime.TimeRange:
    """A range of time in frames."""
    time = otio.opentime.RationalTime
    return otio.opentime.TimeRange(time(first, rate), time(count, rate))


def external(url: str, available: otio.opentime.TimeRange | None = None) -> Any:
    """A reference to a file."""
    return otio.schema.ExternalReference(target_url=url, available_range=available)


def numbered(base: str, name: str, first: int, count: int, starts: float = 0) -> Any:
    """A reference to an image sequence whose first frame is `starts` in its time."""
    return otio.schema.ImageSequenceReference(
        target_url_base=base,
        name_prefix=f"{name}.",
        name_suffix=".png",
        start_frame=first,
        frame_step=1,
        rate=24,
        frame_zero_padding=4,
        available_range=span(starts, count),
    )


def clip(name: str, reference: Any, first: float, count: float, **more: Any) -> Any:
    """A clip that shows `count` frames from `first` of its media's time."""
    return otio.schema.Clip(
        name=name, media_reference=reference, source_range=span(first, count), **more
    )


def gap(count: float) -> Any:
    """Nothing, for so many frames."""
    return otio.schema.Gap(source_range=span(0, count))


def dissolve(before: float, after: float) -> Any:
    """A transition that takes `before` frames in front of the cut and `after` behind it."""
    time = otio.opentime.RationalTime
    return otio.schema.Transition(
        transition_type="SMPTE_Dissolve", in_offset=time(before, 24), out_offset=time(after, 24)
    )


def timeline(*items: Any, name: str = "edit") -> Any:
    """A timeline of one video track."""
    track = otio.schema.Track(name="V1", kind="Video", children=list(items))
    found = otio.schema.Timeline(name=name)
    found.tracks.append(track)
    return found


def save(made: Any, path: Path) -> Path:
    """Write a timeline."""
    otio.adapters.write_to_file(made, str(path))
    return path
