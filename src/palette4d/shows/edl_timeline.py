"""The timeline of an EDL, with the frames, speeds and CDLs that its events state.

OpenTimelineIO's adapter makes the timeline. It gets the events in the form that it reads: frame
numbers, sources as long as records, each event with a number of its own. Motion effects and CDLs
are put on the clips afterwards.
"""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

from palette4d.common.errors import Arg, Palette4dError
from palette4d.media.clip_base import DEFAULT_RATE, as_rate
from palette4d.shows import edl_cdl, edl_text
from palette4d.shows.edl_text import UNFOLLOWED, Event, Motion

#: Begins a comment of ours: the adapter keeps comments with their clip.
_MARK = "PALETTE4D EVENT"


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
    return dict(zip(places, numbers, strict=True))


def _made(path: Path, data: bytes, rate: Fraction, otio: Any) -> tuple[Any, list[int]]:
    """Return the timeline, and the number of the event of each clip, in the timeline's order."""
    text = edl_text.decoded(data)
    try:
        _check_rate(rate, otio)
        events = edl_text.events_of(text, rate)
        motions = [edl_text.motion_of(event, rate) for event in events]
        written = [
            _written(i, event, motion)
            for i, (event, motion) in enumerate(zip(events, motions, strict=True))
        ]
        source = "\n".join([f"TITLE: {edl_text.title_of(text)}", *written])
        made = otio.adapters.read_from_string(source, "cmx_3600", rate=float(rate))
    except Palette4dError as error:
        raise Palette4dError(f"{path}: {error}") from None
    numbers = [_finish(clip, events, motions, otio) for clip in made.find_clips()]
    _rebase(made, otio)
    return made, numbers


def _check_rate(rate: Fraction, otio: Any) -> None:
    if not otio.opentime.RationalTime.is_smpte_timecode_rate(float(rate)):
        raise Palette4dError(
            f"found the rate {float(rate):.6g}, which has no timecodes; expected 23.976, 24, 25, "
            f"29.97, 30, 48, 50, 59.94 or 60 as {Arg('rate')}"
        )


def _written(index: int, event: Event, motion: Motion) -> str:
    """Return an event for the adapter."""
    number = f"{index + 1:06d}"
    lines = []
    for line in event.lines:
        source = motion.start if line is event.own else line.source[0]
        begin, stop = line.record
        if line.kind.startswith("K"):
            raise Palette4dError(
                f"line {event.place}: found a key, {line.kind}, which is not followed; expected a "
                "cut (C), dissolve (D) or wipe (W001)"
            )
        kind = "C" if len(event.lines) == 1 else f"{line.kind} {line.length}".strip()
        lines.append(
            f"{number} {line.reel} {line.channel} {kind} {source} {source + stop - begin} "
            f"{begin} {stop}"
        )
    kept = [
        comment
        for comment in event.comments
        if not edl_text.is_motion(comment) and not edl_cdl.is_cdl(comment)
    ]
    return "\n".join([*lines, *kept, f"* {_MARK} {index}"])


def _finish(clip: Any, events: list[Event], motions: list[Motion], otio: Any) -> int:
    """Put an event's motion effect and CDL on its clip, and take our comment from it.

    Return the event's number in the list.
    """
    own = clip.metadata["cmx_3600"]
    comments = [str(comment) for comment in own["comments"]]
    mark = next(comment for comment in comments if comment.startswith(_MARK))
    index = int(mark.removeprefix(_MARK))
    rest = [comment for comment in comments if comment != mark]
    if rest:
        own["comments"] = rest
    else:
        del own["comments"]
    if not own:
        del clip.metadata["cmx_3600"]
    # The adapter counts numbers of its own.
    if clip.name == f"{index + 1:06d}":
        clip.name = events[index].own.number
    motion, schema = motions[index], otio.schema
    if motion.problem:
        clip.effects.append(schema.TimeEffect(name=motion.problem, effect_name=UNFOLLOWED))
    elif motion.speed == 0:
        clip.name = clip.name.removesuffix(" FF")
        clip.effects.append(schema.FreezeFrame())
    elif motion.speed != 1:
        clip.effects.append(schema.LinearTimeWarp(time_scalar=motion.speed))
    if cdl := edl_cdl.of_comments(events[index].comments):
        clip.metadata["cdl"] = cdl.metadata
    return index


def _rebase(timeline: Any, otio: Any) -> None:
    """Let all tracks of an EDL begin with the first track; later tracks get a leading gap.

    The EDL adapter stores a track's first record timecode as a negative start. OpenTimelineIO would
    take it as a range and show nothing of the track.
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
    timeline.global_start_time = otio.opentime.RationalTime(-first.value, first.rate)
