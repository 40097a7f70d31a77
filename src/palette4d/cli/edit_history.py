"""The actions of `edit` that keep what the user did: undo, redo, history, version."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING

from palette4d import load
from palette4d.common.arguments import whole
from palette4d.common.errors import Palette4dError
from palette4d.common.text import counted, on_lines

if TYPE_CHECKING:
    from collections.abc import Callable

    #: Adds an action by its name, usage and description.
    Action = Callable[[str, str, str], argparse.ArgumentParser]


def add_actions(action: Action) -> None:
    """Add the actions to `edit`; `action` adds one from its name, usage and description."""
    for name, text in (
        ("undo", "revert the last step, also of an earlier session."),
        ("redo", "apply the last undone step again."),
    ):
        parser = action(name, "[--steps N]", text)
        parser.add_argument(
            "--steps", type=whole(1), default=1, metavar="N", help="so many steps (default 1)"
        )
        parser.set_defaults(run=run_undo if name == "undo" else run_redo)
    history = action(
        "history",
        "[--json | --clear]",
        "list the steps that undo and redo know, oldest first. The sidecar keeps the last 200, "
        "up to 256 KB.",
    )
    either = history.add_mutually_exclusive_group()
    either.add_argument("--json", action="store_true", help="print JSON")
    either.add_argument("--clear", action="store_true", help="forget the steps; the edits stay")
    history.set_defaults(run=run_history)
    _add_version(action)


def _add_version(action: Action) -> None:
    version = action(
        "version",
        "(save NAME | list | use NAME | rename NAME NEW | note NAME TEXT | remove NAME)",
        "keep edits under a name, list the names, or make the edits of a version the active edits. "
        "Active edits that no version holds are kept as a version first. Undo never takes "
        "a version away.",
    )
    what = version.add_subparsers(title="actions", metavar="WHAT", dest="what", required=True)
    for name, text in (
        ("save", "keep the active edits under a name"),
        ("use", "make a version's edits the active edits"),
        ("rename", "give a version another name"),
        ("note", "say something about a version"),
        ("remove", "remove a version"),
    ):
        parser = what.add_parser(name, help=text)
        parser.add_argument("name", metavar="NAME", help="the version")
        if name == "rename":
            parser.add_argument("new", metavar="NEW", help="a name that no version has")
        elif name == "note":
            parser.add_argument("text", metavar="TEXT", help="one line; '' removes the note")
        parser.set_defaults(run=run_version)
    parser = what.add_parser("list", help="list the versions; * marks the active edits")
    parser.set_defaults(run=run_version)


def _check_steps(wanted: int, there: int, what: str) -> None:
    if 0 < there < wanted:
        raise Palette4dError(
            f"found {counted(there, 'step')} to {what}, expected {wanted}; nothing was changed"
        )


def run_undo(args: argparse.Namespace) -> int:
    """Revert the last steps."""
    document = load(args.sidecar)
    _check_steps(args.steps, len(document.history.done), "undo")
    steps = [document.undo() for _ in range(args.steps)]
    document.save()
    for step in steps:
        print(on_lines(f"undone: {step.label}"))
    return 0


def run_redo(args: argparse.Namespace) -> int:
    """Apply the last undone steps again."""
    document = load(args.sidecar)
    _check_steps(args.steps, len(document.history.undone), "redo")
    steps = [document.redo() for _ in range(args.steps)]
    document.save()
    for step in steps:
        print(on_lines(f"done again: {step.label}"))
    return 0


def run_history(args: argparse.Namespace) -> int:
    """List or forget the steps."""
    document = load(args.sidecar)
    done, undone = document.history.done, document.history.undone
    if args.clear:
        document.forget_history()
        document.save()
        print(f"forgot {counted(len(done) + len(undone), 'step')}")
        return 0
    if args.json:
        labels = {"done": [s.label for s in done], "undone": [s.label for s in undone]}
        print(json.dumps(labels))
        return 0
    for number, step in enumerate((*done, *reversed(undone)), 1):
        unread = "  (not followed yet)" if step.unread else ""
        note = "" if number <= len(done) else "  (undone)"
        print(on_lines(f"{number:>4}  {step.label}{unread}{note}"))
    if not done and not undone:
        print("no steps")
    return 0


def run_version(args: argparse.Namespace) -> int:
    """Save, list, use, rename, describe or remove a version."""
    document = load(args.sidecar)
    if args.what == "list":
        active = set(document.grade.same_edits)
        for name in document.grade.versions:
            mark = "*" if name in active else " "
            note = document.grade.note(name)
            print(on_lines(f"{mark} {name}: {note}" if note else f"{mark} {name}"))
        if not document.grade.versions:
            print("no versions")
        return 0
    if args.what == "save":
        former = document.save_version(args.name)
        text = f"version {args.name}: holds the active edits"
        if former is not None:
            text += f"\nits edits before are kept as version {former}"
    elif args.what == "remove":
        document.remove_version(args.name)
        text = f"version {args.name}: removed; `undo` brings it back"
    elif args.what == "rename":
        document.change_version(args.name, rename=args.new)
        text = f"version {args.name}: its name is {args.new} now"
    elif args.what == "note":
        document.change_version(args.name, note=args.text)
        text = f"version {args.name}: the note is {'kept' if args.text.strip() else 'removed'}"
    else:
        kept = document.use_version(args.name)
        text = f"version {args.name}: its edits are the active edits"
        if kept is not None:
            text += f"\nthe edits before are kept as version {kept}"
    document.save()
    print(text)
    return 0
