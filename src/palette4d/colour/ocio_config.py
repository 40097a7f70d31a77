"""OpenColorIO configs and the names in them; errors suggest similar names."""

import atexit
import contextlib
import difflib
import functools
import os
import re
import sys
from pathlib import Path
from typing import Any

from palette4d.common import sandbox
from palette4d.common.errors import Arg, Palette4dError
from palette4d.common.files import names_a_server

#: OpenColorIO's oldest config with camera encodings: every host with 2.1 or later reads it.
BUILT_IN = "ocio://studio-config-v1.0.0_aces-v1.3_ocio-v2.1"

#: Extensions of the files that a config names.
_LUTS = frozenset(
    {
        *(
            "3dl",
            "cc",
            "ccc",
            "cdl",
            "clf",
            "csp",
            "ctf",
            "cub",
            "cube",
            "hdl",
            "icc",
            "icm",
            "itx",
        ),
        *("look", "lut", "m3d", "mga", "ocio", "spi1d", "spi3d", "spimtx", "vf"),
    }
)

#: Names of scene-linear colour spaces: "Linear", "lin_rec709", "ACEScg", "ACES2065-1", ...
_LINEAR = re.compile(r"\blin(ear)?(\b|_)|scene.linear|acescg|aces2065", re.IGNORECASE)

#: The names of one encoding in files and in OpenColorIO configs of different years.
SAME_ENCODINGS = (
    (
        "sRGB",
        "srgb_tx",
        "srgb_texture",
        "srgb_rec709_scene",
        "sRGB - Texture",
        "Utility - sRGB - Texture",
        "Output - sRGB",
    ),
    (
        "Rec.709",
        "Rec709",
        "g24_rec709",
        "g24_rec709_scene",
        "rec709_display",
        "Gamma 2.4 Rec.709 - Texture",
        "Utility - Rec.709 - Display",
        "Output - Rec.709",
    ),
    ("g22_rec709", "g22_rec709_scene", "Gamma 2.2 Rec.709 - Texture"),
    (
        "lin_rec709",
        "Linear",
        "lin_rec709_scene",
        "lin_srgb",
        "Linear Rec.709 (sRGB)",
        "Utility - Linear - Rec.709",
        "Utility - Linear - sRGB",
    ),
    ("ACEScg", "lin_ap1", "lin_ap1_scene", "ACES - ACEScg"),
    ("ACES2065-1", "lin_ap0", "lin_ap0_scene", "ACES - ACES2065-1"),
    ("ACEScct", "acescct_ap1", "acescct_ap1_scene", "ACES - ACEScct"),
)


def failures() -> tuple[type[Exception], ...]:
    """Return OpenColorIO's exceptions: the one for a missing file is not a subclass."""
    import PyOpenColorIO as ocio

    return ocio.Exception, ocio.ExceptionMissingFile


@functools.cache
def _log_through_python() -> None:
    """Let OpenColorIO's warnings pass what filters Python's: they quote the config's bytes."""
    import PyOpenColorIO as ocio

    ocio.SetLoggingFunction(lambda text: print(text, end="", file=sys.stderr))
    atexit.register(ocio.ResetToDefaultLoggingFunction)


def config_of(path: Path) -> Any:
    """Return the config in a file, as OpenColorIO reads it."""
    import PyOpenColorIO as ocio

    if sys.platform != "win32" or str(path.absolute()).isascii():
        return ocio.Config.CreateFromFile(str(path))
    # There OpenColorIO takes the name of a config, and no other, for one of the code page.
    if path.suffix.lower() == ".ocioz":
        raise Palette4dError(
            f"{path}: OpenColorIO opens such archives on Windows in folders with ASCII names only; "
            "move it to one, such as C:\\ocio"
        )
    config = ocio.Config.CreateFromStream(path.read_text(encoding="utf-8", errors="replace"))
    config.setWorkingDir(str(path.absolute().parent))
    return config


def load_config(name: str, option: str) -> Any:
    """Return a config.ocio, an .ocioz archive, or a built-in ``ocio://`` config.

    `option` is the option or variable that named it ("ocio_config=…", "$OCIO"), for errors.
    """
    import PyOpenColorIO as ocio

    _log_through_python()

    if name.startswith("ocio://"):
        known = [f"ocio://{entry[0]}" for entry in ocio.BuiltinConfigRegistry().getBuiltinConfigs()]
        try:
            return ocio.Config.CreateFromBuiltinConfig(name)
        except failures() as error:
            raise Palette4dError(
                f"{name}: OpenColorIO {ocio.__version__} has no such config; expected one such as "
                f"{' or '.join(near(name, known))}"
            ) from error
    if not Path(name).is_file():
        raise Palette4dError(
            f"{name}: found no config there; expected a config.ocio, an .ocioz archive or a "
            f"built-in ocio:// name with {option}"
        )
    try:
        config = config_of(Path(name))
        config.validate()
    except failures() as error:
        raise Palette4dError(
            f"{name}: OpenColorIO cannot use it as a config: {error}; correct it, or choose "
            f"another with {option}"
        ) from error
    return config


def config_of_sidecar(name: str, option: str) -> Any:
    """Return the config that a sidecar names (`load_config`), but none on another server."""
    if names_a_server(name, Path.cwd()):
        raise Palette4dError(
            f"{name}: found a server that the sidecar names, expected a config of this computer; "
            f"name the config yourself, with {Arg('ocio_config')} or $OCIO"
        )
    return load_config(name, option)


def from_anywhere(name: str | None) -> str | None:
    """Return a config's absolute path; None, "" and names that are not files stay the same."""
    return str(Path(name).absolute()) if name and Path(name).is_file() else name


def files_of_config(name: str) -> list[Path]:
    """Return the files and folders that are read with a config: its own, and where its LUTs are."""
    if not Path(name).is_file():
        return []
    folder = Path(name).absolute().parent
    found = [Path(name), *sandbox.parts(folder, _LUTS)]
    with contextlib.suppress(*failures(), Palette4dError):
        config = config_of(Path(name))
        context = config.getCurrentContext()
        for path in config.getSearchPaths():
            found += sandbox.parts(folder / context.resolveStringVar(path), _LUTS)
    return found


def chosen_config(given: str | None) -> tuple[Any, str]:
    """Return the given config, else the config of ``$OCIO``, else `BUILT_IN`; and its name.

    The name of a file is absolute.
    """
    for name, option in (
        (given, f"{Arg('ocio_config')}"),
        (os.environ.get("OCIO") or None, "$OCIO"),
    ):
        if name is not None:
            return load_config(name, option), from_anywhere(name) or name
    return load_config(BUILT_IN, f"{Arg('ocio_config')}"), BUILT_IN


def colour_space(config: Any, config_name: str, name: str, source: str | Arg) -> Any:
    """Return the colour space with this name, alias or role; `source` is it, with its place, for "
    "errors."""
    found = config.getColorSpace(name)
    if found is None:
        raise Palette4dError(
            f"{source}: found no such colour space in {config_name}; expected a name, "
            f"an alias or a role of it, such as {near_spaces(config, name)}"
        )
    if found.isData():
        raise Palette4dError(
            f"{source}: in {config_name} that holds data, not colours; expected a colour space"
        )
    return found


def near_spaces(config: Any, name: str) -> str:
    """Return the config's colour spaces with a similar name, alias or role, for an error."""
    known: dict[str, str] = {}
    for space in config.getColorSpaces():
        if not space.isData():
            names = [space.getName(), *space.getAliases()]
            known |= {str(entry): str(space.getName()) for entry in names}
    for role, _ in config.getRoles():
        space = config.getColorSpace(role)
        if space is not None and not space.isData():
            known[str(role)] = str(role)
    names = list(dict.fromkeys(known[match] for match in near(name, list(known), 6)))[:4]
    return " or ".join(repr(entry) for entry in names)


def same_encodings(encoding: str) -> list[str]:
    """Return all names of an encoding in files and configs, the given name first.

    >>> same_encodings("lin_ap1")[:2]
    ['lin_ap1', 'ACEScg']
    """
    for names in SAME_ENCODINGS:
        if encoding.strip().lower() in (name.lower() for name in names):
            return [encoding, *names]
    return [encoding]


def says_linear(encoding: str) -> bool:
    """Return whether an encoding's name is that of scene-linear light.

    >>> says_linear("ACEScg"), says_linear("lin_rec709_scene"), says_linear("ACEScct")
    (True, True, False)
    """
    return _LINEAR.search(encoding) is not None


def space_of_encoding(config: Any, encoding: str) -> Any | None:
    """Return the config's colour space for an encoding, under any of its names, or None."""
    spaces = (config.getColorSpace(name) for name in same_encodings(encoding))
    return next((found for found in spaces if found is not None and not found.isData()), None)


def near(name: str, known: list[str], most: int = 3) -> list[str]:
    """Return the known names most similar to a name; the first few names if none is similar.

    >>> near("acesct", ["ACEScg", "ACEScct", "Raw"], 1)
    ['ACEScct']
    """
    lower: dict[str, str] = {}
    for entry in known:
        lower.setdefault(entry.lower(), entry)
    wanted = name.lower()
    holding = [entry for entry in lower if wanted and wanted in entry]
    matches = difflib.get_close_matches(wanted, list(lower), n=most, cutoff=0.4)
    found = list(dict.fromkeys([*matches[:1], *holding, *matches]))[:most]
    return [lower[entry] for entry in found] or known[:8]
