"""The report of `analyze`: as lines for people, and as figures for machines (`--json`)."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palette4d.common.text import counted

if TYPE_CHECKING:
    from palette4d.analysis.pipeline import Analysis
    from palette4d.analysis.report.quality import Report


def figures(output: Path, analysis: Analysis, seconds: Mapping[str, float]) -> dict[str, Any]:
    """Return what `--json` prints; docs/palettes.md explains the names."""
    return {
        "sidecar": str(output),
        "stages": [stage.row() for stage in analysis.stages],
        "held_to_L_prime": analysis.bound,
        "palette": analysis.report.figures(),
        "frames": [dataclasses.asdict(fit) for fit in analysis.report.fits],
        "notes": list(analysis.notes),
        "seconds": dict(seconds),
        "cpu_seconds": round(time.process_time(), 3),
    }


def lines(analysis: Analysis, seconds: Mapping[str, float]) -> list[str]:
    """Return the lines of the report."""
    clip = analysis.document["clip"]
    width, height = clip["size"]
    out = [f"{clip['name']}: {counted(len(analysis.report.fits), 'frame')}, {width}x{height}"]
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
    if analysis.colours:
        rows["colours"] = analysis.colours
    return [*out, *(f"{name:<10} {text}" for name, text in rows.items())]


def outside(report: Report) -> str:
    """Say how many pixels are outside the palette, and how far the farthest is."""
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
    concavity, frame = x.concavity
    concave = f"deepest concavity {concavity:.1%} of the convex hull, at frame {frame}"
    return {
        "fit": fit if x.worst.L >= 0.0005 else "every frame's L is below 0.001",
        "handles": handles,
        "use": f"least used {x.least_used[0]}, up to {x.least_used[1]:.1%} of the picture",
        "shape": concave if concavity >= 0.0005 else "convex in every frame",
    }
