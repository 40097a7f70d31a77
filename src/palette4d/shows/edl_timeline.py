"""The timeline of an EDL, with the frames, speeds and CDLs that its events state.

OpenTimelineIO's adapter makes the timeline of the events that `edl_items` writes for it. Motion
effects and CDLs are put on the clips afterwards.
"""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

from palette4d.common.errors import Arg, Palette4dError
from palette4d.media.clip_base import DEFAULT_RATE, as_rate
from palette4d.shows import edl_cdl, edl_items, edl_text
from palette4d.shows.edl_items import Item
from palette4d.shows.edl_motion import UNFOLLOWED


def timeline_of(path: Path, data: bytes, rate: Fraction | None, otio: Any) -> Any:
    """Return the timeline of an EDL's bytes; times begin at the first record of any track.

    `otio` is OpenTimelineIO. `Palette4dError` says which line is no event.
    """
    known = (None if rate is None else as_rate(float(rate))) or DEFAULT_RATE
    # Numbers drop at NTSC rates alone (SMPTE ST 12-1).
    if known in (30, 60) and edl_text.states_drop(edl_text.decoded(data)):
        known = Fraction(known * 1000, 1001)
    return _made(path, data, known, otio)[0]


def places_of(path: Path, data: bytes, rate: Fraction, otio: Any) -> dict[tuple[int, ...], int]:
    """Return the numbers of the events by the places of their clips: track, and item in it."""
    made, numbers = _made(path, data, rate, otio)
    places = [
        (i, k)
        for i, track in enumerate(made.tracks)
        for k, item in enumerate(track)
        if isinstance(item, otio.schema.Clip)
    ]
    return {
        place: number for place, number in zip(places, numbers, strict=True) if number is not None
    }


def _made(path: Path, data: bytes, rate: Fraction, otio: Any) -> tuple[Any, list[int | None]]:
    """Return the timeline, and the number of the event of each clip, in the timeline's order."""
    text = edl_text.decoded(data)
    try:
        _check_rate(rate, otio)
        events = edl_text.events_of(text, rate)
        items = edl_items.items_of(events, rate)
        # From 1: of a track that begins at 0 the adapter does not say so.
        origin = min((item.line.record[0] for item in items), default=0) - 1
        written = (item.text(origin) for item in items)
        source = "\n".join([f"TITLE: {edl_text.title_of(text)}", *written])
        made = otio.adapters.read_from_string(source, "cmx_3600", rate=float(rate))
    except Palette4dError as error:
        raise Palette4dError(f"{path}: {error}") from None
    numbers = [_finish(clip, items, otio) for clip in made.find_clips()]
    if events:
        made.metadata[edl_items.NAMESPACE] = {"drop_frame": events[0].own.record_drops}
    _rebase(made, origin, otio)
    return made, numbers


def _check_rate(rate: Fraction, otio: Any) -> None:
    if not otio.opentime.RationalTime.is_smpte_timecode_rate(float(rate)):
        raise Palette4dError(
            f"found the rate {float(rate):.6g}, which has no timecodes; expected 23.976, 24, 25, "
            f"29.97, 30, 48, 50, 59.94 or 60 as {Arg('rate')}"
        )


def _finish(clip: Any, items: list[Item], otio: Any) -> int | None:
    """Put a motion effect and a CDL on an item's clip, and take our comment from it.

    Return the number of its event in the list; None for an outgoing clip without an event.
    """
    own = clip.metadata[edl_items.NAMESPACE]
    comments = [str(comment) for comment in own["comments"]]
    mark = next(comment for comment in comments if comment.startswith(edl_items.MARK))
    item = items[int(mark.removeprefix(edl_items.MARK))]
    comments.remove(mark)
    if comments:
        own["comments"] = comments
    else:
        del own["comments"]
    own["drop_frame"] = item.line.drops
    # The adapter counts numbers of its own.
    if clip.name == item.name:
        clip.name = item.line.number
    motion, schema = item.motion, otio.schema
    start = otio.opentime.RationalTime(motion.start, clip.source_range.duration.rate)
    for one in (clip, clip.media_reference):
        name = "source_range" if one is clip else "available_range"
        if (counted := getattr(one, name)) is not None:
            setattr(one, name, otio.opentime.TimeRange(start, counted.duration))
    if motion.problem:
        clip.effects.append(schema.TimeEffect(name=motion.problem, effect_name=UNFOLLOWED))
    elif motion.speed == 0:
        clip.name = clip.name.removesuffix(" FF")
        clip.effects.append(schema.FreezeFrame())
    elif motion.speed != 1:
        clip.effects.append(schema.LinearTimeWarp(time_scalar=motion.speed))
    if item.number is not None and (cdl := edl_cdl.of_comments(item.comments)):
        clip.metadata["cdl"] = cdl.metadata
    return item.number


def _rebase(timeline: Any, origin: int, otio: Any) -> None:
    """Let all tracks of an EDL begin with the first track; later tracks get a leading gap.

    `origin` is the frame from which the record is counted. The EDL adapter stores a track's first
    record timecode as a negative start. OpenTimelineIO would take it as a range and show nothing of
    the track.
    """
    starts = [t.source_range.start_time for t in timeline.tracks if t.source_range is not None]
    if not starts:
        return
    first = max(starts)  # the least record timecode: the starts are its negative
    for track in timeline.tracks:
        if track.source_range is not None:
            late = first - track.source_range.start_time
            track.source_range = None
            if late.value > 0:
                track.insert(0, otio.schema.Gap(duration=late))
    timeline.global_start_time = otio.opentime.RationalTime(origin - first.value, first.rate)
