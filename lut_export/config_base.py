"""The base config: its editable copy, its colour space for a shot, and its own files."""

import os
import re
import shutil
import tempfile
from pathlib import Path
from typing import Any

from palette4d import _core
from palette4d.colour.ocio_config import (
    BUILT_IN,
    colour_space,
    failures,
    load_config,
    near_spaces,
    space_of_encoding,
)
from palette4d.common.errors import Arg, Palette4dError
from palette4d.common.files import make_folder, replacing, temporary_folder

#: The folders beside the config: of the LUTs, and of what the base's archive holds.
LUTS, BASE = "luts", "base"

#: The look for all shots: SHOT and FRAME are both variables.
ANY_SHOT = "palette4d"


def load_base(base: str) -> tuple[Any, bool]:
    """Return an editable copy of the base config, and whether it is an archive."""
    return load_config(base, f"{Arg('base')}"), base.lower().endswith(".ocioz")


def space_of_sidecar(config: Any, base: str, sidecar: _core.Sidecar, wanted: str | None) -> str:
    """Return the name of the config's colour space for a sidecar's code values.

    The lookup is by name, alias or role, under every name of the encoding. Otherwise OpenColorIO
    looks for a colour space that converts alike, if the config has the roles for that. Where the
    config does not know the encoding, `wanted` names the colour space.
    """
    import PyOpenColorIO as ocio

    given = ""
    if wanted is not None:
        given = str(colour_space(config, base, wanted, Arg("process_space", wanted)).getName())
    encoding = str(sidecar.clip["encoding"])
    if encoding.strip().lower() in ("", "unknown"):
        if given:
            return given
        raise Palette4dError(
            f"the sidecar of {sidecar.clip['name']!r} does not say in which encoding its colours "
            f"are; name a colour space of the config with {Arg('process_space')}"
        )
    if (named := space_of_encoding(config, encoding)) is not None:
        return str(named.getName())
    lacking = ""
    built_in = ocio.Config.CreateFromBuiltinConfig(BUILT_IN)
    if (known := space_of_encoding(built_in, encoding)) is not None:
        try:
            return str(ocio.Config.IdentifyBuiltinColorSpace(config, built_in, known.getName()))
        except failures():
            roles = ("aces_interchange", "scene_linear")
            missing = [role for role in roles if not config.hasRole(role)]
            if missing:
                lacking = f"; it lacks the role {missing[0]}, which could identify one"
    if given:
        return given
    raise Palette4dError(
        f"{base}: found no colour space for {encoding!r}{lacking}; name one with "
        f"{Arg('process_space')}, such as {near_spaces(config, encoding)}"
    )


def refuse_looks(config: Any, base: str, names: list[str]) -> None:
    """Refuse a base that has looks of these names, in upper or lower case."""
    there = {str(name).lower() for name in config.getLookNames()}
    for name in names:
        if name.lower() in there:
            other = (
                "give all shots in one command"
                if name == ANY_SHOT
                else f"choose others with {Arg('names')}"
            )
            raise Palette4dError(
                f"{base}: it has a look {name!r} already, expected none; {other}, or replace it "
                f"with {Arg('force', True)}"
            )


def relocate(config: Any, base: str, archive: bool, folder: Path) -> list[str]:
    """Let the new config find the base's own files; return notes about them."""
    notes: list[str] = []
    own = [str(path) for path in config.getSearchPaths()]
    if not base.startswith("ocio://"):
        if archive:
            _extract(base, folder / BASE)
            root = BASE
        else:
            there = Path(base).absolute().parent
            root = "" if there == folder.absolute() else str(there)
        config.clearSearchPaths()
        # Put it first: only a base that palette4d wrote can have files of the same names.
        config.addSearchPath(LUTS)
        for path in own or [""]:
            # A variable may hold either: OpenColorIO passes over what is not there.
            either = path.startswith(("$", "%"))
            absolute = Path(path).is_absolute()
            moved = [path] if absolute or either or not root else []
            moved += [str(Path(root) / path)] if root and not absolute else []
            for one in moved:
                if one != LUTS:
                    config.addSearchPath(one or ".")
        if root and not archive:
            notes.append(f"the base's own files are still read from {root}")
        # If a config lists variables, OpenColorIO ignores all other environment variables.
        if not list(config.getEnvironmentVarNames()):
            notes += _declare_variables(config)
    else:
        config.addSearchPath(LUTS)
    config.setWorkingDir(str(folder.absolute()))
    return notes


def own_folder(folder: Path) -> Path:
    """Return a folder of the config; it may be missing, but no link to a folder of others."""
    if folder.is_symlink():
        raise Palette4dError(
            f"{folder}: found a link, expected a folder of the config's own; remove the link, or "
            "choose another folder for the config"
        )
    return folder


def _extract(archive: str, target: Path) -> None:
    """Write the files of an archive into a folder, each as a whole."""
    import PyOpenColorIO as ocio

    with temporary_folder(Path(tempfile.gettempdir())) as scratch:
        try:
            ocio.ExtractOCIOZArchive(archive, str(scratch))
        except failures() as error:
            raise Palette4dError(
                f"{archive}: the archive cannot be unpacked ({error}); expected a whole .ocioz, "
                "and room in the folder for temporary files"
            ) from error
        for path in sorted(scratch.rglob("*")):
            if path.is_dir():
                continue
            place = target / path.relative_to(scratch)
            for folder in reversed(place.relative_to(target.parent).parents[:-1]):
                make_folder(own_folder(target.parent / folder))
            with replacing(place, force=True) as temporary:
                shutil.copyfile(path, temporary)


def _declare_variables(config: Any) -> list[str]:
    notes = []
    used = set(re.findall(r"\$\{?([A-Za-z_][A-Za-z0-9_]*)", config.serialize()))
    used |= set(re.findall(r"%([A-Za-z_][A-Za-z0-9_]*)%", config.serialize()))
    for name in sorted(used - {"SHOT", "FRAME"}):
        value = os.environ.get(name, "")
        if value and not Path(value).exists():  # it may be a secret: a base can name any variable
            config.addEnvironmentVar(name, "")
            notes.append(f"set the base's variable {name} where the config is used")
            continue
        config.addEnvironmentVar(name, value)
        notes.append(f"the base's variable {name} is now {value!r} by default")
    return notes
