"""The verb `edit`: colours of vertices and stops."""

from __future__ import annotations

import argparse
import functools
import shlex
import textwrap
from typing import TYPE_CHECKING

from palette4d.cli import edit_history, picks
from palette4d.cli.swatches import shown
from palette4d.common.arguments import ColourAction, accept_negative_values, number
from palette4d.common.errors import Palette4dError

if TYPE_CHECKING:
    from palette4d.grade.document import Document
    from palette4d.grade.edits import Setting

EPILOG = """\
example:
  palette4d edit clip.p4d.json set --near 0.9,0.5,0.2 --frame 40 --rgb '#b23aee'
  palette4d edit clip.p4d.json set v12 --rgb 0.8 0.1 0.1
  palette4d edit clip.p4d.json set e4 --frame 23.5 --rgb 0.2 0.4 0.9
  palette4d edit clip.p4d.json move s1 --frame 30
  palette4d edit clip.p4d.json move v12 --by -0.1 0 0.05
  palette4d edit clip.p4d.json reset v12
  palette4d edit clip.p4d.json pick --frame 40 --pixel 320,180 --box 5 --by 0.1,0,-0.05
  palette4d edit clip.p4d.json hold --frame 40 --colour '#7a6b5c'
  palette4d edit clip.p4d.json undo
  palette4d edit clip.p4d.json version save warm

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
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    edit.add_argument("sidecar", metavar="SIDECAR", help="the sidecar file to edit (*.p4d.json)")
    actions = edit.add_subparsers(title="actions", metavar="ACTION", dest="action", required=True)
    _add_set(actions)
    _add_move(actions)
    _add_reset(actions)
    for module in (picks, edit_history):
        module.add_actions(functools.partial(_action, actions))
    accept_negative_values(actions)


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
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def _add_set(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = _action(
        actions,
        "set",
        "(ID | EDGE --frame T | --near C --frame T) --rgb C",
        "give a palette colour another colour. With --near, the palette colour nearest to the one "
        "that you see at a frame gets the new colour there: its vertex moves if it has one within "
        "half a frame, else a stop is added.",
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
        "--rgb",
        nargs="+",
        required=True,
        metavar="C",
        action=ColourAction,
        help="the new colour: R G B, R,G,B or #rrggbb",
    )
    parser.add_argument(
        "--anyway",
        action="store_true",
        help="with --near: edit also when the nearest palette colour is further than 0.25 away",
    )
    parser.add_argument(
        "--float",
        action="store_true",
        help="take colours such as 255 128 0 as they are, not as integers of 8 bits",
    )
    parser.set_defaults(run=run_set)


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
    """Set the colour of a vertex, a stop, or an edge at a frame."""
    document = _load(args)
    if (args.near is None) == (args.id is None):
        raise Palette4dError(
            f"found {'both' if args.id else 'neither'} ID and --near, expected one of them; "
            f"`palette4d info {shlex.quote(args.sidecar)}` lists the ids"
        )
    if args.near is not None and args.frame is None:
        raise Palette4dError("found --near without --frame, expected the frame where it is seen")
    lines = []
    if args.near is not None:
        found = document.set_near(
            args.near, frame=args.frame, rgb=args.rgb, anyway=args.anyway, any_value=args.float
        )
        before, handle = found.rgb, found.handle or found.id
        lines.append(
            f"the palette colour nearest to {shown(args.near)} at frame {args.frame:g} is "
            f"{shown(before)} of {found.id}, {found.distance:.3g} away"
        )
    else:
        before = document.colour(args.id, frame=args.frame)
        if args.frame is None:
            document.set(args.id, rgb=args.rgb, any_value=args.float)
            handle = args.id
        else:
            handle = document.stop(args.id, frame=args.frame, rgb=args.rgb, any_value=args.float)
    document.save()
    at = f" at frame {args.frame:g}" if args.frame is not None else ""
    lines.append(f"{document.named(handle)}: {shown(before)} -> {shown(args.rgb)}{at}")
    print("\n".join(lines))
    return 0


def run_move(args: argparse.Namespace) -> int:
    """Move a stop in time, or shift a handle's colour."""
    if args.frame is None and args.by is None:
        raise Palette4dError("move: found neither --frame nor --by, expected at least one of them")
    document = _load(args)
    lines = []
    if args.frame is not None:
        lines.append(f"{document.named(args.id)} -> frame {args.frame:g}")
        document.move(args.id, frame=args.frame)
    if args.by is not None:
        before = document.colour(args.id)
        document.shift(args.id, by=args.by)
        after = document.colour(args.id)
        lines.append(f"{document.named(args.id)}: {shown(before)} -> {shown(after)}")
    document.save()
    print("\n".join(lines))
    return 0


def run_reset(args: argparse.Namespace) -> int:
    """Reset a vertex, remove a stop, or reset everything."""
    document = _load(args)
    before = dict(document.settings)
    names = {id_: document.named(id_) for id_ in before}
    document.reset(args.id)
    document.save()
    gone = [id_ for id_ in before if id_ not in document.settings]
    for id_ in gone:
        print(f"{names[id_]}: {_after_reset(document, id_, before[id_])}")
    if not gone:
        print("nothing to reset")
    return 0


def _after_reset(document: Document, id_: str, before: Setting | None) -> str:
    if before is None or before.edge is not None:
        return "removed"
    return f"{shown(before.rgb)} -> {shown(document.colour(id_))}"


def _load(args: argparse.Namespace) -> Document:
    from palette4d.grade.document import Document

    return Document.load(args.sidecar)
