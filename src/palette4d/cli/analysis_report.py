"""The report of `analyze`: as lines for people, and as figures for machines (`--json`)."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palette4d.common.text import counted

if TYPE_CHECKING:
    from palette4d.analysis.methods import Analysis
    from palette4d.analysis.report.quality import Report
    from palette4d.media.clip import Clip


def figures(output: Path, analysis: Analysis, seconds: Mapping[str, float]) -> dict[str, Any]:
    """Return what `--json` prints; docs/palettes.md explains the names."""
    assert analysis.report is not None  # analyze_clip always measures
    return {
        "sidecar": str(output),
        "stages": [stage.row() for stage in analysis.stages],
        "held_to_L_prime": analysis.bound,
        "palette": analysis.report.figures(),
        "frames": [dataclasses.asdict(fit) for fit in analysis.report.fits],
        "notes": list(analysis.remarks),
        "seconds": dict(seconds),
        "cpu_seconds": round(time.process_time(), 3),
    }


def lines(
    clip: Clip, analysis: Analysis, seconds: Mapping[str, float], colours: str | None
) -> list[str]:
    """Return the report's lines; `colours` says which colour spaces were used, if any."""
    assert analysis.report is not None  # analyze_clip always measures
    out = [f"{clip.name}: {counted(len(clip.frames), 'frame')}, {clip.width}x{clip.height}"]
    out.append(
        f"{'stage':<18} {'vertices':>8} {'blocks':>6} {'R':>8} {'C':>8} {'L':>8} {'K':>8} "
        f"{'L_prime':>8} {'farthest':>8} {'seconds':>8}"
    )
    for stage in analysis.stages:
        x = stage.losses
        out.append(
            f"{stage.stage:<18} {stage.vertices:>8} {stage.blocks:>6} {x.R:>8.5f} {x.C:>8.4f} "
            f"{x.L:>8.4f} {x.K:>8.3f} {x.L_prime:>8.4f} {x.max_distance:>8.3f} "
            f"{seconds.get(stage.stage, 0):>8.2f}"
        )
    rows = {"outside": outside(analysis.report), **_palette(analysis.report)}
    rows["seconds"] = ", ".join(f"{stage} {took:.2f}" for stage, took in seconds.items())
    if colours:
        rows["colours"] = colours
    return [*out, *(f"{name:<10} {text}" for name, text in rows.items())]


def outside(report: Report) -> str:
    """Say how many pixels the palette does not hold, and how far the farthest lies outside."""
    if not report.outside:
        return "no pixel is more than 1/255 outside"
    share = f"{report.outside:.1%}" if report.outside >= 0.001 else "less than 0.1%"
    return (
        f"{share} of the pixels are more than 1/255 outside; the farthest "
        f"{report.farthest.farthest:.3f}, in frame {report.farthest.frame}"
    )


def _palette(x: Report) -> dict[str, str]:
    fit = f"worst frame {x.worst.frame}: L {x.worst.L:.3f}, the median frame's {x.median_loss:.3f}"
    handles = f"{x.colours:.1f} colours a frame, {counted(x.splits, 'split')}, "
    handles += counted(x.merges, "merge")
    if x.closest:
        distance, frame, one, other = x.closest
        handles += f"; nearest {one} and {other}, {distance:.2f} apart at frame {frame}"
    dented = f"deepest dent {x.dent[0]:.1%} of the convex hull, at frame {x.dent[1]}"
    return {
        "fit": fit if x.worst.L >= 0.0005 else "every frame's L is below 0.001",
        "handles": handles,
        "use": f"least used {x.least_used[0]}, up to {x.least_used[1]:.1%} of the picture",
        "shape": dented if x.dent[0] >= 0.0005 else "convex in every frame",
    }
