"""The verb `edit`: colours of vertices and stops."""

from __future__ import annotations

import argparse
import functools
import textwrap
from typing import TYPE_CHECKING, Any

from palette4d import load
from palette4d.cli import edit_copy, edit_history, picks
from palette4d.cli.swatches import shown
from palette4d.common.arguments import ColourAction, accept_negative_values, number
from palette4d.common.errors import Palette4dError
from palette4d.common.text import quoted

if TYPE_CHECKING:
    from collections.abc import Mapping

    from palette4d.grade.document import Document
    from palette4d.grade.grade import Grade
    from palette4d.grade.handle_edits import How

#: Those of `palette4d.grade.edits.RAMP_WORDS`, which would be slow to import for the help.
RAMPS = ("linear", "smooth", "step")

#: The most handles that an action reports one by one.
MOST_LINES = 12

EXAMPLES = """\
  palette4d edit clip.p4d.json set --near 0.9,0.5,0.2 --frame 40 --rgb "#b23aee"
  palette4d edit clip.p4d.json set v12 --rgb 0.8 0.1 0.1
  palette4d edit clip.p4d.json set e4 --frame 23.5 --rgb 0.2 0.4 0.9
  palette4d edit clip.p4d.json set v12 --rgb "#5ca832" --from 20 --until 40 --fade 5
  palette4d edit clip.p4d.json track v12 --chroma 0.8
  palette4d edit clip.p4d.json palette --lightness 1.05
  palette4d edit clip.p4d.json move s1 --frame 30
  palette4d edit clip.p4d.json ramp smooth
  palette4d edit clip.p4d.json reset v12
  palette4d edit clip.p4d.json pick --frame 40 --pixel 320,180 --box 5 --to "#3359b3"
  palette4d edit clip.p4d.json hold --frame 40 --colour "#7a6b5c"
  palette4d edit clip.p4d.json window p1 --frame 40 --box 240,120,400,260
  palette4d edit clip.p4d.json undo
  palette4d edit clip.p4d.json version save warm
  palette4d edit other.p4d.json copy clip.p4d.json
"""

COLOURS = """\
Colours are R G B, R,G,B or #rrggbb, in the palette's own code values; they may
lie outside 0..1. `palette4d info` lists the ids.
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb to the command line."""
    edit = subparsers.add_parser(
        "edit",
        help="change the colours of a palette",
        description="Change the colours of a palette: of its vertices, and of colour stops on its\n"
        "edges. The sidecar is replaced as a whole or not at all.",
        epilog=_epilog("") + "\n`palette4d edit SIDECAR ACTION --help` explains an action.\n",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        add_help=False,
    )
    edit.add_argument("sidecar", metavar="SIDECAR", help="the sidecar file to edit (*.p4d.json)")
    actions = edit.add_subparsers(title="actions", metavar="ACTION", dest="action", required=True)
    edit.add_argument(
        "-h",
        "--help",
        action=_Help,
        actions=actions.choices,
        help="show this help message and exit",
    )
    _add_set(actions)
    _add_move(actions)
    _add_track(actions)
    _add_ramp(actions)
    _add_reset(actions)
    for module in (picks, edit_history, edit_copy):
        module.add_actions(functools.partial(_action, actions))
    accept_negative_values(actions)


class _Help(argparse.Action):
    """Print the help; of an action where its name stands in the sidecar's place."""

    def __init__(self, *, actions: Mapping[str, argparse.ArgumentParser], **given: Any) -> None:
        super().__init__(nargs=0, **given)
        self._actions = actions

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option_string: str | None = None,
    ) -> None:
        self._actions.get(namespace.sidecar, parser).print_help()
        parser.exit()


def _epilog(action: str) -> str:
    """Return the examples of an action, and how colours are written."""
    shown = [line for line in EXAMPLES.splitlines() if f"json {action}" in line]
    colours = any("#" in line for line in shown)
    return "\n".join(["example:", *shown, ""]) + ("\n" + COLOURS if colours else "")


def _action(
    actions: argparse._SubParsersAction[argparse.ArgumentParser],
    name: str,
    usage: str,
    description: str,
) -> argparse.ArgumentParser:
    return actions.add_parser(
        name,
        help=description.split(".")[0],
        description=textwrap.fill(description, 79),
        usage=f"palette4d edit [-h] SIDECAR {name} {usage}",
        epilog=_epilog(name) if f"json {name}" in EXAMPLES else COLOURS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def _add_set(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = _action(
        actions,
        "set",
        "(ID | EDGE --frame T | --near C --frame T) CHANGE [RANGE]",
        "change the colour of a vertex, of a stop, or of an edge at a frame. With --near, the "
        "palette colour nearest to the one that you see at a frame changes there: its stop, or its "
        "vertex less than a frame away, or else a new stop.",
    )
    parser.add_argument("id", nargs="?", metavar="ID", help="a vertex, a stop, or an edge")
    parser.add_argument(
        "--near",
        nargs="+",
        metavar="C",
        action=ColourAction,
        help="choose the palette colour nearest to this one at --frame, as it is edited now",
    )
    parser.add_argument(
        "--frame", type=number(), metavar="T", help="when, with --near or an edge: a frame number"
    )
    parser.add_argument(
        "--anyway",
        action="store_true",
        help="with --near: edit also when the nearest palette colour is further than 0.25 away",
    )
    _add_change(parser)
    parser.set_defaults(run=run_set, track=False)


def _add_track(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = _action(
        actions,
        "track",
        "ID CHANGE [RANGE]",
        "change a colour all along its way: every handle of the colours that it comes from and "
        "that it becomes. With --rgb the handle ID gets the colour; the others move by as much, "
        "and darker ones by less.",
    )
    parser.add_argument("id", metavar="ID", help="a vertex, a stop, or an edge")
    parser.add_argument(
        "--frame",
        type=number(),
        metavar="T",
        help="with an edge and --rgb: where it is this colour",
    )
    _add_change(parser)
    parser.set_defaults(run=run_adjust, track=True)
    parser = _action(
        actions,
        "palette",
        "CHANGE [RANGE]",
        "change every colour of the palette: by offsets, or by hue, chroma and lightness.",
    )
    _add_change(parser)
    parser.set_defaults(run=run_adjust, id=None, frame=None, track=False)


def _add_float(parser: argparse._ActionsContainer) -> None:
    parser.add_argument(
        "--float",
        dest="any_value",
        action="store_true",
        help="take colours such as 255 128 0 as they are, not as integers of 8 bits",
    )


def _add_change(parser: argparse.ArgumentParser) -> None:
    change = parser.add_argument_group("CHANGE: a colour, or offsets, or hue, chroma and lightness")
    change.add_argument(
        "--rgb",
        nargs="+",
        metavar="C",
        action=ColourAction,
        help="the new colour: R G B, R,G,B or #rrggbb",
    )
    _add_float(change)
    change.add_argument(
        "--by",
        nargs="+",
        metavar="D",
        action=ColourAction,
        help="added to the code values: DR DG DB or DR,DG,DB",
    )
    change.add_argument(
        "--hue",
        type=number(),
        default=0.0,
        metavar="DEG",
        help="degrees added to the hue (OKLCh of the colour as displayed)",
    )
    change.add_argument(
        "--chroma",
        type=number(0),
        default=1.0,
        metavar="X",
        help="factor of the chroma: 0.8 is a little less colour",
    )
    change.add_argument(
        "--lightness",
        type=number(0),
        default=1.0,
        metavar="X",
        help="factor of the lightness: 1.1 is a little lighter",
    )
    times = parser.add_argument_group("RANGE: only some frames; nothing changes at other frames")
    times.add_argument("--from", dest="start", type=number(), metavar="A", help="first frame")
    times.add_argument("--until", type=number(), metavar="B", help="last frame")
    times.add_argument(
        "--fade",
        type=number(0),
        metavar="N",
        help="frames of the ramps before A and after B (default: one frame)",
    )
    times.add_argument(
        "--fade-out",
        type=number(0),
        metavar="N",
        help="frames of the ramp after B (default: as --fade)",
    )
    times.add_argument(
        "--ramp",
        type=_ramp,
        choices=RAMPS,
        help="the ramp of the changed handles, or of the fades of a range",
    )


def _ramp(text: str) -> str:
    """Argparse type: a ramp; files and earlier versions call the step "hold"."""
    return "step" if text == "hold" else text


def _add_ramp(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = _action(
        actions,
        "ramp",
        "(linear | smooth | step) [ID ...]",
        "choose how edits go from one handle to the next handle in time: after these vertices or "
        "stops, or (without ID) wherever a handle has no ramp of its own.",
    )
    parser.add_argument(
        "ramp",
        type=_ramp,
        choices=RAMPS,
        metavar="RAMP",
        help="linear, smooth (no overshoot) or step",
    )
    parser.add_argument("ids", nargs="*", metavar="ID", help="vertices or stops")
    parser.set_defaults(run=run_ramp)


def _add_move(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = _action(
        actions,
        "move",
        "(STOP --frame T | ID --by DR DG DB)",
        "move a stop in time, or shift a colour.",
    )
    parser.add_argument("id", metavar="ID", help="a stop, or with --by also a vertex")
    parser.add_argument("--frame", type=number(), metavar="T", help="the stop's new time")
    parser.add_argument(
        "--by",
        nargs="+",
        metavar="D",
        action=ColourAction,
        help="added to the colour: DR DG DB or DR,DG,DB",
    )
    _add_float(parser)
    parser.set_defaults(run=run_move)


def _add_reset(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = _action(
        actions,
        "reset",
        "[ID]",
        "give a vertex its own colour back, or remove a stop. Without ID, reset every edit.",
    )
    parser.add_argument("id", nargs="?", metavar="ID", help="a vertex or a stop")
    parser.set_defaults(run=run_reset)


def run_set(args: argparse.Namespace) -> int:
    """Change a vertex, a stop, an edge at a frame, or the palette colour near a colour."""
    if (args.near is None) == (args.id is None):
        raise Palette4dError(
            f"found {'ID and --near' if args.id else 'no ID and no --near'}, expected one of them; "
            f"`palette4d info {quoted(args.sidecar)}` lists the ids"
        )
    if args.near is None:
        return run_adjust(args)
    if args.frame is None:
        raise Palette4dError("found --near without --frame, expected the frame where it is seen")
    document = load(args.sidecar)
    before = _without_picks(document)
    nearest = document.set_near(args.near, frame=args.frame, anyway=args.anyway, **_how(args))
    renamed = document.save()
    print(
        f"the palette colour nearest to {shown(args.near)} at frame {args.frame:g} is "
        f"{shown(nearest.rgb)} of {nearest.id}, {nearest.distance:.3f} away"
    )
    if nearest.handle is None:
        _report(document.grade, before)
    else:
        after = document.grade.near(
            nearest.rgb if args.rgb is None else args.rgb, frame=args.frame
        ).rgb
        when = f" at frame {args.frame:g}"
        own = renamed.get(nearest.handle, nearest.handle)
        print(f"{document.grade.named(own)}: {shown(nearest.rgb)} -> {shown(after)}{when}")
    return 0


def run_adjust(args: argparse.Namespace) -> int:
    """Change a handle, a track or the palette."""
    document = load(args.sidecar)
    before = _without_picks(document)
    document.adjust(args.id, track=args.track, frame=args.frame, **_how(args))
    document.save()
    _report(document.grade, before)
    return 0


def _how(args: argparse.Namespace) -> How:
    kinds = (args.rgb, args.by, (args.hue, args.chroma, args.lightness))
    if [kind in (None, (0, 1, 1)) for kind in kinds].count(False) != 1:
        args.parser.error("expected either --rgb, or --by, or some of --hue, --chroma, --lightness")
    return {
        "rgb": args.rgb,
        "by": args.by,
        "hue": args.hue,
        "chroma": args.chroma,
        "lightness": args.lightness,
        "start": args.start,
        "until": args.until,
        "fade": args.fade,
        "fade_out": args.fade_out,
        "ramp": args.ramp,
        "any_value": args.any_value,
    }


def run_ramp(args: argparse.Namespace) -> int:
    """Choose the ramp of handles, or of the clip."""
    document = load(args.sidecar)
    with document.one_step(f"ramp {args.ramp} {' '.join(args.ids)}".strip()):
        for id_ in args.ids or [None]:
            document.set_ramp(args.ramp, id_)
    document.save()
    places = ", ".join(map(document.grade.named, args.ids)) or "the clip"
    print(f"{places}: the ramp is {args.ramp}")
    return 0


def _without_picks(document: Document) -> Grade:
    """Return the grade as it is now, with the user's own colours only."""
    return document.grade.only("handle", "ramp", "lock")


def _report(new: Grade, old: Grade) -> None:
    """Print the handles that have changed, with their colours before and after."""
    changed = [
        id_
        for id_ in {**old.settings, **new.settings}
        if old.settings.get(id_) != new.settings.get(id_)
    ]
    for id_ in changed[:MOST_LINES]:
        if id_ not in new.settings and old.settings[id_].edge is not None:
            print(f"{old.named(id_)}: removed")
            continue
        stop = new.settings.get(id_)
        if stop is not None and stop.edge is not None and id_ not in old.settings:
            was = old.colour(stop.edge, frame=stop.frame)
        else:
            was = old.colour(id_)
        now = new.colour(id_)
        how = "holds" if was == now else f"{shown(was)} ->"
        print(f"{new.named(id_)}: {how} {shown(now)}")
    if len(changed) > MOST_LINES:
        print(f"and {len(changed) - MOST_LINES} more handles")
    if not changed:
        print("done")
    if met := [pick.id for pick in new.picks if pick.enabled]:
        print(
            f"note: {', '.join(met)} {'is' if len(met) == 1 else 'are'} met as before: picked and "
            "held colours do not move with the palette. `change` or `disable` does that"
        )


def run_move(args: argparse.Namespace) -> int:
    """Move a stop in time, or shift a handle's colour."""
    if args.frame is None and args.by is None:
        raise Palette4dError("move: found neither --frame nor --by, expected at least one of them")
    document = load(args.sidecar)
    lines = []
    if args.frame is not None:
        lines.append(f"{document.grade.named(args.id)} -> frame {args.frame:g}")
        document.move(args.id, frame=args.frame)
    if args.by is not None:
        before = document.grade.colour(args.id)
        document.adjust(args.id, by=args.by, any_value=args.any_value)
        after = document.grade.colour(args.id)
        lines.append(f"{document.grade.named(args.id)}: {shown(before)} -> {shown(after)}")
    document.save()
    print("\n".join(lines))
    return 0


def run_reset(args: argparse.Namespace) -> int:
    """Reset a vertex, remove a stop, or reset everything."""
    document = load(args.sidecar)
    state, before = document.grade.state, _without_picks(document)
    document.reset(args.id)
    document.save()
    if document.grade.state == state:
        print("nothing to reset")
    else:
        _report(document.grade, before)
    return 0
