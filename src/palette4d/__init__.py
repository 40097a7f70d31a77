"""palette4d: time-varying palettes for colour grading (Du et al., SIGGRAPH 2021).

>>> import palette4d as p4d
>>> doc = p4d.load("shot.p4d.json")                           # doctest: +SKIP
>>> doc.set_near((0.9, 0.5, 0.2), frame=30, rgb=(0.7, 0.2, 0.9))  # doctest: +SKIP
>>> doc.save()                                                # doctest: +SKIP

The names in `__all__` are public and documented in docs/python.md; all others may change. Importing
this module is quick: each name loads its modules at its first use.
"""

import importlib
import os
from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from palette4d.common.errors import Arg, Palette4dError, SidecarError, UnfinishedError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from palette4d._core import __version__
    from palette4d.demo.scene import sample_clip
    from palette4d.grade.document import Document
    from palette4d.grade.picks import Area
    from palette4d.grade.rendering import render
    from palette4d.hosts.install import install_plugin
    from palette4d.lut_export.bake import bake
    from palette4d.lut_export.dctl import export_dctl
    from palette4d.lut_export.glsl import export_glsl
    from palette4d.media.clip import Clip, open_clip
    from palette4d.plotting import plot
    from palette4d.shows.analysis import analyze_shots
    from palette4d.shows.exports import config, export

__all__ = [
    "Area",
    "Document",
    "Palette4dError",
    "SidecarError",
    "UnfinishedError",
    "__version__",
    "analyze",
    "analyze_shots",
    "bake",
    "config",
    "export",
    "export_dctl",
    "export_glsl",
    "install_plugin",
    "load",
    "open_clip",
    "plot",
    "render",
    "sample_clip",
]

_HOMES = {
    "Area": "palette4d.grade.picks",
    "Document": "palette4d.grade.document",
    "__version__": "palette4d._core",
    "analyze_shots": "palette4d.shows.analysis",
    "bake": "palette4d.lut_export.bake",
    "config": "palette4d.shows.exports",
    "export": "palette4d.shows.exports",
    "export_dctl": "palette4d.lut_export.dctl",
    "export_glsl": "palette4d.lut_export.glsl",
    "install_plugin": "palette4d.hosts.install",
    "open_clip": "palette4d.media.clip",
    "plot": "palette4d.plotting",
    "render": "palette4d.grade.rendering",
    "sample_clip": "palette4d.demo.scene",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'palette4d' has no attribute {name!r}")
    value = globals()[name] = getattr(importlib.import_module(_HOMES[name]), name)
    return value


def __dir__() -> list[str]:
    return __all__


def load(path: str | os.PathLike[str], *, version: str = "") -> "Document":
    """Load a sidecar (*.p4d.json): a clip's palette and its edits, or those of a version.

    Raises
    ------
    SidecarError
        The file is missing or unusable.
    Palette4dError
        There is no such version.
    """
    from palette4d.grade.document import Document

    return Document.load(path, version=version)


def analyze(
    clip: "str | os.PathLike[str] | Clip | NDArray[np.floating[Any]]",
    *,
    frames: str | None = None,
    rate: Fraction | None = None,
    skip_bad_frames: bool = False,
    allow_cuts: bool = False,
    input_space: str | None = None,
    palette_space: str | None = None,
    ocio_config: str | None = None,
    method: str = "skew",
    like: "str | os.PathLike[str] | Document | None" = None,
    progress: Callable[[str, int, int], object] | None = None,
    **settings: float,
) -> "Document":
    """Find the time-varying palette of a clip.

    Parameters
    ----------
    clip : str, path, clip or array
        A path or pattern for `open_clip`, an opened clip, or an array (frames, height, width, 3) of
        float code values, usually 0..1. The frame numbers of an array are its indices. The next
        three parameters are for files.
    frames : str, optional
        Only these frames of a file or folder, evenly spaced: "1001-1100x2".
    rate : Fraction, optional
        Frames per second; by default the files' rate, or 24.
    skip_bad_frames : bool
        Skip missing and unreadable frames instead of ending at the first.
    allow_cuts : bool
        Analyse a clip with sudden cuts as one shot instead of refusing it.
    input_space, palette_space, ocio_config : str, optional
        Colour spaces of the clip and of its palette, and the OpenColorIO config that names them
        (docs/colour_spaces.md). Without them, and without ``$OCIO``, the palette has the clip's
        code values.
    progress : callable, optional
        Called as ``progress(stage, done, total)``, for example `print`.
    method : {"skew", "paper", "static", "rgbt"}
        Use the default; the others are for comparison.
    like : str, path or Document, optional
        The sidecar of an earlier version of the clip, as long as this one. Its palette keeps its
        colours and stops, and they move to this clip's colours; nothing is searched.
    **settings
        The settings of `palette4d analyze --help-all`, such as ``vertices=16``; write "lambda" as
        ``lambda_``.

    Returns
    -------
    Document
        Not yet saved; its ``notes`` and its ``report`` are those of the analysis.

    Raises
    ------
    Palette4dError
        The clip cannot be read, its frames are not evenly spaced, it has sudden cuts, or a setting
        is unknown or out of range; `like` is unusable, or does not fit the clip.
    """
    from palette4d.analysis import pipeline
    from palette4d.analysis.options import LIKE, AnalysisOptions
    from palette4d.grade.document import Document
    from palette4d.media.array_clip import ArrayClip
    from palette4d.media.clip import Clip, open_clip
    from palette4d.media.colour_space import SpaceOptions

    if like is not None and method != "skew":
        raise Palette4dError(
            f"{Arg('like')} moves a palette, and {Arg('method', method)} finds one: give one of "
            "them"
        )
    options = AnalysisOptions.of(method if like is None else LIKE, settings)
    earlier = load(like) if isinstance(like, str | os.PathLike) else like
    if not isinstance(earlier, Document | None):
        raise Palette4dError(f"like: found {type(like).__name__}, expected a sidecar or a Document")
    if isinstance(clip, str | os.PathLike):
        opened: Clip = open_clip(
            os.fspath(clip), frames=frames, rate=rate, skip_bad_frames=skip_bad_frames
        )
    else:
        opened = clip if isinstance(clip, Clip) else ArrayClip(clip, first=0)
    found = pipeline.analyze(
        opened,
        options,
        progress,
        spaces=SpaceOptions(input_space, palette_space, ocio_config),
        allow_cuts=allow_cuts,
        like=None if earlier is None else earlier.fields(),
    )
    return Document(found.document, found.notes, found.figures())
