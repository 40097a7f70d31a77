"""From a clip to a sidecar document: frames are read, analysed by a method, and written down.

The order of section 5's stages stands in `methods`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from palette4d.analysis import cuts, methods, statistics
from palette4d.analysis.methods import Analysis, Progress
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.report import advice, quality
from palette4d.analysis.statistics import FrameStatistics

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.common.text import counted
from palette4d.grade import sidecar
from palette4d.media.clip_base import describe, even_step

if TYPE_CHECKING:
    from palette4d.media.clip import Clip


def analyze_clip(
    clip: Clip,
    options: AnalysisOptions,
    progress: Progress | None = None,
    *,
    allow_cuts: bool = False,
) -> tuple[dict[str, Any], Analysis]:
    """Analyse a clip and return its sidecar document (not yet written) and the analysis.

    Frames are read one after the other; what is kept of them is bounded, whatever their resolution
    and number.

    Raises
    ------
    Palette4dError
        When a frame cannot be read, the frames are not evenly spaced (a sidecar has one step), no
        frame has a pixel to go by, or the clip has sudden cuts and `allow_cuts` is not set.
    """
    step = even_step(clip.frames)
    if not step:
        raise Palette4dError(
            f"the frames {describe(clip.frames)} are not evenly spaced, and a palette is analysed "
            "from frames with one step between them; expected a range such as 1-10 or 1-10x3"
        )
    tell = progress or (lambda stage, done, total: None)
    gathered = statistics.gather_clip(
        clip, options, lambda done, total: tell("statistics", done, total)
    )
    skipped = set(clip.skipped)
    usable, remarks = _usable(clip.frames, gathered.frames)
    remarks = [*gathered.remarks, *remarks]
    if found := cuts.find_cuts(usable):
        if not allow_cuts:
            raise Palette4dError(f"{clip.source}: {cuts.refusal(clip.frames, found)}")
        remarks.append(cuts.remark(found))
    analysis = methods.analyze(usable, options, tell)
    document = sidecar.new_document(
        {
            "name": clip.name,
            "source": clip.source,
            "frames": {
                "first": clip.frames[0],
                "last": clip.frames[-1],
                "step": step,
                "skipped": sorted(skipped),
            },
            "rate": [clip.rate.numerator, clip.rate.denominator],
            "size": [clip.width, clip.height],
            "encoding": clip.encoding,
        },
        analysis.polytope.fields(),
        {
            "stages": [stage.row() for stage in analysis.stages],
            "options": options.recorded(),
            "versions": _versions(),
        },
    )
    finished = _core.parse_sidecar(sidecar.dumps(document)).polytope
    report = quality.report(finished, usable, options)
    document["quality"]["stages"][-1] |= report.figures()
    warnings = advice.warnings(
        report,
        options,
        {stage.stage: stage.losses.max_distance for stage in analysis.stages},
        brightest=float(finished.vertices[:, :3].max()),
    )
    remarks = [*remarks, *analysis.remarks, *warnings]
    return document, dataclasses.replace(analysis, remarks=tuple(remarks), report=report)


def _versions() -> dict[str, str]:
    from importlib.metadata import version

    names = ("numpy", "scipy", "nlopt", "OpenImageIO", "av")
    return {"palette4d": _core.__version__, **{name: version(name) for name in names}}


def _usable(
    frames: Iterable[int], gathered: dict[int, FrameStatistics | None]
) -> tuple[list[FrameStatistics], list[str]]:
    """Return statistics of the frames that have pixels; the clip's ends are always there.

    A first or last frame without a colour of its own stands in with its nearest neighbour's, so
    that the palette covers the whole clip.
    """
    numbers = list(frames)
    have = {n: s for n, s in gathered.items() if s is not None}
    if not have:
        raise Palette4dError(
            f"no frame of the clip has a pixel to go by: found {counted(len(numbers), 'frame')} "
            "empty or not finite; expected at least one with colours"
        )
    remarks = []
    blank = sorted(n for n, s in gathered.items() if s is None)
    if blank:
        what = counted(
            len(blank),
            "frame has no usable pixel and was",
            "frames have no usable pixel and were",
        )
        remarks.append(f"{what} passed over: {describe(blank)}")
    for end, nearest in ((numbers[0], min(have)), (numbers[-1], max(have))):
        if end not in have:
            have[end] = dataclasses.replace(have[nearest], frame=end)
            remarks.append(f"frame {end} takes the palette of frame {nearest}")
    return [have[n] for n in sorted(have)], remarks
