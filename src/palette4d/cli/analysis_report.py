"""The report of `analyze` for people: `Document.report` as lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from palette4d.common.text import counted

if TYPE_CHECKING:
    from palette4d.grade.document import Document


def lines(document: Document, seconds: Mapping[str, float]) -> list[str]:
    """Return the lines of the report; docs/palettes.md explains the figures."""
    report = document.report
    clip, frames = document.fields()["clip"], report["frames"]
    width, height = clip["size"]
    out = [f"{clip['name']}: {counted(len(frames), 'frame')}, {width}x{height}"]
    out.append(
        f"{'stage':<18} {'vertices':>8} {'blocks':>6} {'R':>8} {'C':>8} {'L':>8} {'K':>8} "
        f"{'L_prime':>8} {'farthest':>8}"
    )
    for x in report["stages"]:
        out.append(
            f"{x['stage']:<18} {x['vertices']:>8} {x['blocks']:>6} {x['R']:>8.5f} {x['C']:>8.4f} "
            f"{x['L']:>8.4f} {x['K']:>8.3f} {x['L_prime']:>8.4f} {x['max_distance']:>8.3f}"
        )
    columns = "R, farthest: distance of pixels outside; C: of handles to pixels; L: R and C; "
    columns += "K: change in time; L_prime: all. Lower is better"
    rows = {"columns": columns, "outside": _outside(report), **_palette(report["palette"])}
    rows["seconds"] = ", ".join(f"{stage} {took:.2f}" for stage, took in seconds.items())
    if report["colour_spaces"]:
        rows["colours"] = report["colour_spaces"]
    return [*out, *(f"{name:<10} {text}" for name, text in rows.items())]


def _outside(report: Mapping[str, Any]) -> str:
    """Say how many pixels are outside the palette, and how far the farthest is."""
    share = report["palette"]["outside_1_255"]
    if not share:
        return "no pixel is more than 1/255 outside"
    worst = max(report["frames"], key=lambda frame: frame["farthest"])
    return (
        f"{f'{share:.1%}' if share >= 0.001 else 'less than 0.1%'} of the pixels are more than "
        f"1/255 outside; the farthest {worst['farthest']:.3f}, in frame {worst['frame']}"
    )


def _palette(x: Mapping[str, Any]) -> dict[str, str]:
    loss, concavity = x["worst_frame_L"], x["deepest_concavity"]
    fit = f"worst frame {x['worst_frame']}: L {loss:.3f}, the median frame's "
    handles = f"{x['colours_a_frame']:.1f} colours a frame, {counted(x['splits'], 'split')}, "
    handles += counted(x["merges"], "merge")
    if "closest_handles" in x:
        first, second = x["closest_handle_ids"].split()
        handles += f"; nearest {first} and {second}, {x['closest_handles']:.2f} apart at frame "
        handles += f"{x['closest_handles_frame']}"
    concave = f"deepest concavity {concavity:.1%} of the convex hull, at frame "
    return {
        "fit": f"{fit}{x['median_frame_L']:.3f}"
        if loss >= 0.0005
        else "every frame's L is below 0.001",
        "handles": handles,
        "use": f"least used handle {x['least_used']}: by itself at most {x['least_use']:.1%} of a "
        "frame; a track adds up its handles",
        "shape": f"{concave}{x['deepest_concavity_frame']}"
        if concavity >= 0.0005
        else "convex in every frame",
    }
