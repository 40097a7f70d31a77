"""Images recoloured with a grade, mattes and weights. The core computes every colour."""

import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.grade.grade import Grade
from palette4d.grade.output import LIGHTNESS_OF, Output
from palette4d.grade.palette import Palette

F32 = NDArray[np.float32]


class Matting(TypedDict, total=False):
    """How to draw a matte: the keywords of `Document.matte`; see `Drawing`."""

    outside_at: float
    clean_up: float
    space: Literal["input", "palette"]
    threads: int


class Drawing(Matting, total=False):
    """How to draw: the keywords of `Document.recolour`.

    Attributes
    ----------
    strength, keep_lightness, lightness_of, mix, show, matte_in, outside_at, clean_up
        The attributes of `palette4d.grade.output.Output`.
    premultiplied : bool
        Colours are multiplied by alpha.
    space : {"input", "palette"}
        "palette": the image is in the palette's own colour space, not in the clip's.
    threads : int
        0: one per processor. The result does not depend on it.
    picture : (x, y, width, height), optional
        The clip's picture within the image, in pixels from the top left; what lies around is
        overscan. All of the image by default. Windows of picks lie in it.
    """

    strength: float
    keep_lightness: float
    lightness_of: str
    mix: float
    show: str
    matte_in: Literal["picture", "alpha"]
    premultiplied: bool
    picture: tuple[int, int, int, int] | None


def recolour(grade: Grade, image: F32, frame: float, **how: Unpack[Drawing]) -> F32:
    """Recolour an image with the palette at a time (`Document.recolour`)."""
    drawing: dict[str, Any] = {**how}
    space = drawing.pop("space", "input")
    premultiplied, threads = drawing.pop("premultiplied", False), drawing.pop("threads", 0)
    picture = drawing.pop("picture", None)
    output = Output(**drawing)
    pixels = _checked_image(image)
    palette = grade.palette(frame)
    conversion = _conversion(grade, space)
    encoding = conversion.input_space if conversion else grade.encoding
    return _core.draw(
        pixels,
        output.kind,  # type: ignore[arg-type]  # Output has checked it
        _map(grade, palette, output),
        original=palette.rgb,
        edited=palette.edited,
        strength=output.strength,
        keep_lightness=output.keep_lightness,
        lightness=_core.luminance_weights(LIGHTNESS_OF[output.lightness_of] or encoding),
        mix=output.mix,
        matte_in_alpha=output.in_alpha,
        outside_at=output.outside_at,
        clean_up=output.clean_up,
        premultiplied=premultiplied,
        threads=threads,
        conversion=conversion.steps if conversion else None,
        picture=picture,
    )


def _map(grade: Grade, palette: Palette, output: Output) -> _core.Recolourer:
    """Return what moves colours: the edit, or what a matte is read from."""
    core, frame, edited = grade.core, palette.frame, palette.edited
    ids, picks = [pick.id for pick in grade.picks], None
    if output.kind == "pick":
        if output.id not in ids:
            known = f"expected {' or '.join(ids)}" if ids else "there are none"
            raise Palette4dError(f"there is no pick or hold {output.id!r}; {known}")
        edited, picks = palette.rgb, core.pick_matte_at(output.id, frame)
    elif output.kind == "outside":
        edited = _core.surface_reader(_core.slice_at(core.polytope, frame))
    elif output.kind == "weight":
        if output.id in ids:
            raise Palette4dError(
                f"found {output.show!r}, expected the id of a vertex or stop; the matte of a "
                f"pick is 'pick:{output.id}'"
            )
        grade.setting(output.id)  # refuses unknown ids
        slice = _core.slice_at(core.polytope, frame)
        edited = _core.weight_reader(core.polytope, core.edits, slice, output.id)
    else:
        picks = core.picks_at(frame)
    return _core.Recolourer(palette.rgb, edited, palette.faces, picks=picks)


def matte(grade: Grade, image: F32, frame: float, show: str, **how: Unpack[Matting]) -> F32:
    """Return a matte of an image, (h, w) (`Document.matte`)."""
    if show == "palette" or show == "recoloured":
        raise Palette4dError(
            f"found {show!r}, expected a matte: 'weight:ID', 'pick:ID' or 'outside'"
        )
    colours = np.ascontiguousarray(_checked_image(image)[..., :3])
    return np.ascontiguousarray(recolour(grade, colours, frame, show=show, **how)[..., 0])


def weights(
    grade: Grade, image: F32, frame: float, *, space: Literal["input", "palette"] = "input"
) -> F32:
    """Return the weight of each palette colour in each pixel (`Document.weights`)."""
    colours = _checked_image(image)[..., :3]
    palette = grade.palette(frame)
    conversion = _conversion(grade, space)
    result = np.empty((*colours.shape[:2], len(palette.ids)), np.float32)

    def row(y: int) -> None:
        points: NDArray[Any] = colours[y]
        if conversion is not None:
            points = conversion.steps.to_palette(points)
        result[y], _ = _core.palette_weights(points, palette.rgb, palette.faces)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(row, range(len(colours))))
    return result


def _conversion(grade: Grade, space: str) -> _core.ClipConversion | None:
    if space not in ("input", "palette"):
        raise Palette4dError(f"found the space {space!r}, expected 'input' or 'palette'")
    return grade.analysed.conversion if space == "input" else None


def _checked_image(image: F32) -> F32:
    array = np.asarray(image)
    if array.dtype.kind != "f" or array.dtype.itemsize != 4:
        if array.dtype.kind == "u":
            largest = 2 ** (8 * array.dtype.itemsize) - 1
            remedy = f"image.astype(numpy.float32) / {largest} makes code values of 0 to 1"
        else:
            remedy = "image.astype(numpy.float32) converts it"
        raise Palette4dError(
            f"found an image of {array.dtype}, expected float32 code values; {remedy}"
        )
    if array.ndim != 3 or array.shape[2] not in (3, 4):
        raise Palette4dError(
            f"found an image of the shape {array.shape}, expected (height, width, 3) or "
            "(height, width, 4)"
        )
    return np.ascontiguousarray(array, dtype=np.float32)
