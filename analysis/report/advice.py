"""Warnings about a finished palette, each with a remedy.

Input: the `Report` of a finished palette, the options it was found with, and the farthest pixel at
each stage. Output: sentences. A remedy names only options that affect the method in use.
docs/palettes.md lists the warnings, docs/lab/palettes.md the clips that show the remedies.
"""

from __future__ import annotations

from collections.abc import Mapping

from palette4d.analysis.convex_hulls import CONCAVE
from palette4d.analysis.losses import LOST_SHARE
from palette4d.analysis.options import LIKE, OPTIONS, AnalysisOptions
from palette4d.analysis.report.quality import Report

from palette4d.common.message import Arg, Message
from palette4d.common.text import counted, some_of

# Thresholds of L for a badly fitting frame: a multiple of the median frame's L, and an L.
BAD_FRAME, BAD_L = 4.0, 0.3
# RGB distance below which two handles are hard to tell apart.
LOOKALIKE = 0.06
# A handle is unused if its mean weight is below this threshold in every frame.
UNUSED = 0.001
# Lost pixels are reported if they are farther outside than with a simpler palette, by this factor.
FARTHER = 1.4
# Settings that let colours change from one frame to the next.
AT_ONCE = {"gamma": 0.0003, "handle_cost": 0.001, "blocks": 9}
# No display-referred picture and no log encoding has larger code values.
BRIGHT = 2.0

#: The remedies for the palettes of other methods, and for those of earlier versions.
DEFAULT = f"take the default {Arg('method', 'skew')}"
ANEW = f"leave out {Arg('like')}, so that a palette is found anew"
PARTS = f"analyse parts of the clip by themselves with {Arg('frames')}"


def warnings(
    report: Report,
    options: AnalysisOptions,
    farthest: Mapping[str, float],
    *,
    brightest: float,
    linear: str = "",
) -> tuple[Message, ...]:
    """Return the warnings about a palette.

    Parameters
    ----------
    report : of the finished palette.
    options : the options that it was found with.
    farthest : the distance of the farthest pixel outside, by stage.
    brightest : the largest code value of the palette. Above `BRIGHT` the clip may be scene-linear,
        where distances mean little: that is then the only warning.
    linear : the encoding of the palette, if that is scene-linear.
    """
    if linear or brightest > BRIGHT:
        why = f"the clip has code values up to {brightest:.3g}: if it is scene-linear,"
        if linear:
            why = f"the clip is scene-linear ({linear}):"
        text = (
            f"{why} these figures mean little; give its colour space with {Arg('input_space')} "
            f"(such as ACEScg), and leave out {Arg('palette_space')}: the palette is then found in "
            "a log encoding"
        )
        return (Message(text),)
    texts = (
        _fit(report, options),
        _lost(report, options, farthest),
        _lookalikes(report, options),
        _concave(report),
        _unused(report, options),
    )
    return tuple(Message(text) for text in texts if text)


def _another(options: AnalysisOptions) -> str:
    """Return the remedy for a palette of another method: the default one."""
    return ANEW if options.method == LIKE else DEFAULT


def _fit(x: Report, options: AnalysisOptions) -> str:
    """Frames that the palette fits loosely."""
    bad = [f.frame for f in x.fits if max(BAD_L, BAD_FRAME * x.median_loss) < f.L]
    if bad:
        what = (
            f"{len(bad)} of {counted(len(x.fits), 'frame')} fit badly (L up to {x.worst.L:.2f}, "
            f"the median frame {x.median_loss:.2f}): {some_of(bad)}"
        )
    elif x.mean_loss > BAD_L:
        what = f"the palette fits the clip loosely (mean L {x.mean_loss:.2f})"
    else:
        return ""
    if options.method != "skew":
        ways = _another(options)
    elif options.vertices:
        ways = f"raise {Arg('vertices')}, or {PARTS}"
    elif bad:
        given = all(getattr(options, name) == value for name, value in AT_ONCE.items())
        settings = " ".join(f"{Arg(*setting)}" for setting in AT_ONCE.items())
        ways = PARTS if given else f"{PARTS}, or, for a flash, try {settings}"
    else:
        ways = f"lower the setting handle_cost or raise blocks, or {PARTS}"
    return f"{what}; {ways}"


def _lost(x: Report, options: AnalysisOptions, farthest: Mapping[str, float]) -> str:
    """Rare colours, such as small highlights, that simpler palettes hold better."""
    frame = x.most_lost
    simpler = {
        "single frames' hulls leave": "frame_hulls",
        "one static palette leaves": "static_hull",
    }
    nearer = {
        words: farthest[stage]
        for words, stage in simpler.items()
        if frame.farthest > FARTHER * farthest.get(stage, frame.farthest)
    }
    if frame.lost < LOST_SHARE or not nearer:
        return ""
    where = " and ".join(f"{words} {distance:.2f}" for words, distance in nearer.items())
    ways = _another(options)
    if options.method == "skew":
        reach = options.reach / 2 or OPTIONS["reach"].default
        ways = (
            f"try {Arg('lambda_', 10 * options.lambda_)} or {Arg('reach', reach)}, so that rare "
            f"colours count more, or a lower {Arg('k')} if they have fewer than {options.k:g} "
            "pixels"
        )
    static = f", or {Arg('method', 'static')}" if "one static palette leaves" in nearer else ""
    return (
        f"in frame {frame.frame} colours of {frame.lost:.2%} of the picture lie up to "
        f"{frame.farthest:.2f} outside the palette, where {where}: if they are highlights rather "
        f"than faulty pixels, {ways}{static}"
    )


def _lookalikes(x: Report, options: AnalysisOptions) -> str:
    if x.closest is None or x.closest[0] >= LOOKALIKE:
        return ""
    distance, frame, first, second = x.closest
    ways = _another(options)
    if options.method == "skew":
        ways = (
            "lower the setting palette_size, or raise separation or merge_distance; or, if little "
            f"moves, take {Arg('method', 'static')}"
        )
    return (
        f"near frame {frame} the handles {first} and {second} are hard to tell apart "
        f"({distance:.2f} apart): {ways}"
    )


def _concave(x: Report) -> str:
    if x.concavity[0] <= CONCAVE:
        return ""
    share, frame = x.crossed
    if share:
        return (
            f"at frame {frame} the palette crosses itself, and edits draw wild colours in "
            f"{max(share, 0.001):.1%} of the picture: raise {Arg('convexity')}, or choose another "
            f"colour space with {Arg('palette_space')}"
        )
    return (
        f"at frame {x.concavity[1]} the palette is not convex (it lacks {x.concavity[0]:.0%} of "
        f"its convex hull), and recoloured gradients may step there: raise {Arg('convexity')}"
    )


def _unused(x: Report, options: AnalysisOptions) -> str:
    handle, use = x.least_used
    if use >= UNUSED:
        return ""
    ways = _another(options)
    if options.method == "skew":
        ways = f"raise {Arg('handle_cost')}, or ask for fewer {Arg('vertices')}"
    return f"the handle {handle} weighs less than {UNUSED:.1%} in every frame: {ways}"
