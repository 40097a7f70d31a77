"""What a user is told of all picks together: what else they change, and what limits them.

The command line and the window show the same sentences.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from palette4d.common.text import counted, hex_of
from palette4d.grade.effects import TAKEN, Around, SideEffect
from palette4d.grade.picks import Pick

#: The share of the picture above which it is said what else picks change.
MANY = 0.1


def changed(effect: SideEffect) -> str:
    """Return how much of the picture picks change."""
    end = "; no frame changes more of others" if effect.others > 0 else ""
    return (
        f"at frame {effect.frame:.0f}, {effect.share:.0%} of the picture's pixels change by more "
        "than 10 of 255, or are greys with a tint of more than 5: "
        f"{effect.share - effect.others:.0%} near the picked colours and their shades, "
        f"{effect.others:.0%} others{end}"
    )


def notes(
    picks: Iterable[Pick],
    effect: SideEffect,
    around: Mapping[str, Around],
    *,
    scene_linear: bool,
    has_clip_colours: bool,
) -> list[str]:
    """Return what speaks against enabled picks, and what helps."""
    found = []
    if effect.others > MANY:
        found.append(f"of the others {hex_of(effect.most)} changes most. {_remedy(effect)}")
    for id_, near in around.items():
        found += [
            f"the hold {hold} takes {taken:.0%} of what {id_}'s colour and its shades would get at "
            f"frame {near.frame:.0f}. If that is too much, a smaller hold takes less: radius=0.05"
            for hold, taken in near.taken.items()
            if taken > TAKEN
        ]
    found += [
        f"the new colour of {pick.id} lies far outside 0..1; most files clip it"
        for pick in (() if scene_linear else picks)
        if pick.to is not None and not all(-0.05 <= value <= 1.05 for value in pick.to)
    ]
    if not has_clip_colours:
        found.append(
            "this sidecar has no colours of its clip, so that only the palette's colours are "
            "guarded. Analyse the clip again for a better guard"
        )
    return found


def _remedy(effect: SideEffect) -> str:
    if not effect.holds:
        return (
            f"A hold of it would take more than {TAKEN:.0%} of what a picked colour and its shades "
            "get, or would not help; a mask of the host parts them"
        )
    colours = " and ".join(hex_of(rgb) for rgb in effect.holds)
    return (
        f"If the others must stay, {counted(len(effect.holds), 'hold')} at frame "
        f"{effect.frame:.0f}, of {colours}, would leave {effect.left:.0%}"
    )
