"""The verb `analyze` for many shots: an edit, or a movie with cuts."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palette4d.cli.progress import frames_bar
from palette4d.cli.terminal import tell
from palette4d.cli.worker_options import add_worker_options
from palette4d.common.arguments import whole
from palette4d.common.errors import Message, UnfinishedError
from palette4d.common.text import counted, on_lines
from palette4d.shows.timeline_files import is_timeline

if TYPE_CHECKING:
    from palette4d.shows.batch import Show

DESCRIPTION = """\
For many shots at once, CLIP is an edit (.otio, .otioz, .otiod, .edl) or, with --detect-shots, a
movie or sequence that is split at its cuts. OUT is then a folder for a sidecar a shot and a
manifest, NAME.shots.json. The same command again does only what is missing or failed.
"""

EPILOG = """\
  palette4d analyze rushes.mov --detect-shots -o shots
  palette4d analyze edit.otio --media plates/ --handles 8 -o shots
  palette4d analyze edit.edl --rate 25 --media plates/ -o shots --only sh010,sh020
  palette4d analyze edit.otio --media plates/ -o shots --cluster tls://farm:8786
"""

MOST_LISTED = 40


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of many shots."""
    group = parser.add_argument_group("many shots")
    group.add_argument(
        "--detect-shots", action="store_true", help="split CLIP at its cuts, a sidecar a shot"
    )
    group.add_argument(
        "--media",
        metavar="FOLDER",
        type=Path,
        help="where an edit's media lies, found by name in all folders below "
        "(default: the edit's paths)",
    )
    group.add_argument(
        "--handles",
        metavar="N",
        type=whole(0, 100_000),
        default=None,
        help="head and tail frames around each shot, up to the end of the media or its "
        "next cut (default 0)",
    )
    group.add_argument(
        "--conform",
        choices=("by-rates", "frame-for-frame"),
        help="how an edit plays movies of another rate than its own (default: docs/shots.md)",
    )
    group.add_argument(
        "--only", metavar="A,B", type=_names, default=(), help="only the shots of these names"
    )
    group.add_argument(
        "--force", action="store_true", help="also analyse shots that have a sidecar"
    )
    add_worker_options(group, "shots")


def _names(text: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in text.split(","))
    if not all(names):
        raise argparse.ArgumentTypeError(f"found {text!r}, expected names separated by commas")
    return names


def is_show(args: argparse.Namespace) -> bool:
    """Whether to analyse many shots; options that conflict are wrong usage."""
    edit = is_timeline(args.clip)
    for_edits = {
        "--media": args.media is not None,
        "--handles": args.handles is not None,
        "--conform": args.conform is not None,
    }
    for_shows = {
        "--only": bool(args.only),
        "--force": args.force,
        "--jobs": args.jobs != 0,
        "--cluster": args.cluster is not None,
    }
    if not edit:
        _refuse(args, for_edits, "needs an edit (.otio, .edl) as CLIP")
    if not edit and not args.detect_shots:
        _refuse(args, for_shows, "needs an edit (.otio, .edl) as CLIP, or --detect-shots")
        return False
    if edit and args.detect_shots:
        args.parser.error("--detect-shots splits a movie; an edit already has its shots")
    if args.like is not None:
        args.parser.error("--like is for one clip; each shot's palette is found anew")
    if edit and args.frames is not None:
        args.parser.error("--frames is for one clip; an edit defines the frames of each clip")
    if args.output.name.endswith(".json"):
        args.parser.error(f"-o {args.output}: expected a folder, for a sidecar a shot")
    return True


def _refuse(args: argparse.Namespace, given: dict[str, bool], needs: str) -> None:
    for option, there in given.items():
        if there:
            args.parser.error(f"{option} {needs}")


def run(args: argparse.Namespace, settings: dict[str, Any]) -> int:
    """Analyse many shots; print the written files, and raise an error for failed shots."""
    from palette4d.shows.analysis import analyze_shots

    failed: UnfinishedError | None = None
    with frames_bar("shots", hidden=args.quiet or args.json) as show:
        try:
            done: Any = analyze_shots(
                args.clip,
                args.output,
                frames=args.frames,
                media=args.media,
                handles=args.handles or 0,
                conform=args.conform,
                only=args.only,
                jobs=args.jobs,
                cluster=args.cluster,
                force=args.force,
                progress=lambda words, done, total: show(done, total, words),
                **settings,
            )
        except UnfinishedError as error:
            done, failed = error.done, error
    for name, notes in done.notes.items():
        for note in notes:
            tell(args, "note", f"{name}: {Message(note).marked}" if name else note)
    if args.json:
        print(done.path.read_text(encoding="utf-8"), end="")
    elif not args.quiet:
        print("\n".join(on_lines(list(report(done)))))
    if failed:
        raise failed
    return 0


def report(done: Show) -> list[str]:
    """Return the report on the written files."""
    from palette4d.shows.manifest import DONE
    from palette4d.shows.shots import words_of_speed

    entries = [entry for entry in done.manifest.entries if entry.status == DONE]
    lines = [
        f"{counted(len(entries), 'shot')} of {len(done.manifest.entries)}: "
        f"{len(done.analysed)} analysed, {len(done.kept)} kept"
    ]
    width = max((len(entry.shot.name) for entry in entries), default=0)
    for entry in entries[:MOST_LISTED]:
        assert entry.frames is not None
        where = f"   {entry.shot.place.record}" if entry.shot.place else ""
        first, last = entry.frames
        if speed := words_of_speed(entry.shot.speed):
            where += f"   {speed}"
        lines.append(f"  {entry.shot.name:<{width}}  frames {first} to {last}{where}")
    if len(entries) > MOST_LISTED:
        lines.append(f"  and {len(entries) - MOST_LISTED} more")
    lines.append(f"wrote {done.path}")
    if entries:
        lines.append(f"next: palette4d edit {done.path.parent / entries[0].sidecar} set …, then")
        lines.append(f"      palette4d export {done.path} --every 10 -o luts")
    return lines
