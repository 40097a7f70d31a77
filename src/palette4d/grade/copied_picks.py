"""Copied picks: the picks of another palette as they are in this one.

In palettes of the same pictures they stay as they are. Else they are learned again from this
palette's clip, and followed: those that were picked in an earlier version of the clip at their
place, if it has nearly their colour; others where their colour is.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palette4d.common.errors import Palette4dError
from palette4d.grade.clip_of_picks import ClipOfPicks
from palette4d.grade.correspondence import Match
from palette4d.grade.edits import Colour, Key, as_colour
from palette4d.grade.grade import Grade
from palette4d.grade.pick_edits import asked_text, with_mattes
from palette4d.grade.picks import Pick
from palette4d.media.source_clip import nearest


@dataclass(frozen=True)
class Lost:
    """What of copied picks is not as it was; its text is for people.

    Attributes
    ----------
    elsewhere : tuple of str
        The ids of copied picks whose place in the clip has another colour now, or is gone.
    left_out : tuple of str
        The picks whose colour is not in the target's clip, with what they are, for people.
    everywhere : tuple of str
        The ids of copied picks that have a window in the source: windows are not copied.
    uncorrected : tuple of str
        The ids of copied picks that are followed without what the user said of their paths.
    unseen : tuple of str
        The ids of copied picks with areas at frames that are gone, or cannot be read.
    unlearned : tuple of str
        The ids of copied picks that take all of their hue, as there is no clip to learn from.
    """

    elsewhere: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    everywhere: tuple[str, ...] = ()
    uncorrected: tuple[str, ...] = ()
    unseen: tuple[str, ...] = ()
    unlearned: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return "; picked where ...: p1; not copied, since ...: p2"; "" if nothing is lost."""
        told = {
            "picked where their colour is, since their place has another colour here, or their "
            "frame is gone": self.elsewhere,
            "not copied, since nothing connected has the colour here": self.left_out,
            "without a window, since that is a place in the other clip": self.everywhere,
            "followed without the corrections of their paths": self.uncorrected,
            "without areas whose frames are gone, or cannot be read": self.unseen,
            "of all colours of their hue, since the clip was not found": self.unlearned,
        }
        return "".join(f"; {what}: {', '.join(ids)}" for what, ids in told.items() if ids)


NONE_LOST = Lost()


def with_picks(
    grade: Grade,
    match: Match,
    clip: ClipOfPicks,
    *,
    same_clip: bool,
    unread: Collection[str] = (),
) -> tuple[Grade, Lost]:
    """Return a grade with the picks of the match's source, and what of them is lost.

    `same_clip` says that the source is of an earlier version of the clip; `unread` has the ids of
    picks for which the clip was not read yet.
    """
    source, opened = match.source, clip.open()
    names = [each.members["clip"]["name"] for each in (grade, source)]
    same = match.same_pictures and (same_clip or names[0] == names[1])
    same_clip = same_clip or same
    if same and not (unread and opened):
        kept = [pick.shifted(grade.frames[0] - source.frames[0]) for pick in source.picks]
        # A picture that was mirrored or cropped may have the same colours at other places.
        if opened is None or all(in_place(clip, pick) for pick in kept if pick.pixel is not None):
            picks: dict[Key, Pick] = {("pick", pick.id): pick for pick in kept}
            return grade.having(picks).with_mattes(source.mattes), NONE_LOST
    first, last, _ = grade.frames
    there = [] if opened is None else [n for n in opened.frames if first <= n <= last]
    begin, end, _ = source.frames
    copies: list[tuple[Pick, Pick]] = []
    left_out, elsewhere, uncorrected, unseen = [], [], [], []
    for former in source.picks:
        pick = _timed(match, former, there or range(first, last + 1), same_clip=same_clip)
        if pick is None:
            continue
        here: Pick | None = pick
        if opened is not None:
            seen = _seen(clip, pick)
            unseen += [pick.id] * (len(seen.areas) < len(former.areas) * same_clip)
            pick = seen
            here = _found(match, clip, former, pick, same_clip=same_clip)
        if here is None:
            left_out.append(f"{pick.id} ({asked_text(pick)})")
            continue
        stays = here.pixel is not None and (here.frame, here.pixel) == (pick.frame, pick.pixel)
        if same_clip and former.pixel is not None and not stays:
            elsewhere.append(pick.id)
        # In a palette of one frame nothing could be followed.
        if opened is not None and (former.path or former.id in unread or begin == end):
            # What the user said of other frames holds where the place does.
            given = [key for key in pick.path if key.given and stays]
            corrections = [key for key in former.path if key.given and key.frame != former.frame]
            followed_from = [key for key in given if key.frame != here.frame]
            uncorrected += [pick.id] * (len(followed_from) < len(corrections))
            if here.window is not None and former.id in unread:
                here = replace(here, window=clip.window(here, here.window))
            here = replace(here, path=clip.path(here, given))
        copies.append((former, here))
    grade = grade.having({("pick", pick.id): pick for _, pick in copies})
    lost = Lost(
        tuple(elsewhere),
        tuple(left_out),
        tuple(pick.id for former, pick in copies if former.window and not pick.window),
        tuple(uncorrected),
        tuple(unseen),
        tuple(pick.id for former, pick in copies if former.matte and opened is None),
    )
    return with_mattes(grade, clip, [pick for _, pick in copies]), lost


def _found(
    match: Match, clip: ClipOfPicks, former: Pick, pick: Pick, *, same_clip: bool
) -> Pick | None:
    """Return a pick with its colour in the clip, or where that is; None where it is not."""
    spaces = {match.target.encoding, match.source.encoding}
    # Else no colours can be compared.
    told = len(spaces) == 1 or "unknown" not in spaces
    if pick.pixel is not None:
        if (rgb := in_place(clip, pick, told=told)) is not None:
            return replace(pick, rgb=rgb)
        pick = replace(pick, areas=(), window=None)
    elif pick.whole_hue or (same_clip and former.pixel is None):
        return pick
    return clip.at_home(pick, match.target.display())


def _seen(clip: ClipOfPicks, pick: Pick) -> Pick:
    """Return a pick with those areas and corrections alone whose frames can be read."""
    return replace(
        pick,
        areas=tuple(area for area in pick.areas if clip.shows(area.frame)),
        path=tuple(key for key in pick.path if not key.given or clip.shows(key.frame)),
    )


def in_place(clip: ClipOfPicks, pick: Pick, *, told: bool = True) -> Colour | None:
    """Return the colour at a pick's place; None if it is another one, where that can be `told`."""
    assert pick.pixel is not None
    try:
        rgb = clip.colour(pick.frame, pick.pixel, pick.box or 1)
    except Palette4dError:  # the place has no colour; a bad frame
        return None
    return rgb if not told or clip.alike(rgb, pick.rgb) else None


def _timed(match: Match, pick: Pick, frames: Sequence[int], *, same_clip: bool) -> Pick | None:
    """Return a pick in the target's times and colours; None if it is off at the chosen frame.

    `frames` are those of the target's clip.
    """
    _, into = match.conversions

    def colour(rgb: ArrayLike) -> Colour:
        own = np.array(rgb, float)
        return as_colour((own if into is None else into(own)).tolist())

    def time(frame: float) -> int:
        return nearest(frames, round(match.back(frame)))

    def end(frame: float | None) -> float | None:
        if frame is None or match.time == "same":
            return frame
        return float(round(match.back(frame)))

    always: dict[str, Any] = {"start": None, "until": None, "fade": 0.0, "fade_out": None}
    copy = replace(pick, path=(), matte=None, **always)
    if not same_clip:
        copy = replace(copy, pixel=None, box=None, areas=(), window=None)
    if pick.to is not None:
        copy = replace(copy, to=colour(pick.to))

    def picked_at(moment: float) -> Pick:
        rgb = pick.colour_at(moment)
        if pick.to is not None and pick.toward == "shift":
            return replace(copy, rgb=colour(rgb), to=colour(rgb + pick.change_at(moment)))
        return replace(copy, rgb=colour(rgb))

    if isinstance(match.time, str):
        first, last, _ = match.target.frames
        keys = {time(k.frame): k for k in pick.path if round(match.back(k.frame)) in frames}
        frame = time(pick.frame)
        if first <= match.back(pick.frame) <= last:
            copy = replace(copy, rgb=colour(pick.rgb))
        else:  # it was picked at a frame that is not in the target
            copy = replace(picked_at(match.there(frame)), pixel=None, box=None)
        inside = [area for area in copy.areas if round(match.back(area.frame)) in frames]
        window = copy.window
        if window is not None:
            boxes = {round(match.back(key.frame)): key for key in window.keys}
            window = replace(
                window, keys=tuple(replace(boxes[f], frame=float(f)) for f in sorted(boxes))
            )
        return replace(
            copy,
            frame=frame,
            areas=tuple(replace(area, frame=time(area.frame)) for area in inside),
            window=window,
            start=end(pick.start),
            until=end(pick.until),
            fade=pick.fade * match.pace,
            fade_out=None if pick.fade_out is None else pick.fade_out * match.pace,
            path=tuple(replace(keys[f], frame=f, rgb=colour(keys[f].rgb)) for f in sorted(keys)),
        )
    moment = float(match.time)
    strength = pick.strength_at(moment)
    if strength == 0:
        return None
    still = replace(picked_at(moment), frame=match.target.frames[0])
    if pick.to is None or strength == 1:
        return still
    within_a_ramp = pick.colour_at(moment) + strength * pick.change_at(moment)
    return replace(still, to=colour(within_a_ramp))
