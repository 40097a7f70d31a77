"""What the process of a verb may read and write while it decodes files of strangers."""

from __future__ import annotations

import argparse
import atexit
import contextlib
import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from palette4d.common import sandbox
from palette4d.common.errors import Palette4dError
from palette4d.common.writer import Promise, writer_for

#: The actions of `edit` that read the clip.
READING = frozenset(
    {"pick", "hold", "area", "window", "change", "enable", "disable", "unpick", "copy"}
)


@dataclass
class Needs:
    """What a verb may write and read.

    Attributes
    ----------
    writes : its output.
    sidecars, clip : read with their clips, or with this one.
    files : others that are read.
    starts : whether it starts processes of its own.
    """

    writes: Promise
    sidecars: list[Path] = field(default_factory=list)
    clip: str | None = None
    files: list[Path] = field(default_factory=list)
    starts: bool = False

    def paths(self) -> Iterator[Path]:
        """Yield the files and folders to read."""
        from palette4d.media.clip_files import files_of, files_of_sidecar

        yield from self.files
        for sidecar in self.sidecars:
            with contextlib.suppress(Palette4dError, OSError):  # the verb says so
                yield from files_of_sidecar(sidecar, self.clip)
        if self.clip is not None:
            yield from files_of(self.clip)


@contextlib.contextmanager
def confined(args: argparse.Namespace) -> Iterator[None]:
    """Confine this process for good, if its verb opens a clip in it; end with the body."""
    sandbox.mode, sandbox.is_command = args.sandbox, True
    if not sandbox.wanted() or (needs := _needs(args)) is None:
        yield
        return
    with writer_for(needs.writes) as writer:
        if args.verb == "plot":
            from palette4d.plotting import load_matplotlib

            load_matplotlib()  # it reads and writes its list of fonts
            atexit.unregister(shutil.rmtree)  # where it has no home: the writer's folder goes
        folders = [] if writer.folder is None else [writer.folder]
        sandbox.confine(needs.paths(), folders, starts=needs.starts)
        yield


def _needs(args: argparse.Namespace) -> Needs | None:
    if getattr(args, "cluster", None) is not None:
        return None  # it needs the network; workers on other machines decode
    if args.verb == "analyze":
        return _of_analysis(args)
    if args.verb in ("render", "plot", "bake"):
        output = Path(args.output)
        parts = sandbox.parts(output.parent, {output.suffix.lower().lstrip(".")})
        forced = args.force or getattr(args, "skip_existing", False)
        writes = Promise.of_file(output, "all" if forced else "none")
        files = [*parts, *_configs_of_bake(args)] if args.verb == "bake" else list(parts)
        return Needs(writes, [Path(args.sidecar)], args.clip, files)
    if args.verb == "edit" and args.action in READING:
        return _of_edit(args)
    return None


def _configs_of_bake(args: argparse.Namespace) -> Iterator[Path]:
    """Yield what the configs read that may name the LUT's colour space."""
    from palette4d.colour.ocio_config import files_of_config
    from palette4d.grade import sidecar

    yield from files_of_config(args.ocio_config or os.environ.get("OCIO") or "")
    with contextlib.suppress(Palette4dError, OSError):  # the verb says so
        clip = sidecar.load(args.sidecar)["clip"]
        yield from files_of_config(clip.get("conversion", {}).get("config", ""))


def _of_analysis(args: argparse.Namespace) -> Needs | None:
    from palette4d.colour.ocio_config import files_of_config
    from palette4d.media.clip_files import SIDECARS
    from palette4d.shows.timeline_files import is_timeline

    if is_timeline(args.clip):
        return None  # child processes open all media
    output = Path(args.output)
    files = files_of_config(args.ocio_config or os.environ.get("OCIO") or "")
    files += [output, *sandbox.parts(output if args.detect_shots else output.parent, SIDECARS)]
    if output.is_symlink():  # the former files lie beside the one that it leads to
        files += sandbox.parts(Path(os.path.realpath(output)).parent, SIDECARS)
    files += [] if args.like is None else [args.like]
    if args.detect_shots:
        files += _configs_of_shots(output)
        writes = Promise(output, (".p4d.json", ".shots.json"))
        return Needs(writes, [], args.clip, files, starts=True)
    return Needs(Promise.of_file(output, copies=".former"), [], args.clip, files)


def _configs_of_shots(folder: Path) -> Iterator[Path]:
    """Yield what the configs of single shots, which an earlier run recorded, read."""
    from palette4d.colour.ocio_config import files_of_config
    from palette4d.shows import manifest

    for path in folder.glob(f"*{manifest.ENDING}"):
        with contextlib.suppress(Palette4dError, OSError):  # the verb says so
            for entry in manifest.read(path).entries:
                yield from files_of_config(entry.spaces.get("ocio_config", ""))


def _of_edit(args: argparse.Namespace) -> Needs:
    from palette4d.shows import manifest

    own, writes, others = Path(args.sidecar), Promise.of_file(Path(args.sidecar)), []
    if args.action == "copy":
        others = [args.source]
        if manifest.is_manifest(own):
            writes = Promise(own.parent, ".p4d.json", below=True)
            with contextlib.suppress(Palette4dError, OSError):  # the verb says so
                others += manifest.sidecars(own)[0]
    return Needs(writes, [own, *others], getattr(args, "clip", None), [own, *others])
