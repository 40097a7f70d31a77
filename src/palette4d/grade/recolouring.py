"""Images recoloured with an edited palette, mattes and weights. The core computes every colour."""

import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.grade.edited_palette import EditedPalette
from palette4d.grade.output import Output

F32 = NDArray[np.float32]


class Recolouring(EditedPalette):
    """What an edited palette makes of an image."""

    def recolour(
        self,
        image: F32,
        frame: float,
        *,
        strength: float = 1.0,
        keep_lightness: float = 0.0,
        lightness_of: str = "auto",
        mix: float = 1.0,
        show: str = "recoloured",
        matte_in: Literal["picture", "alpha"] = "picture",
        outside_at: float = 0.05,
        clean_up: float = 1.0,
        premultiplied: bool = False,
        space: Literal["input", "palette"] = "input",
        threads: int = 0,
    ) -> F32:
        """Recolour an image with the palette at a time: the same bits as the node.

        Parameters
        ----------
        image : (h, w, 3 or 4) float32
            Code values of the clip, 0..1 as a rule; a grade never changes alpha.
        frame : float
            The time; frames outside the clip use its first or last frame.
        strength : float
            0 is the original, 1 the edit.
        keep_lightness : float
            The share of the source's lightness to keep: 0 none, 1 all.
        lightness_of : {"auto", "rec709", "rec2020", "p3", "ap1", "rec601"}
            Whose luminance weights define lightness; "auto": the image's colour space.
        mix : float
            0 is the image, 1 the output.
        show : str
            "recoloured"; "weight:ID", a soft key of a vertex or stop; "pick:ID", the matte of a
            pick or hold; "outside", a matte of the colours outside the palette; "palette", the
            recoloured picture above its palette.
        matte_in : {"picture", "alpha"}
            A key or matte as a grey picture, or multiplied into alpha.
        outside_at : float
            The distance from the palette, in its code values, at which "outside" is 1.
        clean_up : float
            The share of the change by picks that is filtered along the picture's edges, 0..1, so
            that codec blocks, soft chroma and rims do not show. The image must be the whole
            picture: its lower left corner is where the filter's cells begin.
        premultiplied : bool
            Colours are multiplied by alpha.
        space : {"input", "palette"}
            "palette": the image is in the palette's own colour space, not in the clip's.
        threads : int
            0: one per processor. The result does not depend on it.

        Returns
        -------
        (h, w, 3 or 4) float32
            A new array. Without edits it equals `image` bit by bit.
        """
        output = Output(
            show, strength, keep_lightness, lightness_of, mix, matte_in, outside_at, clean_up
        )
        pixels = _checked_image(image)
        palette = self.palette(frame)
        self._conversion(space)  # an error for a space that the sidecar lacks
        recolourer = _core.Recolourer(
            palette.rgb, palette.edited, palette.faces, picks=self.core.picks_at(palette.frame)
        )
        return output.draw(
            pixels,
            self.core,
            palette,
            recolourer,
            picks=[id_ for kind, id_ in self._state if kind == "pick"],
            premultiplied=premultiplied,
            space=space,
            threads=threads,
        )

    def matte(
        self,
        image: F32,
        frame: float,
        show: str,
        *,
        outside_at: float = 0.05,
        clean_up: float = 1.0,
        space: Literal["input", "palette"] = "input",
        threads: int = 0,
    ) -> F32:
        """Return a matte of an image: the same values as the node's.

        Parameters
        ----------
        image : (h, w, 3 or 4) float32
            As in `recolour`; colours are not multiplied by alpha, and alpha is ignored.
        show : str
            "weight:ID", a soft key of a vertex or stop, which follows its colour through time;
            "pick:ID", the matte of a pick or hold; or "outside", the colours outside the palette.
        frame, outside_at, clean_up, space, threads
            As in `recolour`.

        Returns
        -------
        (h, w) float32
            0..1.
        """
        if show == "palette" or show == "recoloured":
            raise Palette4dError(
                f"found {show!r}, expected a matte: 'weight:ID', 'pick:ID' or 'outside'"
            )
        colours = np.ascontiguousarray(_checked_image(image)[..., :3])
        drawn = self.recolour(
            colours,
            frame,
            show=show,
            outside_at=outside_at,
            clean_up=clean_up,
            space=space,
            threads=threads,
        )
        return np.ascontiguousarray(drawn[..., 0])

    def weights(
        self, image: F32, frame: float, *, space: Literal["input", "palette"] = "input"
    ) -> F32:
        """Return the weight of each palette colour in each pixel (mean value coordinates).

        Parameters
        ----------
        image : (h, w, 3 or 4) float32
            As in `recolour`; colours are not multiplied by alpha, and alpha is ignored.
        frame, space
            As in `recolour`.

        Returns
        -------
        (h, w, n) float32
            Weights in the order of ``palette(frame).ids``; they sum to 1. They reproduce the pixel,
            or, outside the palette, its nearest point. NaN for pixels that are not finite.
        """
        colours = _checked_image(image)[..., :3]
        palette = self.palette(frame)
        conversion = self._conversion(space)
        result = np.empty((*colours.shape[:2], len(palette.ids)), np.float32)

        def row(y: int) -> None:
            points: NDArray[Any] = colours[y]
            if conversion is not None:
                points = conversion.to_palette(points)
            result[y], _ = _core.palette_weights(points, palette.rgb, palette.faces)

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(row, range(len(colours))))
        return result


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
