"""The picture of a palette: its timeline, frames and polyhedra (figures 1 and 8 of the paper).

Without a drawing library: `rows` has the palette as arrays and its rows, `layout` the places of the
timeline, `solid` the polyhedron's projection. The window draws these, too. `timeline` and
`polyhedron` draw them with matplotlib, `page` combines them, `style` holds colours and text.
matplotlib is imported inside functions only, and its global state is never changed.
"""

import contextlib
import importlib
import logging
import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from palette4d.grade.document import Document

EXTENSIONS = (".png", ".svg", ".pdf")


def plot(
    document: "str | os.PathLike[str] | Document",
    path: str | os.PathLike[str],
    *,
    frames: list[float] | None = None,
    clip: str | None = None,
    version: str = "",
    before: str | None = None,
    width: int = 2400,
    force: bool = False,
) -> list[float]:
    """Draw a palette and its edits into a .png, .svg or .pdf file.

    Parameters
    ----------
    document : path or Document
        The palette and its edits.
    path : path
        The picture.
    frames : list of float, optional
        Times to show; by default up to six that stand for all others, with edited ones.
    clip : str, optional
        The clip; by default the clip that the sidecar names.
    version : str
        The version to draw; "": the active edits.
    before : str, optional
        A version to compare with: its colours stand in the place of the clip's.
    width : int
        Pixels, for .png.
    force : bool
        Replace an existing picture.

    Returns
    -------
    list of float
        The frames whose pixels could not be read; there the picture shows only the palette.

    Raises
    ------
    Palette4dError
        The sidecar, a frame, the clip or the output is unusable; nothing was written.
    """
    load_matplotlib()
    import matplotlib.style

    from palette4d.common.errors import Palette4dError
    from palette4d.common.files import refuse_existing, replacing
    from palette4d.grade.clip_colours import ClipColours, track_shares
    from palette4d.grade.document import Document
    from palette4d.media.source_clip import find_clip, frame_colours
    from palette4d.plotting import page, style
    from palette4d.plotting.frames import default_frames
    from palette4d.plotting.rows import PlottedPalette

    output = Path(path)
    if output.suffix.lower() not in EXTENSIONS:
        raise Palette4dError(
            f"{output}: found the extension {output.suffix!r}; expected one of "
            f"{', '.join(EXTENSIONS)}"
        )
    refuse_existing(output, force)
    if not isinstance(document, Document):
        document = Document.load(document)
    if output.exists():
        opened = find_clip(document.path or Path("document"), document.grade.core.clip, clip)
        frames_of_clip = () if opened is None else map(opened.file, opened.frames)
        refuse_existing(output, force, inputs=(document.path, *frames_of_clip))
    graded = document.version(version)
    sidecar = graded.grade.core
    stored = ClipColours(sidecar.polytope, graded.fields())
    shares = track_shares(stored, graded.grade.tracks)
    against = None if before is None else document.version(before).grade.core.edits
    names = ("before", "after") if before is None else (before or "active", version or "active")
    first, last = sidecar.polytope.first_frame, sidecar.polytope.last_frame
    if frames is None:
        frames = default_frames(PlottedPalette.of(sidecar, against), stored)
    columns = []
    for frame in sorted(set(frames)):
        if not first <= frame <= last:
            raise Palette4dError(
                f"frame {frame:g} is outside the clip {sidecar.clip['name']!r}; expected times "
                f"from {first:g} to {last:g}"
            )
        image, _ = frame_colours(document.path or Path("document"), sidecar.clip, frame, clip)
        if image is not None and sidecar.conversion is not None:
            image = sidecar.conversion.steps.to_palette(image).astype("float32")
        columns.append(page.column(sidecar, frame, image, against))
    with (
        matplotlib.style.context("default"),
        matplotlib.rc_context(style.RC),
        replacing(output, force=force) as temporary,
    ):
        figure = page.build(sidecar, columns, against, names, graded.grade.colour_names, shares)
        page.save(figure, temporary, output.suffix.lower()[1:], width)
    return [column.frame for column in columns if not column.pictures]


def load_matplotlib() -> None:
    """Import matplotlib without its warnings, such as of where its cache is without a home folder.

    It would read a matplotlibrc of the folder that it is imported in, and refuse an MPLBACKEND that
    it does not know; no backend is used.
    """
    logger = logging.getLogger("matplotlib")
    before = logger.level
    logger.setLevel(logging.ERROR)
    away = contextlib.chdir(Path(__file__).parent)
    backend = os.environ.pop("MPLBACKEND", None)
    try:
        with contextlib.suppress(FileNotFoundError), away:  # the folder may be gone
            importlib.import_module("matplotlib.font_manager")
    finally:
        logger.setLevel(before)
        if backend is not None:
            os.environ["MPLBACKEND"] = backend
