"""The actions of `edit` for picks: pick, hold, area, window, change, enable, unpick, lock, …"""

from __future__ import annotations

import argparse
import json
import math
from typing import TYPE_CHECKING, Any

from palette4d import load
from palette4d.cli.progress import frames_bar
from palette4d.cli.swatches import shown, swatch
from palette4d.cli.terminal import tell
from palette4d.common.arguments import ColourAction, number, whole
from palette4d.common.errors import Palette4dError
from palette4d.common.text import counted, hex_of, percent

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from palette4d.grade.answer import Note
    from palette4d.grade.document import Document
    from palette4d.grade.picks import Pick

    Action = Callable[[str, str, str], argparse.ArgumentParser]

_WHERE = "--frame T (--colour C | --pixel X,Y [--box N])"
_WHEN = "[--from A] [--until B] [--fade N] [--fade-out N]"
_RANGE = ("start", "until", "fade", "fade_out")
_MATTE = ("reach", "softness", "lightness", "whole_hue")


def add_actions(action: Action) -> None:
    """Add the actions to `edit`; `action` adds one from its name, usage and description."""
    pick = action(
        "pick",
        f"{_WHERE} (--to C2 | --by DR,DG,DB | --with ID) {_WHEN} [--window L,T,R,B]",
        "change a thing's colour into another one, and nothing else. What is connected with the "
        "place is the thing: its colours are learned from the frame and from a few others, and "
        "followed through the clip. With --with, say where the colour of an earlier pick is at "
        "another frame.",
    )
    hold = action(
        "hold",
        f"{_WHERE} [--with ID] {_WHEN}",
        "keep a thing's colour as it is, whatever picks and handles do. A hold follows its colour "
        "as a pick does.",
    )
    area = action(
        "area",
        "ID --frame T (--pixel X,Y [--box N] | --stroke X,Y [X,Y …] [--width N])",
        "a box or a stroke of a frame belongs to a pick or hold too; it learns again.",
    )
    area.add_argument("id", metavar="ID", help="p1, p2, …")
    area.add_argument("--frame", type=number(), required=True, metavar="T", help="the frame")
    where = area.add_mutually_exclusive_group(required=True)
    where.add_argument("--pixel", type=_pixel, metavar="X,Y", help="the middle of a box")
    where.add_argument(
        "--stroke", type=_pixel, nargs="+", metavar="X,Y", help="the points of a brush stroke"
    )
    area.add_argument(
        "--box", type=whole(1), metavar="N", help="with --pixel: N x N pixels (default 9)"
    )
    area.add_argument(
        "--width", type=number(1, 1e6), metavar="N", help="of the brush, in pixels (default 9)"
    )
    area.add_argument(
        "--clip", metavar="CLIP", help="the clip (default: the sidecar's, if it is there)"
    )
    area.set_defaults(run=run_area)
    _add_window(action)
    for parser, name in ((pick, "pick"), (hold, "hold")):
        _add_where(parser)
        _add_how(parser)
        parser.add_argument(
            "--with", dest="same", metavar="ID", help=f"the {name} whose path is corrected"
        )
        parser.set_defaults(run=run_pick)
    _add_new(pick)
    pick.add_argument(
        "--window", type=_box_of_window, metavar="L,T,R,B", help="as --box of the action `window`"
    )
    pick.add_argument("--feather", type=number(0, 1e6), metavar="N", help="of the window")
    _add_invert(pick)
    nothing = ("to", "by", "toward", "whole_hue", "reach", "softness", "lightness", "window")
    hold.set_defaults(**dict.fromkeys((*nothing, "feather", "inverted")))
    _add_change(action)
    for name, text in (
        ("enable", "switch picks and holds on again."),
        ("disable", "switch picks and holds off, and keep them."),
        ("unpick", "remove picks and holds."),
    ):
        parser = action(name, "ID [ID …]", text)
        parser.add_argument("ids", nargs="+", metavar="ID", help="p1, p2, …")
        parser.set_defaults(run=run_switch)
    lock = action(
        "lock",
        "ID [ID …]",
        "keep vertices and stops where they are when tracks or the palette move.",
    )
    lock.add_argument("ids", nargs="+", metavar="ID", help="a vertex or a stop")
    lock.set_defaults(run=run_lock)
    unlock = action(
        "unlock", "ID [ID …]", "let tracks and the palette move these vertices and stops again."
    )
    unlock.add_argument("ids", nargs="+", metavar="ID", help="a locked vertex or stop")
    unlock.set_defaults(run=run_lock)
    picks = action("picks", "[--json]", "list the picks, holds and locks.")
    picks.add_argument("--json", action="store_true", help="print JSON")
    picks.set_defaults(run=run_picks)


def _add_where(parser: argparse.ArgumentParser, required: bool = True) -> None:
    parser.add_argument(
        "--frame", type=number(), required=required, metavar="T", help="where the colour is picked"
    )
    where = parser.add_mutually_exclusive_group(required=required)
    where.add_argument(
        "--colour",
        nargs="+",
        metavar="C",
        action=ColourAction,
        help="the colour as it is before edits: R G B, R,G,B or #rrggbb",
    )
    where.add_argument(
        "--pixel",
        type=_pixel,
        metavar="X,Y",
        help="a pixel of the clip: X from the left, Y from the top, both from 0",
    )
    parser.add_argument(
        "--box",
        type=whole(1),
        metavar="N",
        help="with --pixel: the main colour of N x N pixels (default 1)",
    )
    parser.add_argument(
        "--clip", metavar="CLIP", help="the clip (default: the sidecar's, if it is there)"
    )
    parser.add_argument(
        "--float",
        dest="any_value",
        action="store_true",
        help="take colours such as 255 128 0 as they are, not as integers of 8 bits",
    )


def _add_new(parser: argparse.ArgumentParser) -> None:
    new = parser.add_mutually_exclusive_group()
    new.add_argument(
        "--to", nargs="+", metavar="C2", action=ColourAction, help="the new colour, as --colour"
    )
    new.add_argument(
        "--by",
        nargs="+",
        metavar="D",
        action=ColourAction,
        help="the change: DR DG DB or DR,DG,DB",
    )
    parser.add_argument(
        "--toward",
        choices=("shift", "colour"),
        help="at other frames: the same change (shift, default), or the same new colour",
    )
    add = parser.add_argument
    add(
        "--reach",
        type=number(-8, 8),
        metavar="R",
        help="1: a bit more colours, -1: a bit fewer; log odds, -8 to 8 (default 0)",
    )
    add("--softness", type=number(0, 1), metavar="S", help="of the matte's edge (default 0.5)")
    add(
        "--lightness",
        type=_span,
        metavar="A,B",
        help="change only what is this light, 0..1 (default 0,1)",
    )
    add(
        "--whole-hue",
        action=argparse.BooleanOptionalAction,
        help="take all of its hue, as a qualifier does; learn nothing",
    )


def _add_how(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("--from", dest="start", type=number(), metavar="A", help="first frame with the full change")
    add("--until", type=number(), metavar="B", help="last frame with the full change")
    add(
        "--fade",
        type=number(0, 1e9),
        metavar="N",
        help="ramps of N frames before A and after B; beyond them nothing changes (default 0)",
    )
    add(
        "--fade-out",
        type=number(0, 1e9),
        metavar="N",
        help="a ramp of N frames after B (default: as --fade)",
    )
    add(
        "--follow",
        action=argparse.BooleanOptionalAction,
        help="whether the colour, and a window given with it, is followed through the clip "
        "(default), or the same at all frames",
    )


def _add_change(action: Action) -> None:
    parser = action(
        "change",
        f"ID [--frame T] [--colour C | --pixel X,Y [--box N]] [--to C2 | --by D] {_WHEN}",
        "change a pick or hold: its place, its new colour, its range. What is not given stays.",
    )
    parser.add_argument("id", metavar="ID", help="p1, p2, …")
    _add_where(parser, required=False)
    _add_new(parser)
    _add_how(parser)
    parser.set_defaults(run=run_change)


def _add_window(action: Action) -> None:
    parser = action(
        "window",
        "ID ([--frame T] --none | [--frame T --box L,T,R,B] [--feather N] [--invert]) "
        "[--no-follow]",
        "limit a pick to a box, beyond which the change fades out, or with --invert to all but the "
        "box. The box moves with what is in it; more boxes at other frames correct it. Where it is "
        "lost it stays. --feather and --invert alone count for all frames.",
    )
    add = parser.add_argument
    add("id", metavar="ID", help="p1, p2, …")
    add("--frame", type=number(), metavar="T", help="the frame of the box")
    box = parser.add_mutually_exclusive_group()
    box.add_argument(
        "--box",
        type=_box_of_window,
        metavar="L,T,R,B",
        help="left, top, right and bottom in pixels from the top left corner; they may lie "
        "outside of the picture",
    )
    box.add_argument(
        "--none",
        action="store_true",
        help="remove the box of this frame; without --frame the window",
    )
    add(
        "--feather",
        type=number(0, 1e6),
        metavar="N",
        help="pixels beyond the box over which the change fades out; 0: a hard edge (default of a "
        "new window: a tenth of the box's shorter side)",
    )
    _add_invert(parser)
    add(
        "--follow",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="whether the box moves with what is in it (default), or is where it was given",
    )
    add("--clip", metavar="CLIP", help="the clip (default: the sidecar's, if it is there)")
    parser.set_defaults(run=run_window)


def _add_invert(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--invert",
        dest="inverted",
        action=argparse.BooleanOptionalAction,
        help="the pick changes what is outside of the window",
    )


def _pixel(text: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        x = y = math.nan
    if not (math.isfinite(x) and math.isfinite(y)):
        raise argparse.ArgumentTypeError(f"found {text!r}, expected X,Y, such as 320,180")
    return x, y


def _box_of_window(text: str) -> tuple[float, float, float, float]:
    try:
        left, top, right, bottom = (float(part) for part in text.split(","))
    except ValueError:
        left, top, right, bottom = 1, 1, 0, 0
    if not (-1e6 <= left < right <= 1e6 and -1e6 <= top < bottom <= 1e6):
        raise argparse.ArgumentTypeError(
            f"found {text!r}, expected L,T,R,B with L < R and T < B in pixels, such as "
            "320,180,640,400"
        )
    return left, top, right, bottom


def _span(text: str) -> tuple[float, float]:
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        low, high = 1.0, 0.0
    if not 0 <= low < high <= 1:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected A,B within 0 to 1, as 0.2,1")
    return low, high


def run_area(args: argparse.Namespace) -> int:
    """Add a box or a stroke to a pick or hold."""
    from palette4d.grade.picks import Area

    if args.box is not None and args.stroke is not None:
        raise Palette4dError("found --box with --stroke, expected --width")
    if args.width is not None and args.pixel is not None:
        raise Palette4dError("found --width with --pixel, expected --box")
    document = load(args.sidecar)
    points = (args.pixel,) if args.stroke is None else tuple(args.stroke)
    size = (args.box if args.stroke is None else args.width) or 9
    document.add_area(args.id, Area(args.frame, points, size / 2), clip=args.clip)
    document.save()
    _print_pick(args, document, args.id)
    return 0


def run_window(args: argparse.Namespace) -> int:
    """Set, change or remove the window of a pick."""
    if args.frame is None and args.box is not None:
        raise Palette4dError("found --box without --frame, expected the frame of the box")
    shape = {name: getattr(args, name) for name in ("feather", "inverted")}
    if args.frame is None and shape == dict.fromkeys(shape) and not args.none:
        raise Palette4dError(
            "found nothing to change, expected --frame with --box, --feather or --invert"
        )
    if args.frame is not None and args.box is None and not args.none:
        raise Palette4dError("found --frame without --box, expected both")
    if args.none and (other := [name for name in shape if shape[name] is not None]):
        option = {"feather": "--feather", "inverted": "--invert"}[other[0]]
        raise Palette4dError(f"found --none with {option}, expected one of them")
    document = load(args.sidecar)
    with frames_bar("following", hidden=False) as progress:
        if args.box is None and not args.none:
            document.change_pick(args.id, **shape, clip=args.clip)
        else:
            document.set_window(
                args.id,
                args.frame,
                args.box,
                **shape,
                follow=args.follow,
                clip=args.clip,
                progress=progress,
            )
    document.save()
    _print_pick(args, document, args.id, boxed=args.follow)
    return 0


def run_pick(args: argparse.Namespace) -> int:
    """Add a pick or a hold, or correct the path of one."""
    document = load(args.sidecar)
    where: dict[str, Any] = {
        "colour": args.colour,
        "pixel": args.pixel,
        "box": _box(args) or 1,
        "clip": args.clip,
        "any_value": args.any_value,
    }
    names = (*_RANGE, *_MATTE, "toward", "follow", "window", "feather", "inverted")
    how = {name: getattr(args, name) for name in names}
    given = {name: value for name, value in how.items() if value is not None}
    with frames_bar("following", hidden=False) as progress:
        if args.same is not None:
            if args.to is not None or args.by is not None or given:
                raise Palette4dError(
                    "--with corrects the path of an earlier pick; it goes with --frame, --colour, "
                    f"--pixel, --box and --clip only. `change {args.same}` changes the rest"
                )
            pick = document.correct_path(args.same, args.frame, **where, progress=progress)
        elif args.action == "hold":
            pick = document.hold(args.frame, **where, **given, progress=progress)
        else:
            if args.to is None and args.by is None:
                raise Palette4dError(
                    "found neither --to nor --by, expected the new colour or the change "
                    "(or --with ID)"
                )
            pick = document.pick(
                args.frame, **where, to=args.to, by=args.by, **given, progress=progress
            )
    own = document.save().get(pick.id, pick.id)
    follow = args.follow is not False
    _print_pick(args, document, own, followed=follow, boxed=follow and args.same is None)
    return 0


def run_change(args: argparse.Namespace) -> int:
    """Change a pick or hold."""
    document = load(args.sidecar)
    parts = ("frame", "to", *_RANGE, *_MATTE, "toward", "follow")
    changes: dict[str, Any] = {
        name: value for name in parts if (value := getattr(args, name)) is not None
    }
    box = _box(args)
    follows = args.follow or bool(args.follow is None and document.grade.pick(args.id).path)
    with frames_bar("following", hidden=False) as progress:
        if args.pixel is not None:
            changes |= {"pixel": args.pixel, "box": box}
        elif args.colour is not None:
            changes |= {"rgb": args.colour, "pixel": None, "box": None}
        if args.by is not None:
            changes["by"] = args.by
        if not changes:
            raise Palette4dError("found nothing to change, expected at least one option")
        pick = document.change_pick(
            args.id, any_value=args.any_value, clip=args.clip, progress=progress, **changes
        )
    document.save()
    _print_pick(args, document, pick.id, followed=follows)
    return 0


def run_switch(args: argparse.Namespace) -> int:
    """Enable, disable or remove picks and holds."""
    document = load(args.sidecar)
    ids = list(dict.fromkeys(args.ids))
    if args.action == "unpick":
        document.unpick(*ids)
    else:
        with document.one_step(f"{args.action} {' '.join(ids)}"):
            for id_ in ids:
                document.change_pick(id_, enabled=args.action == "enable")
    document.save()
    done = {"unpick": "removed", "enable": "enabled", "disable": "disabled"}[args.action]
    print(f"{done}: {', '.join(ids)}")
    return 0


def run_lock(args: argparse.Namespace) -> int:
    """Lock or unlock handles."""
    document = load(args.sidecar)
    document.lock(*args.ids, locked=args.action == "lock")
    document.save()
    print(f"{args.action}ed: {', '.join(map(document.grade.named, dict.fromkeys(args.ids)))}")
    return 0


def run_picks(args: argparse.Namespace) -> int:
    """List the picks, holds and locks."""
    document = load(args.sidecar)
    if args.json:
        edits = document.fields()["edits"]
        listed = {"picks": edits.get("picks", []), "locks": edits.get("locks", [])}
        print(json.dumps(listed, allow_nan=False))
        return 0
    for pick in document.grade.picks:
        print(_told(document, pick))
    if document.grade.locks:
        print(f"locked: {', '.join(map(document.grade.named, document.grade.locks))}")
    if not document.grade.picks and not document.grade.locks:
        print("no picks, holds or locks")
    return 0


def _print_pick(
    args: argparse.Namespace,
    document: Document,
    id_: str,
    followed: bool = False,
    boxed: bool = False,
) -> None:
    """Print what was asked, and what it does in its frame."""
    clip: str | None = args.clip
    for line in document.pick_warnings(id_, clip):
        tell(args, "warning", line)
    found = next(pick for pick in document.grade.picks if pick.id == id_)
    print(_told(document, found, followed, boxed))
    answer = document.answer(id_, clip) if found.enabled else None
    if answer is not None:
        verb = "takes" if answer.kind == "pick" else "keeps"
        print(f"  {verb} {percent(answer.share)} of frame {answer.frame}")
        for line in (line for note in answer.notes for line in _noted(note, answer.frame)):
            print(f"  {line}")


def _noted(note: Note, frame: int) -> Iterator[str]:
    """Yield a note of an answer for a frame, and its gesture as arguments of `edit`."""
    text, place = "warning: " * note.warns + note.words, note.place
    if note.window is not None:
        box = ",".join(f"{side:g}" for side in note.window)
        yield text
        yield f"  window {note.id} --frame {frame} --box {box} ({note.effect})"
        return
    if place is None:
        yield text
        return
    pixel = f"{place.pixel[0]},{place.pixel[1]}"
    yield f"{text}: {hex_of(place.rgb)} at {pixel}"
    if note.gesture:
        what = "if it is another thing: hold"
        if note.gesture == "area":
            what = f"if it belongs to the thing: area {note.id}"
        where = f"--frame {place.frame} --pixel {pixel} --box {place.box}"
        yield f"  {what} {where} ({note.effect})"


def _told(document: Document, pick: Pick, followed: bool = False, boxed: bool = False) -> str:
    """Return a pick or hold for people: what was asked, its path and its window.

    `followed` and `boxed`: whether the path and the window were to be followed just now.
    """
    from palette4d.grade.colour_moves import fades_text
    from palette4d.grade.unread_steps import unread_picks

    asked = shown(pick.rgb) + (f" -> {shown(pick.to)}" if pick.to is not None else " stays")
    lines = [f"{pick.id}: {pick.kind} at frame {pick.frame:g}: {asked}"]
    if pick.start is not None or pick.until is not None:
        start = "the start" if pick.start is None else f"frame {pick.start:g}"
        until = "the end" if pick.until is None else f"frame {pick.until:g}"
        fade = f", {fades_text(*pick.fades)}" if any(pick.fades) else ""
        lines[0] += f"; from {start} until {until}{fade}"
    if not pick.enabled:
        return f"{lines[0]}; disabled"
    if not pick.covers(pick.frame):
        lines.append(f"  note: frame {pick.frame:g} is outside of its range and does not change")
    if pick.path:
        lines += _path(pick)
        seen = [key.frame for key in pick.path if key.there > 0]
        if 0 < len(seen) < len(pick.path):
            lines.append(
                f"  it is there from frame {seen[0]:g} to {seen[-1]:g}. Elsewhere its colour is "
                "lost among others, or hardly there. Where you still see it: pick --frame T "
                f"--pixel X,Y --with {pick.id}"
            )
    elif pick.id in unread_picks(document.grade, document.history):
        lines.append("  is not followed through the clip yet: open the sidecar in Studio")
    else:
        source = document.grade.core.clip["source"]
        low, high = pick.span(document.grade.frames)
        why = f": the clip {source!r} was not found; give it with --clip"
        why *= followed and low < high
        lines.append(f"  is at the same colour in all frames{why}")
    lines += _window(document, pick, boxed)
    if pick.kind == "pick" and not pick.whole_hue and pick.matte is None:
        lines.append("  takes all of its hue: its colours could not be learned from the clip")
    shown_as = [
        f"reach {pick.reach:g}" * (pick.reach != 0),
        f"softness {pick.softness:g}" * (pick.softness != 0.5),
        "lightness {:g} to {:g}".format(*pick.lightness) * (pick.lightness != (0, 1)),
        "all of its hue" * pick.whole_hue,
        "the same new colour at all frames" * (pick.toward == "colour"),
        counted(len(pick.areas), "more area") * bool(pick.areas),
    ]
    if any(shown_as):
        lines.append(f"  {', '.join(filter(None, shown_as))}")
    return "\n".join(lines)


def _window(document: Document, pick: Pick, followed: bool) -> list[str]:
    """Return where a pick's window is, and from where it could not be followed."""
    if (window := pick.window) is None:
        return []
    given = window.given.keys
    boxes = [f"{','.join(f'{side:g}' for side in k.box)} at frame {k.frame:g}" for k in given[:3]]
    more = f" and {len(given) - 3} more" if len(given) > 3 else ""
    outside = "outside of " if window.inverted else ""
    lines = [f"  {outside}window {', '.join(boxes)}{more}; feather {window.feather:g}"]
    if all(key.given for key in window.keys):
        low, high = pick.span(document.grade.frames)
        clip = document.grade.core.clip
        why = f": the clip {clip['source']!r} was not found; give it with --clip"
        if window.spans(clip["width"], clip["height"]):
            why = ": it reaches across the picture"
        lines[0] += "; not followed" + why * (followed and low < high)
    else:
        # A box that ends at the picture's edge has more room there: the other side counts.
        steps = [
            [abs(side - own) for side, own in zip(key.box, given[0].box, strict=True)]
            for key in window.keys
        ]
        moves = max(math.hypot(min(step[::2]), min(step[1::2])) for step in steps)
        lines[0] += f"; followed, and moves by up to {moves:.0f} pixels"
    lost = pick.lost(document.grade.frames)
    for frame, words in zip(lost, ("until", "from"), strict=True):
        if frame is not None:
            lines.append(
                f"  warning: what is in the window is lost {words} frame {frame:g}, and there the "
                f"window stays. Give it there: window {pick.id} --frame {frame:g} --box L,T,R,B"
            )
    return lines


def _path(pick: Pick) -> list[str]:
    """Return where a pick's colour goes, and what helps if that is another thing's."""
    frames, away = pick.followed()
    if not len(frames):
        return []
    first, far, last = float(frames[0]), float(frames[away.argmax()]), float(frames[-1])
    told = sorted({first, far, last, pick.frame})
    hexes = [
        (hex_of(rgb), swatch(rgb)) for rgb in (pick.colour_at(frame).tolist() for frame in told)
    ]
    colours = [
        f"{patch}{text} at frame {frame:g}"
        for frame, (text, patch) in zip(told, hexes, strict=True)
    ]
    changes = len({text for text, _ in hexes}) > 1
    lines = [f"  follows its colour{': ' + ', '.join(colours) if changes else ', which stays'}"]
    begin, end = pick.alike()
    limits = [f"--from {begin:g}"] * (begin > first) + [f"--until {end:g}"] * (end < last)
    given = any(key.given and key.frame == far for key in pick.path)
    if pick.kind == "pick" and limits and not given:
        same = f"change {pick.id} --toward colour gives it the same new colour. "
        same = f"If the thing itself changes: {same}" if pick.toward == "shift" else ""
        lines.append(
            f"  note: at frame {far:g} it is {away.max():.2f} away from the picked colour. If that "
            f"is another thing: pick --frame {far:g} --pixel X,Y --with {pick.id}, or change "
            f"{pick.id} {' '.join(limits)}. {same}If it stays: change {pick.id} --no-follow"
        )
    return lines


def _box(args: argparse.Namespace) -> int | None:
    if args.box is not None and args.pixel is None:
        raise Palette4dError("found --box without --pixel, expected both or neither")
    box: int | None = args.box
    return box
