"""The verb `info`: the content of a sidecar."""

import argparse
import functools
import json
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from palette4d.cli.swatches import row, swatch
from palette4d.common.text import counted, hex_of, on_lines, percent

if TYPE_CHECKING:
    from palette4d.grade.clip_colours import Share
    from palette4d.grade.document import Document
    from palette4d.grade.palette import Palette
    from palette4d.grade.tracks import Track

EPILOG = """\
example:
  palette4d info clip.p4d.json
  palette4d info clip.p4d.json --handles
  palette4d info clip.p4d.json --json | python -m json.tool
"""

#: Figures of the analysis that get a column, in the order of the file.
STAGE_FIGURES = ("vertices", "blocks", "R", "C", "L", "K", "L_prime", "outside", "max_distance")


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "info",
        help="show what a sidecar holds",
        description="Show what a sidecar holds: the clip, the edits and the palette's tracks. A "
        "track is a palette colour through time; its name is an id for `edit`.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("sidecar", metavar="SIDECAR", help="the sidecar file (*.p4d.json)")
    parser.add_argument(
        "--handles", action="store_true", help="also list the vertices, edges and stops"
    )
    parser.add_argument(
        "--quality", action="store_true", help="also show the figures of the analysis"
    )
    parser.add_argument("--json", action="store_true", help="print JSON instead of tables")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print the content of a sidecar."""
    from palette4d.grade.document import Document

    info = info_of(Document.load(args.sidecar))
    if args.json:
        print(json.dumps(info, ensure_ascii=True, allow_nan=False))
        return 0
    info = on_lines(info)
    _print_head(info)
    _print_tracks(info)
    if args.handles:
        _print_palette(info)
    if args.quality:
        _print_stages(info["stages"])
    return 0


def info_of(document: "Document") -> dict[str, Any]:
    """Return the output of ``palette4d info --json``; docs/sidecar.md explains the names."""
    from palette4d.grade.clip_colours import ClipColours, track_shares

    fields = document.fields()
    clip, polytope = fields["clip"], fields["polytope"]
    tracks = document.grade.tracks
    shares = track_shares(ClipColours(document.grade.core.polytope, fields), tracks)
    frames = clip["frames"]
    edited = {entry["vertex"]: entry["rgb"] for entry in fields["edits"]["vertices"]}
    stops = fields["edits"]["stops"]
    stages = fields["quality"]["stages"]
    vertices = polytope["vertices"]
    names = document.grade.names
    on_edge: dict[str, list[str]] = {edge["id"]: [] for edge in polytope["edges"]}
    for stop in stops:
        on_edge[stop["edge"]].append(stop["id"])

    @functools.lru_cache(64)  # tracks share their frames
    def palette_of(frame: float) -> tuple["Palette", dict[str, list[int]]]:
        """Return a palette, and where in it ids and ends of edges are."""
        palette, places = document.grade.palette(frame), dict[str, list[int]]()
        for place, (id_, ends) in enumerate(zip(palette.ids, palette.ends, strict=True)):
            for each in {id_, *ends}:
                places.setdefault(each, []).append(place)
        return palette, places

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
        "generator": fields["generator"],
        "version": fields["version"],
        "vertices": len(polytope["vertices"]),
        "edges": len(polytope["edges"]),
        "blocks": len(polytope["blocks"]),
        "stops": len(stops),
        "edited_vertices": len(edited),
        "ramp": document.grade.ramp,
        "picks": len(fields["edits"].get("picks", [])),
        "holds": sum(pick["kind"] == "hold" for pick in fields["edits"].get("picks", [])),
        "windows": sum("window" in pick for pick in fields["edits"].get("picks", [])),
        "edit": fields["extra"].get("edit"),
        "locks": fields["edits"].get("locks", []),
        "versions": list(document.grade.versions),
        "steps": len(document.history.done),
        "tracks": [
            {**_track(document, track, on_edge, palette_of), **_share(shares.get(track.name))}
            for track in tracks
        ],
        "losses": stages[-1] if stages else {},
        "stages": stages,
        "palette": [
            {
                **vertex,
                "hex": hex_of(vertex["rgb"]),
                "called": names[vertex["id"]],
                "edited": edited.get(vertex["id"]),
            }
            for vertex in vertices
        ],
        "palette_edges": [{**edge, "stops": on_edge[edge["id"]]} for edge in polytope["edges"]],
        "palette_stops": stops,
        "block_ranges": [[block["first"], block["last"]] for block in polytope["blocks"]],
    }


def _track(
    document: "Document",
    track: "Track",
    on_edge: Mapping[str, list[str]],
    palette_of: "Callable[[float], tuple[Palette, dict[str, list[int]]]]",
) -> dict[str, Any]:
    """Return a track with its edited handles, and its colours where they change most."""
    edited = [id_ for id_ in track.vertices if id_ in document.grade.settings]
    edited += [id_ for edge in track.edges for id_ in on_edge[edge]]
    inside = {*track.vertices, *track.edges}
    changes = []
    frames = [track.frame, track.first]
    for frame in [*frames, *(document.grade.frame_of(id_) for id_ in edited)]:
        palette, places = palette_of(float(frame))
        few = inside if len(inside) < len(places) else [id_ for id_ in places if id_ in inside]
        for place in sorted({place for id_ in few for place in places.get(id_, ())}):
            rgb, after = palette.rgb[place], palette.edited[place]
            change = float(abs(after - rgb).max()) + (palette.ids[place] in inside) * 1e-9
            changes.append((change, palette.frame, rgb.tolist(), after.tolist()))
    _, frame, rgb, after = max(changes, key=lambda each: each[0])
    return {
        "name": track.name,
        "called": track.called,
        "frames": [track.first, track.last],
        "frame": frame,
        "rgb": rgb,
        "edited_rgb": after,
        "vertices": list(track.vertices),
        "edges": list(track.edges),
        "edited": edited,
    }


def _share(share: "Share | None") -> dict[str, Any]:
    """Return how much of the picture a track moves; None without the clip's colours."""
    if share is None:
        return {"share": None, "largest_share": None, "largest_share_frame": None}
    most = {"largest_share": share.most, "largest_share_frame": share.frame}
    return {"share": share.mean, **most}


def _edit_line(edit: Any) -> str:
    """Return how the edit plays the shot, with the values of the node's parameters.

    Other programs may have written anything there.
    """
    try:
        speed, trimmed, reverse = float(edit["speed"]), float(edit["inPoint"]), edit["reverse"]
    except (KeyError, TypeError, ValueError):
        return ""
    if speed == 0:
        return "in edit   a freeze frame"
    backwards = ", Reverse on" if reverse is True else ""
    return f"in edit   Speed {speed:.9g}{backwards}, In-point {trimmed:g}"


def _print_tracks(info: dict[str, Any]) -> None:
    """Print a line for each palette colour through time, before and after."""
    wide = max([5, *(len(track["name"]) for track in info["tracks"])])
    long = max(len(track["called"]) for track in info["tracks"])
    patch = swatch(None)
    head = f"{'track':<{wide}}  {'colour, frames':<{long}}"
    known = any(track["share"] is not None for track in info["tracks"])
    column = f"  {'share':>6}" if known else ""
    print(f"\n{head}  {patch}{'clip':8} {patch}{'edited':8}{column}  handles")
    for track in info["tracks"]:
        before, after = track["rgb"], track["edited_rgb"]
        line = f"{track['name']:<{wide}}  {track['called']:<{long}}  "
        line += f"{swatch(before)}{hex_of(before):8} "
        changed = before != after
        line += f"{swatch(after)}{hex_of(after):8}" if changed else patch + " " * 8
        line += f"  {percent(track['share']):>6}" if known else ""
        edited = f"; edited {_some(track['edited'])}" if track["edited"] else ""
        print(f"{line}  {_some(track['vertices'])}{edited}".rstrip())
    first = info["tracks"][0]["name"]
    print(
        "\nColours: of the largest edit, else the most colourful one. More: `info SIDECAR "
        "--handles`.\n"
        f"`edit SIDECAR track {first} …` changes a track.\n"
        f"`render SIDECAR CLIP -o key/#.png --output weight:{first}` shows what a track is for"
        + ("; its share is the mean of its frames." if known else ".")
    )


def _some(names: list[str], most: int = 6) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return " ".join(names[:most]) + more


def _print_head(info: dict[str, Any]) -> None:
    from palette4d.grade.edits import RAMP_WORDS

    first, last = info["frame_range"]
    numerator, denominator = info["rate"]
    step = f", every {info['frame_step']}" if info["frame_step"] != 1 else ""
    skipped = f", {len(info['skipped'])} skipped" if info["skipped"] else ""
    print(f"clip      {info['name']}  ({info['source']})")
    print(f"frames    {first} to {last}{step}{skipped}, {numerator / denominator:g} per second")
    if line := _edit_line(info["edit"]):
        print(line)
    found_in = f", palette in {info['encoding']}" if info["input_space"] else ""
    colours = info["input_space"] or info["encoding"]
    if colours == "unknown":
        colours = "encoding unknown, shown as sRGB"
    print(f"picture   {info['size'][0]} x {info['size'][1]}, {colours}{found_in}")
    print(
        f"palette   {counted(len(info['tracks']), 'colour')} through time, "
        f"{counted(info['vertices'], 'handle')}"
    )
    if info["blocks"] > 1:
        ranges = ", ".join(f"{a:g}-{b:g}" for a, b in info["block_ranges"])
        print(f"blocks    {ranges}; colours split or merge between them")
    print(
        f"edits     {counted(info['edited_vertices'], 'vertex', 'vertices')}, "
        f"{counted(info['stops'], 'stop')}"
        + (f", {counted(info['picks'] - info['holds'], 'pick')}" if info["picks"] else "")
        + (f", {counted(info['holds'], 'hold')}" if info["holds"] else "")
        + (f" ({counted(info['windows'], 'window')})" if info["windows"] else "")
        + (f", {counted(len(info['locks']), 'lock')}" if info["locks"] else "")
        + (f", {RAMP_WORDS[info['ramp']]} ramps" if info["ramp"] != "linear" else "")
        + (f"; {counted(info['steps'], 'step')} to undo" if info["steps"] else "")
    )
    if info["versions"]:
        print(f"versions  {', '.join(info['versions'])}")
    print(f"by        {info['generator']}")


def _print_stages(stages: list[dict[str, Any]]) -> None:
    """Print a table of the figures that stages share; below it, figures of single stages."""

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
    for line in rows:
        cells = [line[0].ljust(widths[0])]
        cells += [cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True)]
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
    wide = max([6, *(len(entry["id"]) for entry in info["palette"] + info["palette_edges"])])
    long = max(len(entry["called"]) for entry in info["palette"])
    patch = swatch(None)
    print(
        f"\n{'vertex':<{wide}} {'frame':>9}  {patch}{'colour':8} {'r':>8} {'g':>8} {'b':>8}  "
        f"{'name':<{long}}  edited".rstrip()
    )
    for vertex in sorted(info["palette"], key=lambda vertex: vertex["frame"]):
        edited = "" if vertex["edited"] is None else f"  {row(vertex['edited'])}"
        line = f"{vertex['id']:<{wide}} {vertex['frame']:>9.6g}  {row(vertex['rgb'])}  "
        print(f"{line}{vertex['called']:<{long}}{edited}".rstrip())
    frames = {vertex["id"]: vertex["frame"] for vertex in info["palette"]}
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
        print(f"{line}{row(stop['rgb'])}")
