"""What a report's figures mean for the user: warnings, each with what would help.

Input: the `Report` of a finished palette, the options it was found with, and how far outside the
farthest pixels lie at each stage. Output: sentences. What helps differs from method to method: an
option that a method does not look at is never advised. docs/palettes.md says on which clips each
was tried.
"""

from __future__ import annotations

from collections.abc import Mapping

from palette4d.analysis.losses import LOST_SHARE
from palette4d.analysis.options import METHODS_OF, AnalysisOptions
from palette4d.analysis.report.quality import DENT, Report

from palette4d.common.text import counted

# What is worth a warning.
BAD_FRAME = 4.0  # times the median frame's L ...
BAD_L = 0.3  # ... and at least this, or the clip's mean
LOOKALIKE = 0.06  # RGB distance of two handles
UNUSED = 0.001  # largest mean weight of a handle in any frame
FARTHER = 1.4  # times as far out as a simpler palette leaves them: lost pixels
# What lets colours change at once: less held against a jump, handles cheaper, more blocks.
AT_ONCE = {"gamma": 0.0003, "handle_cost": 0.001, "blocks": 9}
# No display-referred picture and no log goes so far.
BRIGHT = 2.0

DEFAULT = "the default --method skew"


def warnings(
    report: Report,
    options: AnalysisOptions,
    farthest: Mapping[str, float],
    *,
    brightest: float,
) -> tuple[str, ...]:
    """Return what does not fit, with what would help.

    Parameters
    ----------
    report : of the finished palette.
    options : what it was found with.
    farthest : for each stage of the analysis, how far outside its farthest pixel lies.
    brightest : its largest number. Where that is scene-linear light distances mean little: nothing
        else is said then.
    """
    if brightest > BRIGHT:
        return (
            f"the clip's numbers go to {brightest:.3g}: if it is scene-linear light, neither these "
            "figures nor other options are of use; say what it is with --input-space (ACEScg, for "
            "example) and leave --palette-space out: the palette is then found in a log encoding",
        )
    found = (
        _fit(report, options),
        _lost(report, options, farthest),
        _lookalikes(report, options),
        _dent(report),
        _unused(report, options),
    )
    return tuple(text for text in found if text)


def _fit(x: Report, options: AnalysisOptions) -> str:
    """Frames that the palette fits loosely."""
    bad = [f.frame for f in x.fits if max(BAD_L, BAD_FRAME * x.median_loss) < f.L]
    if bad:
        names = ", ".join(map(str, bad[:8])) + (", …" if len(bad) > 8 else "")
        what = (
            f"{len(bad)} of {counted(len(x.fits), 'frame')} fit badly (L up to {x.worst.L:.2f}, "
            f"the median frame {x.median_loss:.2f}): {names}"
        )
    elif x.mean_loss > BAD_L:
        what = f"the palette fits the clip loosely (mean L {x.mean_loss:.2f})"
    else:
        return ""
    at_once = " ".join(f"--{name.replace('_', '-')} {at:g}" for name, at in AT_ONCE.items())
    if options.method in ("static", "rgbt"):
        ways = f"{DEFAULT} follows the colours"
        if bad:
            ways += f", with {at_once} also those of a flash"
        return f"{what}; {ways}"
    if options.method == "paper":
        ways = "lower --eta2 or --eta1 for more handles"
        ways += ", lower --gamma for those of a flash" if bad else f", take {DEFAULT}"
    elif options.vertices:
        ways = "raise --vertices"
    elif options.handle_cost > AnalysisOptions().handle_cost:
        ways = "lower --handle-cost for more handles"
    elif bad:
        if (
            options.gamma <= AT_ONCE["gamma"]
            and options.handle_cost <= AT_ONCE["handle_cost"]
            and options.blocks >= AT_ONCE["blocks"]
        ):
            return f"{what}; analyse parts of the clip apart with --frames"
        return (
            f"{what}; analyse parts of the clip apart with --frames, or try {at_once}, with which "
            "colours may change at once, as in a flash"
        )
    else:
        ways = "lower --handle-cost or raise --blocks for more handles"
    return f"{what}; {ways}, or analyse parts of the clip apart with --frames"


def _lost(x: Report, options: AnalysisOptions, farthest: Mapping[str, float]) -> str:
    """Rare colours, such as lights, that simpler palettes hold better."""
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
    ways = f"{DEFAULT} follows the colours"
    if options.method in METHODS_OF["reach"]:
        reach = f"lower --reach (to {options.reach / 2:.2g}, say)"
        if options.reach == 0:  # without it no distance counts more than once
            reach = f"raise --reach to {AnalysisOptions().reach:g}"
        ways = (
            f"raise --lambda (to {10 * options.lambda_:g}, say) or {reach}, so that rare colours "
            f"count more, or lower --k where they are fewer than {options.k:g} pixels"
        )
    static = ", or take --method static" if "one static palette leaves" in nearer else ""
    return (
        f"in frame {frame.frame} colours of {frame.lost:.2%} of the picture lie up to "
        f"{frame.farthest:.2f} outside the palette, where {where}: if they are lights rather than "
        f"faulty pixels, {ways}{static}"
    )


def _lookalikes(x: Report, options: AnalysisOptions) -> str:
    if x.closest is None or x.closest[0] >= LOOKALIKE:
        return ""
    distance, frame, one, other = x.closest
    ways = "ask for a smaller --palette-size, or raise --separation or --merge-distance"
    if options.method == "rgbt":
        ways = f"{DEFAULT} keeps them apart"
    elif options.method == "skew":  # in a short clip the result may be a static palette
        ways += ", or, where little moves, take --method static"
    return (
        f"near frame {frame} the handles {one} and {other} are hard to tell apart "
        f"({distance:.2f} apart): {ways}"
    )


def _dent(x: Report) -> str:
    if x.dent[0] <= DENT:
        return ""
    return (
        f"at frame {x.dent[1]} the palette is dented (it lacks {x.dent[0]:.0%} of its convex hull)"
        ": raise --convexity, or recoloured gradients may step there"
    )


def _unused(x: Report, options: AnalysisOptions) -> str:
    handle, use = x.least_used
    if use >= UNUSED:
        return ""
    ways = {
        "skew": "raise --handle-cost, or ask for fewer --vertices",
        "paper": "raise --eta2",
        "static": "raise --merge-distance, or ask for a smaller --palette-size",
        "rgbt": "ask for fewer --vertices",
    }
    return (
        f"the handle {handle} weighs less than {UNUSED:.1%} in every frame: "
        + (ways[options.method])
    )
