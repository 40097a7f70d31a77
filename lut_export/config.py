"""An OpenColorIO config with the looks of shots, which change with the frame.

DIR/config.ocio            the config: a copy of a base config, with looks and views added
DIR/luts/SHOT/SHOT.F.clf   the edit of a shot at each of its frames F, and SHOT.default.clf

Each shot has one look. Its process space is the shot's own encoding. The look's file name contains
the context variable FRAME: a host that sets FRAME shows the look of that frame. The look
`palette4d` also contains the variable SHOT. For each view of the base there is a new view with this
look.
"""

import copy
import filecmp
import glob
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from palette4d.lut_export import series
from palette4d.lut_export.bake import SidecarBytes
from palette4d.lut_export.bake_error import stated
from palette4d.lut_export.config_base import (
    ANY_SHOT,
    LUTS,
    load_base,
    own_folder,
    refuse_looks,
    relocate,
    space_of_sidecar,
)
from palette4d.lut_export.config_error import LARGEST_DELTA_E, BetweenError, between_error, nearest
from palette4d.lut_export.formats import LutFormat, format_named
from palette4d.lut_export.frame_edit import without_windows
from palette4d.lut_export.measured_write import BakeSettings
from palette4d.lut_export.spaces import PALETTE

from palette4d import _core
from palette4d.colour.ocio_config import BUILT_IN, config_of, failures
from palette4d.common import sandbox
from palette4d.common.child import Child
from palette4d.common.errors import Arg, Palette4dError
from palette4d.common.files import make_folder, refuse_existing, replace_by_link, replacing
from palette4d.common.text import checked_name, counted, file_safe
from palette4d.jobs.workers import Workers
from palette4d.media.clip_files import files_of_sidecar
from palette4d.media.oiio_text import file_name

#: The value of FRAME if the host does not set it; a file of that name exists.
NO_FRAME = "default"


@dataclass(frozen=True)
class Shot:
    """One look.

    Attributes
    ----------
    name : the name of the look and of the files, and the value of SHOT.
    process_space : a colour space of the config.
    first, last : the clip's first and last frame. Each frame has a file.
    baked : the files that were baked; all other files are links to the nearest baked file.
    between : the error at the frames between baked frames; None if every frame was baked.
    """

    name: str
    sidecar: str
    process_space: str
    first: int
    last: int
    baked: series.Series
    between: BetweenError | None

    @property
    def error(self) -> float:
        """The largest relative error of the files, in the process space."""
        return float(max(entry["error"] for entry in self.baked.document["frames"]))


@dataclass(frozen=True)
class WrittenConfig:
    """The config that was written; `views` are (display, view), `notes` are for the user."""

    path: Path
    base: str
    shots: list[Shot]
    views: list[tuple[str, str]] = field(default_factory=list, repr=False)
    notes: list[str] = field(default_factory=list)


def write_config(
    sidecars: list[Path],
    folder: Path,
    settings: BakeSettings | None = None,
    *,
    choose: Callable[[_core.Sidecar], tuple[int, ...]] = lambda sidecar: series.every(sidecar, 1),
    base: str | None = None,
    names: tuple[str, ...] | None = None,
    process_space: str | None = None,
    clip: str | None = None,
    workers: Workers | None = None,
    force: bool = False,
    anyway: bool = False,
    progress: Callable[[int, int], object] | None = None,
) -> WrittenConfig:
    """Write a config with a look for each sidecar (`palette4d.config` explains the arguments).

    Parameters
    ----------
    settings : for every frame. The format is CLF by default. The colour space is always the
        palette's: OpenColorIO itself converts to a look's process space.
    choose : sidecar -> the frames to bake; each other frame shows the nearest baked frame.
    force : replace an existing config, and looks of the same names.

    Raises
    ------
    Palette4dError
        Nothing was written; or only LUTs, if a frame could not be baked or OpenColorIO refuses the
        config.
    """
    path = Path(file_name(folder)) / "config.ocio"
    if folder.is_dir():
        refuse_existing(path, force)
    settings = replace(settings or BakeSettings(), space=PALETTE)
    settings = replace(settings, format=settings.format or "clf")
    format_ = format_named(settings.format or "clf")
    stored = [SidecarBytes.of(file) for file in sidecars]  # all is of this state
    read = [one.parsed() for one in stored]
    shot_names = _shot_names(sidecars, read, names)
    base = base or BUILT_IN
    config, archive = load_base(base)
    spaces = [space_of_sidecar(config, base, s, process_space) for s in read]
    if not force:
        refuse_looks(config, base, [ANY_SHOT, *shot_names])
    frames = [choose(sidecar) for sidecar in read]
    between = _between(stored, frames, settings.strength, clip)
    if not anyway:
        _refuse_far(shot_names, between)

    make_folder(folder)
    links = [
        _links(name, format_, chosen, series.every(sidecar, 1))
        for name, chosen, sidecar in zip(shot_names, frames, read, strict=True)
    ]
    requests = []
    for k, (file, name, chosen) in enumerate(zip(stored, shot_names, frames, strict=True)):
        luts = own_folder(own_folder(folder / LUTS) / name)
        for old in _old_links(luts, name, format_) if not path.exists() else ():
            old.unlink()
        for link, target in links[k].items():
            if (luts / link).exists() and not _is_copy(luts / link, luts / target):
                refuse_existing(luts / link, force)
        requests.append(
            series.Request(file, luts, chosen, settings, name, 0, clip, force, replaces_links=True)
        )
    baked = series.export(requests, workers, progress)
    _refuse_failed(shot_names, baked)
    shots = []
    for k, sidecar in enumerate(read):
        every = series.every(sidecar, 1)
        _link(requests[k].folder, links[k])
        for old in _old_links(requests[k].folder, shot_names[k], format_):
            if old.name not in links[k]:
                old.unlink()
        ends = (every[0], every[-1])
        shots.append(Shot(shot_names[k], str(sidecars[k]), spaces[k], *ends, baked[k], between[k]))

    notes = relocate(config, base, archive, folder)
    if process_space is not None:
        given = config.getColorSpace(process_space).getName()
        known = [shot for shot in shots if shot.process_space != given]
        notes += [
            f"look {shot.name}: the config knows its encoding, {shot.process_space}; "
            f"{Arg('process_space')} is for the others"
            for shot in known
        ]
    for shot, sidecar, chosen in zip(shot_names, read, frames, strict=True):
        if not format_.is_cdl and (lacks := without_windows(sidecar, chosen)):
            notes.append(f"look {shot}: {lacks}")
    views = _add_looks(config, shots, format_, notes)
    with replacing(path, force=force) as temporary:
        temporary.write_text(config.serialize(), encoding="utf-8", newline="\n")
        try:
            _validate(config_of(temporary), shots, views)
        except failures() as error:
            raise Palette4dError(
                f"{path}: OpenColorIO refuses the config: {error}; only the LUTs were written. "
                f"Fix {base}, or choose another with {Arg('base')}"
            ) from error
    return WrittenConfig(path, base, shots, views, notes)


# -------------------------------------------------------------------------------------- the shots


def _shot_names(
    sidecars: list[Path], read: list[_core.Sidecar], given: tuple[str, ...] | None
) -> list[str]:
    if given is not None:
        if len(given) != len(sidecars):
            raise Palette4dError(
                f"found {len(given)} names for {len(sidecars)} sidecars, expected one for each, in "
                "the same order"
            )
        names = [checked_name(name) for name in given]
    else:
        names = [file_safe(sidecar.clip["name"]) for sidecar in read]
    for i, name in enumerate(names):
        # Colour space and look names of OpenColorIO do not differ by case.
        same = [k for k in range(i) if names[k].lower() == name.lower()]
        if same:
            raise Palette4dError(
                f"two shots have the name {name!r}: {sidecars[same[0]]} and {sidecars[i]}; "
                f"expected one of its own for each look, give them with {Arg('names')}"
            )
        if name.lower() == ANY_SHOT:
            raise Palette4dError(
                f"{sidecars[i]}: found the shot name {name!r}, the name of the look for all shots; "
                f"give another with {Arg('names')}"
            )
    return names


def _refuse_failed(names: list[str], baked: list[series.Series]) -> None:
    failed = [
        f"shot {name}, {counted(len(made.failed), 'frame')}:\n{series.failures_text(made.failed)}"
        for name, made in zip(names, baked, strict=True)
        if made.failed
    ]
    if failed:
        raise Palette4dError(
            "not all frames could be baked; no config was written, and the same command tries "
            "only these again:\n" + "\n".join(failed)
        )


def _between(
    stored: list[SidecarBytes], frames: list[tuple[int, ...]], strength: float, clip: str | None
) -> list[BetweenError | None]:
    """Return the errors between the frames of each sidecar; a command's child reads its clip."""
    errors = []
    for one, baked in zip(stored, frames, strict=True):
        if sandbox.of_command():
            with Child(reads=files_of_sidecar(one.path, clip)) as child:
                errors.append(child.call(between_error, one, baked, strength, clip))
        else:
            errors.append(between_error(one, baked, strength, clip))
    return errors


def _refuse_far(names: list[str], between: list[BetweenError | None]) -> None:
    far = [
        f"shot {name!r}, frame {error.frame}: deltaE 2000 of {stated(error.delta_e)} from the look "
        f"of frame {error.look}"
        for name, error in zip(names, between, strict=True)
        if error is not None and error.delta_e > LARGEST_DELTA_E
    ]
    if far:
        raise Palette4dError(
            f"the edit changes too much between the baked frames: found {'; '.join(far)}; "
            f"expected at most {LARGEST_DELTA_E:g}. Choose more frames (a smaller {Arg('every')}), "
            f"or write the config with {Arg('anyway', True)}; nothing was written"
        )


def _old_links(luts: Path, name: str, format_: LutFormat) -> list[Path]:
    """Return the links of a shot's looks."""
    if not luts.is_dir():
        return []
    entries = luts.glob(f"{glob.escape(name)}.*{format_.extension}")
    return [entry for entry in entries if entry.is_symlink()]


def _links(
    name: str, format_: LutFormat, baked: tuple[int, ...], every: tuple[int, ...]
) -> dict[str, str]:
    """Return the files that are links, by name: of each frame to that of the nearest baked one."""

    def file(frame: object) -> str:
        return f"{name}.{frame}{format_.extension}"

    middle = min(baked, key=lambda f: (abs(2 * f - every[0] - every[-1]), f))
    links = {file(f): file(nearest(baked, f)) for f in every if nearest(baked, f) != f}
    return {file(NO_FRAME): file(middle), **links}


def _is_copy(file: Path, other: Path) -> bool:
    """Return whether a file is a copy of another, which an earlier run made for want of links."""
    return file.is_file() and other.is_file() and filecmp.cmp(file, other, shallow=False)


def _link(luts: Path, links: Mapping[str, str]) -> None:
    for link, target in links.items():
        place = luts / link
        try:
            replace_by_link(place, target)
        except OSError:
            # The file system has no links: copy.
            with replacing(place, force=True) as temporary:
                shutil.copyfile(luts / target, temporary)


# --------------------------------------------------------------------------------- looks and views


def _add_looks(
    config: Any, shots: list[Shot], format_: LutFormat, notes: list[str]
) -> list[tuple[str, str]]:
    """Add the looks, the variables and the views; return the views."""
    import PyOpenColorIO as ocio

    def look(name: str, shot: str, space: str, description: str) -> Any:
        transform = ocio.FileTransform(
            src=f"{shot}/{shot}.${{FRAME}}{format_.extension}",
            interpolation=ocio.INTERP_DEFAULT if format_.is_cdl else ocio.INTERP_TETRAHEDRAL,
        )
        return ocio.Look(
            name=name, processSpace=space, transform=transform, description=description
        )

    declared = {str(name) for name in config.getEnvironmentVarNames()}
    for variable, value in (("SHOT", shots[0].name), ("FRAME", NO_FRAME)):
        if variable in declared:
            notes.append(f"the base's default of the variable {variable} is kept")
        else:
            config.addEnvironmentVar(variable, value)
    for shot in shots:
        text = (
            f"palette4d, frames {shot.first} to {shot.last} by the variable FRAME; largest "
            f"|a-b|/max(|b|,0.1) in {shot.process_space} {stated(shot.error)}"
        )
        config.addLook(look(shot.name, shot.name, shot.process_space, text))
    spaces = list(dict.fromkeys(shot.process_space for shot in shots))
    if len(spaces) > 1:
        notes.append(
            f"the shots have {len(spaces)} encodings ({', '.join(spaces)}): each shot has a look, "
            f"but there is no view and no look {ANY_SHOT} for all of them"
        )
        return []
    text = "palette4d, by the variables SHOT and FRAME"
    config.addLook(look(ANY_SHOT, "${SHOT}", spaces[0], text))
    return _add_views(config)


def _add_views(config: Any) -> list[tuple[str, str]]:
    """For every view of colours (not of data) add a view with the look of the shot and frame."""
    added = []
    some_active = config.getNumActiveViews() > 0
    for display in [str(name) for name in config.getDisplays()]:
        for view in [str(name) for name in config.getViews(display)]:
            transform = config.getDisplayViewTransformName(display, view)
            space = config.getDisplayViewColorSpaceName(display, view)
            space = display if space == "<USE_DISPLAY_NAME>" else space
            known = config.getColorSpace(space)
            looks = config.getDisplayViewLooks(display, view)
            if (known is not None and known.isData()) or ANY_SHOT in looks:
                continue
            name = f"{view} + {ANY_SHOT}"
            with_ours = f"{ANY_SHOT}, {looks}" if looks else ANY_SHOT
            if transform:
                config.addDisplayView(display, name, transform, space, with_ours)
            else:
                config.addDisplayView(display, name, space, with_ours)
            if some_active:
                config.addActiveView(name)
            added.append((display, name))
    return added


def _validate(config: Any, shots: list[Shot], views: list[tuple[str, str]]) -> None:
    """Validate a config with OpenColorIO, and build the viewer processors at each shot's ends."""
    import PyOpenColorIO as ocio

    config.validate()
    context = copy.deepcopy(config.getCurrentContext())
    for shot in shots:
        space = shot.process_space
        look = ocio.LookTransform(src=space, dst=space, looks=shot.name)
        for frame in (str(shot.first), str(shot.last), NO_FRAME):
            context["SHOT"], context["FRAME"] = shot.name, frame
            config.getProcessor(context, look, ocio.TRANSFORM_DIR_FORWARD)
    forward = ocio.TRANSFORM_DIR_FORWARD
    for display, view in views:
        config.getProcessor(context, shots[-1].process_space, display, view, forward)
