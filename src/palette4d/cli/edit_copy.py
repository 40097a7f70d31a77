"""The action `copy` of `edit`: the grade of another palette, for one clip or a show's shots."""

from __future__ import annotations

import argparse
import fnmatch
import os
from pathlib import Path
from typing import TYPE_CHECKING

from palette4d import load
from palette4d.cli.terminal import tell
from palette4d.common.arguments import number
from palette4d.common.errors import Palette4dError
from palette4d.common.text import counted

if TYPE_CHECKING:
    from palette4d.cli.edit_history import Action


class _TimeAction(argparse.Action):
    """Read "relative", "same", or "frame" and a number."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option_string: str | None = None,
    ) -> None:
        words = [str(word) for word in values] if isinstance(values, list) else []
        try:
            if words in (["relative"], ["same"]):
                setattr(namespace, self.dest, words[0])
            elif len(words) == 2 and words[0] == "frame":
                setattr(namespace, self.dest, number()(words[1]))
            else:
                raise argparse.ArgumentTypeError
        except argparse.ArgumentTypeError:
            raise argparse.ArgumentError(
                self, f"found {' '.join(words)!r}, expected relative, same, or frame T"
            ) from None


def add_actions(action: Action) -> None:
    """Add the action to `edit`."""
    parser = action(
        "copy",
        "SOURCE [--time relative | same | frame T] [--shots PATTERN]",
        "take over the grade of another palette. Each handle gets the colour that the other grade "
        "makes of its colour; picks are learned again in another clip. SIDECAR may be a show's "
        "NAME.shots.json: then all its shots get the grade. Former edits are kept as a version.",
    )
    parser.add_argument("source", metavar="SOURCE", type=Path, help="the graded sidecar")
    parser.add_argument(
        "--time",
        nargs="+",
        action=_TimeAction,
        default="relative",
        metavar="WHEN",
        help="relative: first frame to first frame, last to last (default); "
        "same: frames of one number; frame T: all frames get the look of frame T",
    )
    parser.add_argument(
        "--shots",
        metavar="PATTERN",
        default="*",
        help='of a show only the shots with these names, such as "sc07_*"',
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Copy the grade; print how well it fits."""
    from palette4d.shows import manifest

    path = Path(args.sidecar)
    if not manifest.is_manifest(path):
        print(_copied(path, args)[0])
        return 0
    found, _ = manifest.sidecars(path)
    source = os.path.realpath(args.source)
    shots = [
        each
        for each in found
        if os.path.realpath(each) != source
        and fnmatch.fnmatchcase(each.name.removesuffix(".p4d.json"), args.shots)
    ]
    if not shots:
        raise Palette4dError(
            f"{path}: found no shot for {args.shots!r} beside the source; expected names such as "
            f"{', '.join(each.name.removesuffix('.p4d.json') for each in found[:4])}"
        )
    failed = done = 0
    for shot in shots:
        try:
            text, copied = _copied(shot, args)
            print(text)
            done += copied
        except Palette4dError as error:
            failed += 1
            tell(args, "error", error.message)
    print(f"copied the grade to {counted(done, 'shot')} of {len(shots)}")
    return 1 if failed else 0


def _copied(path: Path, args: argparse.Namespace) -> tuple[str, bool]:
    """Return what to tell, and whether anything was copied."""
    document = load(path)
    versions = document.grade.versions
    fit = document.copy_from(load(args.source), time=args.time)
    document.save()
    kept = [
        f"; the edits before are version {v!r}"
        for v in document.grade.versions
        if v not in versions
    ]
    return f"{path.name}: {fit}{''.join(kept)}", not fit.nothing
