"""The colour space of a clip's palette, through OpenColorIO.

Input: a clip, and the user's colour space options. Output: the same clip with code values in the
palette's colour space, and the conversion for the sidecar. Display-referred colours, as in the
paper, are not converted. Scene-linear code values are converted to a log encoding, where a
photographic stop has the same length everywhere.
"""

from __future__ import annotations

import dataclasses
import functools
import os
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.colour.conversion_chain import TOLERANCE, Comparison, Conversion, conversion
from palette4d.colour.ocio_config import chosen_config, colour_space, same_encodings
from palette4d.common.errors import Arg, Palette4dError
from palette4d.media.clip_base import Clip, Fill, FrameError, Image, hidden

F32 = NDArray[np.float32]

#: Colours per frame for the comparison of the conversion with OpenColorIO's.
COMPARED = 4096

#: Sample types that may be scene-linear.
FLOATS = ("half", "float", "double")

#: The log encoding for scene-linear clips: one of these roles if it is a log, else this space.
LOG_ROLES = ("color_timing", "compositing_log")
LOG_SPACE = "ACEScct"


@dataclasses.dataclass(frozen=True)
class SpaceOptions:
    """The user's options: names of colour spaces, and of their config."""

    input_space: str | None = None
    palette_space: str | None = None
    ocio_config: str | None = None

    @property
    def asked(self) -> bool:
        """Whether colour spaces are in use: an option was given, or ``$OCIO`` is set."""
        return any(dataclasses.astuple(self)) or bool(os.environ.get("OCIO"))


@dataclasses.dataclass(frozen=True)
class Spaces:
    """The colour spaces of a clip and its palette; `conversion` is None if they are the same.

    `note` tells the user where the clip's files state another input space.
    """

    config: Any
    config_name: str
    input_space: str
    palette_space: str
    conversion: Conversion | None
    note: str = ""


def spaces_of(clip: Clip, options: SpaceOptions) -> Spaces | None:
    """Return the colour spaces of a clip and its palette.

    The input space is the first of: the user's option; the config's rule for the file name; the
    file's own statement; the config's default rule, for float files only. The palette space is the
    user's option; else a log encoding for scene-linear clips; else the input space, because camera
    logs and display-referred encodings suit palettes.

    Returns
    -------
    Spaces or None
        None if no colour space is given or known: then the code values are not converted.
    """
    if not options.asked:
        return None
    config, config_name = chosen_config(options.ocio_config)
    source = _input_space(clip, options, config, config_name)
    if source is None:
        if options.palette_space is None:
            return None
        raise Palette4dError(
            f"{clip.source}: found no colour space of the clip (its files say {clip.encoding!r}, "
            f"and no rule of {config_name} applies), expected one to go to "
            f"{options.palette_space!r} from; give it with {Arg('input_space')}"
        )
    target = _palette_space(options, config, config_name, source)
    names = str(source.getName()), str(target.getName())
    chain = None if names[0] == names[1] else conversion(config, *names)
    chain, note = chain if chain and chain.steps else None, ""
    stated = _stated_space(clip, config)
    if options.input_space is None and stated is not None and stated.getName() != names[0]:
        note = (
            f"the clip's files state {stated.getName()!r}, but a rule of {config_name} for their "
            f"names says {names[0]!r}, which is taken; if the files are right, give "
            f"{Arg('input_space', stated.getName())}"
        )
    return Spaces(config, config_name, *names, chain, note)


def _input_space(clip: Clip, options: SpaceOptions, config: Any, config_name: str) -> Any:
    if options.input_space is not None:
        given = options.input_space
        return colour_space(config, config_name, given, Arg("input_space", given))
    path = clip.file(clip.frames[0]).as_posix()  # rules of configs have slashes on every system
    if not config.filepathOnlyMatchesDefaultRule(path):
        name, _ = config.getColorSpaceFromFilepath(path)
        return colour_space(config, config_name, name, f"a file rule for {path}: {name!r}")
    if (stated := _stated_space(clip, config)) is not None:
        return stated
    if clip.depth not in FLOATS:
        return None
    name, _ = config.getColorSpaceFromFilepath(path)
    return colour_space(config, config_name, name, f"the default file rule: {name!r}")


def _stated_space(clip: Clip, config: Any) -> Any:
    """Return the colour space that the clip's files state, if the config knows it."""
    spaces = (config.getColorSpace(name) for name in same_encodings(clip.encoding))
    return next((space for space in spaces if space is not None and not space.isData()), None)


def _palette_space(options: SpaceOptions, config: Any, config_name: str, source: Any) -> Any:
    if options.palette_space is not None:
        given = options.palette_space
        return colour_space(config, config_name, given, Arg("palette_space", given))
    if source.getEncoding() != "scene-linear" and not _is_the_role(config, source, "scene_linear"):
        return source
    for name in (*LOG_ROLES, *same_encodings(LOG_SPACE)):
        space = config.getColorSpace(name)
        if space is not None and space.getEncoding() in ("log", "") and not space.isData():
            return space
    raise Palette4dError(
        f"{config_name}: {source.getName()!r} is scene-linear, in which palettes are of no use, "
        f"and the config has neither the roles {' and '.join(LOG_ROLES)} nor {LOG_SPACE}; name a "
        f"log encoding with {Arg('palette_space')}"
    )


def _is_the_role(config: Any, space: Any, role: str) -> bool:
    return bool(config.hasRole(role)) and bool(
        config.getColorSpace(role).getName() == space.getName()
    )


class ConvertedClip(Clip):
    """A clip whose colours are converted to the palette's colour space for the analysis.

    `frames` and images are not converted. `comparison` holds the error of the converted colours
    against OpenColorIO.
    """

    def __init__(self, clip: Clip, spaces: Spaces) -> None:
        assert spaces.conversion is not None
        fields = {field.name: getattr(clip, field.name) for field in dataclasses.fields(clip)}
        super().__init__(**{name: fields[name] for name in _CLIP_FIELDS})
        self.encoding = spaces.palette_space
        self._clip = clip
        self._chain = spaces.conversion.chain
        self._lock = threading.Lock()
        self.comparison = Comparison(
            spaces.config, spaces.input_space, spaces.palette_space, self._chain
        )

    def file(self, frame: int) -> Path:
        """As the clip itself."""
        return self._clip.file(frame)

    def load(self, frame: int) -> Image:
        """As the clip itself: pixels in the clip's colour space."""
        return self._clip.load(frame)

    def iter_images(self) -> Iterator[Image]:
        """As the clip itself."""
        return self._clip.iter_images()

    def fills(self, frames: Sequence[int]) -> Iterator[tuple[int, Fill]]:
        """Yield for each frame its number and the function that bins it.

        Movies are decoded here in order, images in that function.
        """
        for frame in frames:
            fill: Fill = functools.partial(self._fill, frame)
            if self.is_movie:
                try:
                    fill = functools.partial(self._bin, self._clip.load(frame).pixels)
                except FrameError as error:
                    fill = functools.partial(_fail, error)
            yield frame, fill

    def _fill(self, frame: int, binner: _core.ColourBinner) -> bool:
        return self._bin(self._clip.load(frame).pixels, binner)

    def _bin(self, pixels: F32, binner: _core.ColourBinner) -> bool:
        rows = pixels[self.row_step // 2 :: self.row_step]
        if self.stated.headroom:  # as without a conversion
            rows = np.clip(rows, 0, 1)
        binner.add(np.ascontiguousarray(self.straight_colours(rows)))
        return hidden(rows)

    def straight_colours(self, pixels: F32) -> F32:
        """(h, w, 3) float32 straight colours in the palette's colour space."""
        colours = self._clip.straight_colours(pixels)
        flat = colours.reshape(-1, 3)
        some = flat[:: max(1, len(flat) // COMPARED)]
        with self._lock:
            self.comparison.add(some[np.isfinite(some).all(axis=1)])
        return self._chain.to_palette(colours).astype(np.float32)


def _fail(error: FrameError, binner: _core.ColourBinner) -> bool:
    """Return a function that raises a bad frame's error instead of filling."""
    raise error


_CLIP_FIELDS = tuple(field.name for field in dataclasses.fields(Clip))


def converted(clip: Clip, spaces: Spaces | None) -> Clip:
    """Return the clip with its colours in the palette's colour space."""
    if spaces is None:
        return clip
    if spaces.conversion is None:
        clip.encoding = spaces.palette_space
        return clip
    return ConvertedClip(clip, spaces)


def record(document: dict[str, Any], clip: Clip, spaces: Spaces | None) -> list[str]:
    """Write the conversion into a sidecar's document; returns notes for the user."""
    if not isinstance(clip, ConvertedClip):
        return []
    assert spaces is not None
    assert spaces.conversion is not None
    seen = clip.comparison
    ways = f"from {spaces.input_space!r} to {spaces.palette_space!r}"
    if seen.error > TOLERANCE:
        raise Palette4dError(
            f"{ways}: found a difference of {seen.error:.2g} from OpenColorIO on the clip's "
            f"colours, expected at most {TOLERANCE:g}; choose another {Arg('palette_space')}"
        )
    document["clip"]["conversion"] = {
        "input_space": spaces.input_space,
        "config": spaces.config_name,
        "error": float(f"{max(spaces.conversion.error, seen.error):.2e}"),
        "steps": spaces.conversion.steps,
    }
    notes = []
    if seen.beyond:
        notes.append(
            f"{seen.beyond / seen.colours:.2%} of the clip's colours lie beyond what OpenColorIO "
            f"brings back {ways}; there the curves are continued"
        )
    return notes


def described(spaces: Spaces | None) -> str | None:
    """Return one line for the report, or None."""
    if spaces is None:
        return None
    if spaces.conversion is None:
        return f"the palette is in the clip's own {spaces.palette_space}"
    return (
        f"from {spaces.input_space} to {spaces.palette_space}, within "
        f"{max(spaces.conversion.error, 1e-7):.1g} of OpenColorIO"
    )
