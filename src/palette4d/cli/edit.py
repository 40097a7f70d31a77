"""The verbs that look at a sidecar and edit it: ``info``, ``slice`` and ``edit``."""

import argparse
import json
import os
import re
import shlex
import sys
import textwrap
from collections.abc import Sequence
from typing import Any

from palette4d import _core
from palette4d.common.arguments import (
    accept_negative_values,
    frame_range_or_all,
    number,
    parse_frames,
)
from palette4d.common.errors import Palette4dError
from palette4d.common.text import counted
from palette4d.grade import edits, sidecar
from palette4d.grade.edits import Colour
from palette4d.grade.sidecar import Document

_HEX = re.compile(r"#([0-9a-fA-F]{2})([0-9a-fA-F]{2})([0-9a-fA-F]{2})")
_number = number()

INFO_EPILOG = """\
example:
  palette4d info clip.p4d.json
  palette4d info clip.p4d.json --json | python -m json.tool
"""

SLICE_EPILOG = """\
example:
  palette4d slice clip.p4d.json --frame 23
  palette4d slice clip.p4d.json --frame 23.5 --json
  palette4d slice clip.p4d.json --frames all --json
"""

EDIT_EPILOG = """\
example:
  palette4d edit clip.p4d.json set v12 --rgb 0.8 0.1 0.1
  palette4d edit clip.p4d.json set --near 0.9,0.5,0.2 --frame 40 --rgb '#b23aee'
  palette4d edit clip.p4d.json stop e4 --frame 23 --rgb 0.2 0.4 0.9
  palette4d edit clip.p4d.json stop --near 0.9,0.5,0.2 --frame 23.5 --rgb 0.2 0.4 0.9
  palette4d edit clip.p4d.json move s1 --frame 30
  palette4d edit clip.p4d.json move v12 --by -0.1 0 0.05
  palette4d edit clip.p4d.json reset v12
  palette4d edit clip.p4d.json reset

Colours are R G B, R,G,B or #rrggbb, in the palette's own numbers; R G B may lie outside 0..1.
`palette4d info` lists the ids.
"""


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the verbs ``info``, ``slice`` and ``edit``."""
    info = _verb(
        subparsers,
        "info",
        "Show what a sidecar holds: the clip, the palette with its ids and colours, the edits and "
        "the losses of the analysis.",
        INFO_EPILOG,
    )
    info.add_argument("sidecar", metavar="SIDECAR", help="the sidecar file (*.p4d.json)")
    info.add_argument("--json", action="store_true", help="print JSON instead of a table")
    info.set_defaults(run=run_info)

    cut = _verb(
        subparsers,
        "slice",
        "Print the palette of one moment (or of many frames): original and edited colours, where "
        "each lies on the polytope, and the faces of the polyhedron. A frame outside of the clip "
        "gives its first or last.",
        SLICE_EPILOG,
    )
    cut.add_argument("sidecar", metavar="SIDECAR", help="the sidecar file (*.p4d.json)")
    when = cut.add_mutually_exclusive_group(required=True)
    when.add_argument(
        "--frame", type=_number, metavar="T", help="the frame number; may lie between two frames"
    )
    when.add_argument(
        "--frames",
        metavar="RANGE",
        type=frame_range_or_all,
        help="many frames: all, 10, 1-20, 1001-1100x2, 1-9,15",
    )
    cut.add_argument("--json", action="store_true", help="print JSON (a list with --frames)")
    cut.set_defaults(run=run_slice)

    edit = _verb(
        subparsers,
        "edit",
        "Change the colours of a palette: of its vertices, and of colour stops added on its edges. "
        "The sidecar is replaced as a whole or not at all.",
        EDIT_EPILOG,
    )
    edit.add_argument("sidecar", metavar="SIDECAR", help="the sidecar file to edit (*.p4d.json)")
    _add_actions(edit)


def _verb(
    subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]",
    name: str,
    description: str,
    epilog: str,
    usage: str | None = None,
) -> argparse.ArgumentParser:
    return subparsers.add_parser(
        name,
        help=re.split(r"[:.(]", description[0].lower() + description[1:])[0].strip(),
        description=textwrap.fill(description, 79),
        usage=usage and f"palette4d edit [-h] SIDECAR {name} {usage}",
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def _add_actions(edit: argparse.ArgumentParser) -> None:
    actions = edit.add_subparsers(title="actions", metavar="ACTION", dest="action", required=True)

    change = _verb(
        actions,
        "set",
        "Give a vertex or a stop a colour, by id or by nearness.",
        EDIT_EPILOG,
        "(ID | --near R,G,B --frame T) --rgb R G B",
    )
    change.add_argument("id", nargs="?", metavar="ID", help="a vertex or a stop")
    _add_near(change, "choose the handle nearest to this colour at --frame instead of by ID")
    change.add_argument("--frame", type=_number, metavar="T", help="the time of --near")
    _add_rgb(change)
    change.set_defaults(run=run_set)

    stop = _verb(
        actions,
        "stop",
        "Add a colour stop on an edge, or recolour it.",
        EDIT_EPILOG,
        "(EDGE | --near R,G,B) --frame T --rgb R G B",
    )
    stop.add_argument("id", nargs="?", metavar="EDGE", help="an edge")
    _add_near(stop, "choose the edge whose colour at --frame is nearest to this one")
    stop.add_argument(
        "--frame", type=_number, metavar="T", required=True, help="where in time the stop goes"
    )
    _add_rgb(stop)
    stop.set_defaults(run=run_stop)

    move = _verb(
        actions,
        "move",
        "Move a stop in time, or shift a handle's colour.",
        EDIT_EPILOG,
        "(STOP --frame T | ID --by DR DG DB)",
    )
    move.add_argument("id", metavar="ID", help="a stop, or with --by also a vertex")
    move.add_argument("--frame", type=_number, metavar="T", help="the stop's new time")
    move.add_argument(
        "--by", type=_number, nargs=3, metavar=("DR", "DG", "DB"), help="added to the colour"
    )
    move.set_defaults(run=run_move)

    undo = _verb(
        actions,
        "reset",
        "Give a vertex its own colour back, or remove a stop; without ID, undo every edit.",
        EDIT_EPILOG,
        "[ID]",
    )
    undo.add_argument("id", nargs="?", metavar="ID", help="a vertex or a stop")
    undo.set_defaults(run=run_reset)
    accept_negative_values(actions)


def _add_rgb(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--rgb", nargs="+", required=True, metavar="C", help="the new colour: R G B or #rrggbb"
    )


def _add_near(parser: argparse.ArgumentParser, text: str) -> None:
    parser.add_argument("--near", metavar="R,G,B", help=f"{text} (R,G,B or #rrggbb)")


# ------------------------------------------------------------------------------------- arguments


def parse_colour(words: Sequence[str]) -> Colour:
    """Return the colour written as R G B, R,G,B or #rrggbb.

    >>> parse_colour(["0.5", "-0.1", "1e0"])
    (0.5, -0.1, 1.0)
    >>> parse_colour(["#ff0033"])
    (1.0, 0.0, 0.2)
    """
    if len(words) == 1 and (match := _HEX.fullmatch(words[0])):
        r, g, b = (int(digits, 16) / 255 for digits in match.groups())
        return (r, g, b)
    parts = words[0].split(",") if len(words) == 1 else list(words)
    try:
        values = [_number(part) for part in parts]
    except argparse.ArgumentTypeError:
        values = []
    if len(values) != 3:
        raise Palette4dError(
            f"found the colour {' '.join(words)!r}, expected three finite numbers (R G B or R,G,B) "
            "or #rrggbb; put it last, or quote it"
        )
    return (values[0], values[1], values[2])


def chosen_frames(text: str, document: Document) -> list[int]:
    """Return the clip's frames for "all", else those of a frame range within the clip."""
    clip = document["clip"]["frames"]
    if text == "all":
        return list(range(clip["first"], clip["last"] + 1, clip["step"]))
    frames = parse_frames(text)
    for end in (frames[0], frames[-1]):
        edits.check_frame(document, end)
    return frames


# ----------------------------------------------------------------------------------------- output


def _hex(rgb: Sequence[float]) -> str:
    """Return #rrggbb of a colour; "*" marks a colour outside 0..1, which #rrggbb cannot hold."""
    outside = any(not 0 <= value <= 1 for value in rgb)
    digits = "".join(f"{round(min(max(value, 0.0), 1.0) * 255):02x}" for value in rgb)
    return f"#{digits}{'*' if outside else ''}"


def _swatch(rgb: Sequence[float] | None) -> str:
    """Return a patch of the colour for terminals, nothing for files and pipes."""
    if not sys.stdout.isatty() or os.environ.get("NO_COLOR"):
        return ""
    if rgb is None:
        return "   "
    r, g, b = (round(min(max(value, 0.0), 1.0) * 255) for value in rgb)
    return f"\x1b[48;2;{r};{g};{b}m  \x1b[0m "


def _triple(rgb: Sequence[float]) -> str:
    return " ".join(f"{value:8.5g}" for value in rgb)


def _print_json(value: Any) -> None:
    print(json.dumps(value, ensure_ascii=True, allow_nan=False))


# ------------------------------------------------------------------------------------------- info


def info_of(document: Document) -> dict[str, Any]:
    """Return what ``palette4d info --json`` prints; docs/sidecar.md explains the words."""
    clip, polytope = document["clip"], document["polytope"]
    frames = clip["frames"]
    edited = {entry["vertex"]: entry["rgb"] for entry in document["edits"]["vertices"]}
    stops = document["edits"]["stops"]
    stages = document["quality"]["stages"]
    return {
        "name": clip["name"],
        "source": clip["source"],
        "frame_range": [frames["first"], frames["last"]],
        "frame_step": frames["step"],
        "skipped": frames["skipped"],
        "rate": clip["rate"],
        "size": clip["size"],
        "encoding": clip["encoding"],
        "input_space": clip.get("conversion", {}).get("input_space"),
        "generator": document["generator"],
        "version": document["version"],
        "vertices": len(polytope["vertices"]),
        "edges": len(polytope["edges"]),
        "blocks": len(polytope["blocks"]),
        "stops": len(stops),
        "edited_vertices": len(edited),
        "losses": stages[-1] if stages else {},
        "stages": stages,
        "palette": [
            {**vertex, "hex": _hex(vertex["rgb"]), "edited": edited.get(vertex["id"])}
            for vertex in polytope["vertices"]
        ],
        "palette_edges": [
            {**edge, "stops": [stop["id"] for stop in stops if stop["edge"] == edge["id"]]}
            for edge in polytope["edges"]
        ],
        "palette_stops": stops,
        "block_ranges": [[block["first"], block["last"]] for block in polytope["blocks"]],
    }


def run_info(args: argparse.Namespace) -> int:
    """Print what a sidecar holds."""
    info = info_of(sidecar.load(args.sidecar))
    if args.json:
        _print_json(info)
        return 0
    first, last = info["frame_range"]
    numerator, denominator = info["rate"]
    step = f", every {info['frame_step']}" if info["frame_step"] != 1 else ""
    skipped = f", {len(info['skipped'])} skipped" if info["skipped"] else ""
    print(f"clip      {info['name']}  ({info['source']})")
    print(f"frames    {first} to {last}{step}{skipped}, {numerator / denominator:g} per second")
    found_in = f", palette in {info['encoding']}" if info["input_space"] else ""
    colours = info["input_space"] or info["encoding"]
    print(f"picture   {info['size'][0]} x {info['size'][1]}, {colours}{found_in}")
    print(
        f"palette   {counted(info['vertices'], 'vertex', 'vertices')}, "
        f"{counted(info['edges'], 'edge')}, {counted(info['blocks'], 'block')}: "
        + ", ".join(f"{a:g}-{b:g}" for a, b in info["block_ranges"])
    )
    print(
        f"edits     {counted(info['edited_vertices'], 'vertex', 'vertices')}, "
        f"{counted(info['stops'], 'stop')}"
    )
    print(f"by        {info['generator']}")
    _print_stages(info["stages"])
    _print_palette(info)
    return 0


STAGE_FIGURES = ("vertices", "blocks", "R", "C", "L", "K", "L_prime", "outside", "max_distance")


def _print_stages(stages: list[dict[str, Any]]) -> None:
    """Print what the stages have in common as a table, and what one of them says alone below."""
    if not stages:
        return
    every = dict.fromkeys(name for stage in stages for name in stage if name != "stage")
    names = [n for n in every if n in STAGE_FIGURES or sum(n in stage for stage in stages) > 1]
    rows = [["stage", *names]]
    for stage in stages:
        cells = [stage.get(name, "") for name in names]
        rows.append([str(stage["stage"]), *(_cell(cell) for cell in cells)])
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    print()
    for row in rows:
        cells = [row[0].ljust(widths[0])]
        cells += [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        print("  ".join(cells).rstrip())
    alone = {n: v for stage in stages for n, v in stage.items() if n not in (*names, "stage")}
    if alone:
        wide = max(map(len, alone))
        print()
        for name, value in alone.items():
            print(f"{name.ljust(wide)}  {_cell(value)}")


def _cell(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else "" if value is None else str(value)


def _print_palette(info: dict[str, Any]) -> None:
    wide = max([6, *(len(row["id"]) for row in info["palette"] + info["palette_edges"])])
    patch = " " * len("  " + " ") if _swatch(None) else ""
    print(
        f"\n{'vertex':<{wide}} {'frame':>9}  {patch}{'colour':8} {'r':>8} {'g':>8} {'b':>8}  edited"
    )
    for row in sorted(info["palette"], key=lambda row: row["frame"]):
        line = f"{row['id']:<{wide}} {row['frame']:>9.6g}  {_swatch(row['rgb'])}{row['hex']:8} "
        line += _triple(row["rgb"])
        if row["edited"] is not None:
            line += f"  {_swatch(row['edited'])}{_hex(row['edited']):8} {_triple(row['edited'])}"
        print(line)
    frames = {row["id"]: row["frame"] for row in info["palette"]}
    if info["palette_edges"]:
        print(f"\n{'edge':<{wide}} {'from':<{wide}} {'to':<{wide}} {'frames':>17}  stops")
    for edge in info["palette_edges"]:
        span = f"{frames[edge['from']]:.6g}-{frames[edge['to']]:.6g}"
        line = f"{edge['id']:<{wide}} {edge['from']:<{wide}} {edge['to']:<{wide}} {span:>17}"
        print(f"{line}  {' '.join(edge['stops'])}".rstrip())
    if info["palette_stops"]:
        print(f"\n{'stop':<{wide}} {'edge':<{wide}} {'frame':>9}  {patch}colour")
    for stop in info["palette_stops"]:
        line = f"{stop['id']:<{wide}} {stop['edge']:<{wide}} {stop['frame']:>9.6g}  "
        print(f"{line}{_swatch(stop['rgb'])}{_hex(stop['rgb']):8} {_triple(stop['rgb'])}")


# ------------------------------------------------------------------------------------------ slice


def slice_of(read: _core.Sidecar, frame: float) -> dict[str, Any]:
    """Return what ``palette4d slice --json`` prints for one frame.

    ``frame`` (clamped to the clip), ``vertices`` and ``edited`` (n colours each), ``faces`` (vertex
    triples, anticlockwise from outside) and ``tracks``: where each of the n colours lies on the
    polytope (``edge`` is None on a vertex; ``weight`` is that of ``to``, eq. 6).
    """
    cut = _core.slice_at(read.polytope, frame)
    vertices, edges = read.polytope.vertex_ids, read.polytope.edge_ids
    return {
        "frame": cut.frame,
        "vertices": cut.rgb.tolist(),
        "edited": _core.edited_colours(read.polytope, read.edits, cut).tolist(),
        "faces": cut.faces.tolist(),
        "tracks": [
            {
                "edge": None if edge < 0 else edges[edge],
                "from": vertices[ends[0]],
                "to": vertices[ends[1]],
                "weight": weight,
            }
            for edge, ends, weight in zip(
                cut.edges.tolist(), cut.ends.tolist(), cut.weights.tolist(), strict=True
            )
        ],
    }


def run_slice(args: argparse.Namespace) -> int:
    """Print the palette of one or more frames."""
    read = _core.read_sidecar(args.sidecar)
    if args.frames is None:
        slices = [slice_of(read, args.frame)]
        if slices[0]["frame"] != args.frame:
            print(
                f"palette4d: frame {args.frame:g} is outside of the clip; this is frame "
                f"{slices[0]['frame']:g}",
                file=sys.stderr,
            )
    else:
        wanted = chosen_frames(args.frames, sidecar.load(args.sidecar))
        slices = [slice_of(read, frame) for frame in wanted]
    if args.json:
        _print_json(slices[0] if args.frames is None else slices)
        return 0
    for cut in slices:
        _print_slice(cut)
    return 0


def _print_slice(cut: dict[str, Any]) -> None:
    print(
        f"frame {cut['frame']:g}: {counted(len(cut['vertices']), 'colour')}, "
        f"{counted(len(cut['faces']), 'face')}"
    )
    for i, (rgb, new, track) in enumerate(
        zip(cut["vertices"], cut["edited"], cut["tracks"], strict=True)
    ):
        where = track["from"]
        if track["edge"] is not None:
            where = f"{track['edge']} ({track['from']} to {track['to']} at {track['weight']:.4g})"
        line = f"{i:4}  {_swatch(rgb)}{_hex(rgb):8} {_triple(rgb)}  {where:32}"
        if new != rgb:
            line += f" now {_swatch(new)}{_hex(new):8} {_triple(new)}"
        print(line.rstrip())
    if cut["faces"]:
        print("      faces " + " ".join("-".join(map(str, face)) for face in cut["faces"]))


# ------------------------------------------------------------------------------------------- edit


def _shown(rgb: Sequence[float]) -> str:
    numbers = " ".join(f"{value:.6g}" for value in rgb)
    return f"{_swatch(rgb)}{_hex(rgb)} ({numbers})"


def _named(document: Document, handle: str) -> str:
    for stop in document["edits"]["stops"]:
        if stop["id"] == handle:
            return f"stop {handle} (edge {stop['edge']}, frame {stop['frame']:g})"
    for vertex in document["polytope"]["vertices"]:
        if vertex["id"] == handle:
            return f"vertex {handle} (frame {vertex['frame']:g})"
    return handle


def _near(args: argparse.Namespace, kind: str) -> Colour | None:
    """Return the colour of --near; check that it is given exactly when the id is not."""
    if args.near is not None and args.id is not None:
        raise Palette4dError(f"found both {kind} {args.id!r} and --near, expected one of them")
    if args.near is None:
        if args.id is None:
            _refuse_swallowed(args.rgb, kind)
            raise Palette4dError(
                f"found neither {kind} nor --near, expected one of them; `palette4d info "
                f"{args.sidecar}` lists the ids"
            )
        return None
    return parse_colour([args.near])


def _refuse_swallowed(words: Sequence[str], kind: str) -> None:
    """Say so when --rgb, which takes every word up to the next option, has taken the id too."""
    for id_, colour in ((words[-1], words[:-1]), (words[0], words[1:])):
        try:
            parse_colour(colour or [""])
        except Palette4dError:
            continue
        raise Palette4dError(
            f"--rgb found the {len(words)} words {shlex.join(words)!r} and has taken {id_!r} as a "
            f"part of the colour; expected the {kind} before --rgb: `{id_} --rgb "
            f"{shlex.join(colour)}`"
        )


def run_set(args: argparse.Namespace) -> int:
    """Give a vertex or stop a colour."""
    near, rgb = _near(args, "ID"), parse_colour(args.rgb)
    if (near is None) != (args.frame is None):
        raise Palette4dError(
            "--near and --frame go together: the handle nearest to a colour at a time. To colour "
            "one moment of an edge use `stop EDGE --frame T`"
        )
    lines: list[str] = []

    def apply(document: Document) -> Document:
        handle = args.id
        if near is not None:
            found = edits.nearest_handle(document, near, args.frame)
            handle = found.id
            lines.append(
                f"the palette colour nearest to {_shown(near)} at frame {args.frame:g} is "
                f"{_shown(found.rgb)}, {found.distance:.4g} away"
            )
            if not found.exact:
                lines.append(
                    f"it lies on edge {found.edge}; chose its nearest handle in time, "
                    f"{_named(document, handle)}"
                )
        before = edits.colour_of(document, handle)
        changed = edits.set_colour(document, handle, rgb)
        lines.append(f"{_named(document, handle)}: {_shown(before)} -> {_shown(rgb)}")
        if near is not None and not found.exact and found.edge is not None:
            now = edits.edited_at(changed, found.edge, args.frame)
            lines.append(f"edge {found.edge} is now {_shown(now)} at frame {args.frame:g}")
            exact = ["palette4d", "edit", args.sidecar, "stop", found.edge]
            exact += ["--frame", f"{args.frame:.17g}", "--rgb", *args.rgb]
            lines.append(f"for an exact hit: {shlex.join(exact)}")
        return changed

    sidecar.update_edits(args.sidecar, apply)
    print("\n".join(lines))
    return 0


def run_stop(args: argparse.Namespace) -> int:
    """Add a stop on an edge."""
    near, rgb = _near(args, "EDGE"), parse_colour(args.rgb)
    lines: list[str] = []

    def apply(document: Document) -> Document:
        edge = args.id
        edits.check_frame(document, args.frame)
        if near is not None:
            edge, there = edits.nearest_edge(document, near, args.frame)
            lines.append(
                f"the palette colour nearest to {_shown(near)} at frame {args.frame:g} is "
                f"{_shown(there)} on edge {edge}"
            )
        changed, stop = edits.set_stop(document, edge, args.frame, rgb)
        before = edits.edited_at(document, edge, args.frame)
        lines.append(f"{_named(changed, stop)}: {_shown(before)} -> {_shown(rgb)}")
        return changed

    sidecar.update_edits(args.sidecar, apply)
    print("\n".join(lines))
    return 0


def run_move(args: argparse.Namespace) -> int:
    """Move a stop in time, or shift a handle's colour."""
    if args.frame is None and args.by is None:
        raise Palette4dError("move: found neither --frame nor --by, expected at least one of them")
    lines: list[str] = []

    def apply(document: Document) -> Document:
        changed = document
        if args.frame is not None:
            edits.check_frame(document, args.frame)
            changed = edits.move_stop(changed, args.id, args.frame)
            lines.append(f"{_named(document, args.id)} -> frame {args.frame:g}")
        if args.by is not None:
            before = edits.colour_of(changed, args.id)
            changed = edits.shift_colour(changed, args.id, args.by)
            after = edits.colour_of(changed, args.id)
            lines.append(f"{_named(changed, args.id)}: {_shown(before)} -> {_shown(after)}")
        return changed

    sidecar.update_edits(args.sidecar, apply)
    print("\n".join(lines))
    return 0


def run_reset(args: argparse.Namespace) -> int:
    """Undo the edit of a vertex, remove a stop, or undo everything."""
    lines: list[str] = []

    def apply(document: Document) -> Document:
        changed = edits.reset(document, args.id)
        kept = {stop["id"] for stop in changed["edits"]["stops"]}
        edited = {entry["vertex"] for entry in changed["edits"]["vertices"]}
        for entry in document["edits"]["vertices"]:
            vertex = entry["vertex"]
            if vertex not in edited:
                before, after = entry["rgb"], edits.colour_of(changed, vertex)
                lines.append(f"{_named(document, vertex)}: {_shown(before)} -> {_shown(after)}")
        for stop in document["edits"]["stops"]:
            if stop["id"] not in kept:
                lines.append(f"{_named(document, stop['id'])}: removed")
        return changed

    sidecar.update_edits(args.sidecar, apply)
    print("\n".join(lines) if lines else "nothing to reset")
    return 0
