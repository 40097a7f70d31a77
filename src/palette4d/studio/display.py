"""True colours: a clip's code values through an OpenColorIO display and view, as 8 bits.

Input: (h, w, 3) float32 code values of the clip's colour space, never clamped. Output: (h, w, 4)
uint8 for the screen. A view that is slow is also made as a shaper and a 3D LUT, for pictures that
move; `Painter.error` says how far these are from the view itself. Exposure and gamma are for
looking only.
"""

import itertools
import os
from collections import OrderedDict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d.colour.ocio_config import (
    BUILT_IN,
    SAME_ENCODINGS,
    config_of_sidecar,
    failures,
    load_config,
    space_of_encoding,
)
from palette4d.common.errors import Palette4dError
from palette4d.grade.document import Document

F32 = NDArray[np.float32]
U8 = NDArray[np.uint8]

#: Steps of views that take more than 100 ns for a pixel; a LUT takes 40 ns. Views without them take
#: up to 30 ns.
SLOW = ("FixedFunction", "Grading")
#: Grid points of the 3D LUT along each axis.
GRID = 49
#: Code values that the LUT covers, for encodings that are not scene-linear.
LOW, HIGH = -0.125, 1.25
#: The LUT of scene-linear code values x covers log2(x + OFFSET) from OFFSET / 8 to HIGHEST.
OFFSET, HIGHEST = 0.01, 128.0
#: Views that show display-referred code values as they are, in the built-in configs.
PLAIN_VIEWS = ("Un-tone-mapped", "Raw")
#: Pixels from which on two threads take less processor time than they save.
LEAST_SHARED = 400_000
#: Painters that are kept: one for each display, view, exposure and gamma.
KEPT = 16

_THREADS = ThreadPoolExecutor(os.cpu_count() or 1, thread_name_prefix="palette4d display")


@dataclass(frozen=True)
class Look:
    """A display and its view, with exposure in stops and gamma."""

    display: str = ""
    view: str = ""
    exposure: float = 0.0
    gamma: float = 1.0


class Painter:
    """One look's conversion to 8 bits.

    Attributes
    ----------
    error : float
        The largest difference of the quick conversion from the exact one, in display code values
        0..1, over colours of the LUT's range; 0 if there is no LUT.
    """

    def __init__(self, config: Any, transform: Any, scene_linear: bool) -> None:
        import PyOpenColorIO as ocio

        exact = config.getProcessor(transform)
        self._exact = _to_8_bits(exact)
        self._quick, self.error = self._exact, 0.0
        self._floats = exact.getDefaultCPUProcessor()
        steps = exact.getOptimizedProcessor(ocio.OPTIMIZATION_DEFAULT).createGroupTransform()
        if any(type(step).__name__.startswith(SLOW) for step in steps):
            shaper, undo = _shaper(scene_linear)
            axis = np.linspace(0, 1, GRID, dtype=np.float32)
            grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
            values = np.ascontiguousarray(undo(grid).reshape(1, -1, 3))
            self._floats.applyRGB(values)
            lut = ocio.Lut3DTransform(GRID)
            lut.setInterpolation(ocio.INTERP_TETRAHEDRAL)
            lut.setData(values.reshape(-1))
            quick = config.getProcessor(ocio.GroupTransform([shaper, lut]))
            self._quick = _to_8_bits(quick)
            sample = np.random.default_rng(5).random((1, 16_384, 3), np.float32)
            probes = np.ascontiguousarray(undo(sample))
            near, true = probes.copy(), probes
            self._floats.applyRGB(true)
            self._floats = quick.getDefaultCPUProcessor()
            self._floats.applyRGB(near)
            self.error = float(np.abs(np.clip(near, 0, 1) - np.clip(true, 0, 1)).max())

    def paint(self, colours: F32, *, exact: bool = True, threads: bool = True) -> U8:
        """Return the (h, w, 4) uint8 picture of (h, w, 3) code values; alpha is 255."""
        cpu = self._exact if exact else self._quick
        if not threads or colours.shape[0] * colours.shape[1] < LEAST_SHARED:
            return self._run(cpu, colours)
        result = np.empty((*colours.shape[:2], 4), np.uint8)
        rows = np.linspace(0, len(colours), (os.cpu_count() or 1) + 1).astype(int)
        parts = list(itertools.pairwise(rows))
        list(_THREADS.map(lambda part: self._run(cpu, colours[slice(*part)], part, result), parts))
        return result

    def values(self, colours: F32) -> F32:
        """Return the display code values of (h, w, 3) code values, in floats and not clamped.

        A view that is slow goes through its LUT.
        """
        result = np.array(colours, np.float32, order="C")
        if result.size:
            self._floats.applyRGB(result.reshape(1, -1, 3))
        return result

    @staticmethod
    def _run(
        cpu: Any, colours: F32, part: tuple[int, int] | None = None, out: U8 | None = None
    ) -> U8:
        import PyOpenColorIO as ocio

        height, width, _ = colours.shape
        source = np.ascontiguousarray(colours, np.float32)
        if out is None:
            out = np.empty((height, width, 4), np.uint8)
        target = out if part is None else out[slice(*part)]
        if source.size:
            auto = ocio.AutoStride
            cpu.apply(
                ocio.PackedImageDesc(source.reshape(-1), width, height, 3),
                ocio.PackedImageDesc(
                    target.reshape(-1), width, height, 4, ocio.BIT_DEPTH_UINT8, auto, auto, auto
                ),
            )
        return target


class Display:
    """The displays and views of a clip's colour space.

    Parameters
    ----------
    space : str
        The colour space or encoding of the clip's code values.
    config : str, optional
        The OpenColorIO config that knows it, where ``$OCIO`` does not.

    Attributes
    ----------
    known : bool
        Whether the encoding is known; if not, code values are shown as they are.
    name : str
        The config that the displays and views are of.
    problem : str
        Why a config could not be used.
    """

    def __init__(self, space: str, config: str | None = None) -> None:
        self.space, self.asked, self.known, self.name = space, config, False, ""
        self._config: Any = None
        self._space: Any = None
        self._painters: OrderedDict[Look, Painter] = OrderedDict()
        self.problem = ""
        for name, option in (
            (os.environ.get("OCIO") or None, "$OCIO"),
            (config, "the sidecar"),
            (BUILT_IN, "the built-in config"),
        ):
            if name is None or self.known:
                continue
            try:
                loaded = (config_of_sidecar if name is config else load_config)(name, option)
            except Palette4dError as error:
                self.problem = str(error)
                continue
            found = None if space in ("", "unknown") else space_of_encoding(loaded, space)
            self._config, self.name = loaded, name
            if found is not None:
                self._space, self.known = found, True

    @staticmethod
    def wanted(document: Document | None, encoding: str) -> tuple[str, str | None]:
        """Return the space and the config for a document's clip, or a clip with this encoding."""
        if document is not None:
            conversion = document.grade.core.conversion
            if conversion is not None:
                return conversion.input_space, conversion.config or None
            if document.grade.encoding != "unknown":
                return document.grade.encoding, None
        return encoding, None

    @property
    def scene_linear(self) -> bool:
        """Whether the clip's code values are proportional to light in the scene."""
        return self.known and self._space.getEncoding() == "scene-linear"

    @property
    def display_referred(self) -> bool:
        """Whether the clip's code values are meant for a screen as they are."""
        if not self.known:
            return True
        names = [self._space.getName(), *self._space.getAliases(), self.space]
        plain = {name.lower() for row in SAME_ENCODINGS[:3] for name in row}
        return self._space.getEncoding() in ("sdr-video", "hdr-video") or any(
            name.lower() in plain for name in names
        )

    def displays(self) -> list[str]:
        """Return the config's displays."""
        return list(self._config.getDisplays()) if self.known else []

    def views(self, display: str) -> list[str]:
        """Return the views of a display."""
        return list(self._config.getViews(display)) if self.known else []

    def chosen(self, look: Look) -> Look:
        """Return a look with the display and view that stand for its empty or unknown names.

        Display-referred clips take a view that shows their code values as they are.
        """
        if not self.known:
            return Look("", "", look.exposure, look.gamma)
        displays = self.displays()
        display = look.display if look.display in displays else self._config.getDefaultDisplay()
        views = self.views(display)
        view = look.view
        if view not in views:
            view = self._config.getDefaultView(display)
            if self.display_referred:
                view = next((plain for plain in PLAIN_VIEWS if plain in views), view)
        return Look(display, view, look.exposure, look.gamma)

    def painter(self, look: Look) -> Painter:
        """Return the look's conversion; it may take a tenth of a second the first time."""
        found = self._painters.get(look)
        if found is None:
            chosen = self.chosen(look)
            found = self._painters.get(chosen) or self._make(chosen)
            self._painters[chosen] = self._painters[look] = found
            while len(self._painters) > KEPT:
                self._painters.popitem(last=False)
        return found

    def _make(self, look: Look) -> Painter:
        import PyOpenColorIO as ocio

        gain = 2.0**look.exposure
        exposure = ocio.MatrixTransform([gain, 0, 0, 0, 0, gain, 0, 0, 0, 0, gain, 0, 0, 0, 0, 1])
        steps: list[Any] = []
        config = self._config
        if self.known:
            name = self._space.getName()
            linear = config.getColorSpace(ocio.ROLE_SCENE_LINEAR)
            if look.exposure and linear is not None:
                there = linear.getName()
                steps += [ocio.ColorSpaceTransform(name, there), exposure]
                name = there
            steps.append(ocio.DisplayViewTransform(src=name, display=look.display, view=look.view))
        else:
            config = config or ocio.Config.CreateRaw()
            if look.exposure:
                steps.append(exposure)
        if look.gamma != 1:
            power = 1 / look.gamma
            steps.append(ocio.ExponentTransform([power, power, power, 1.0]))
        try:
            return Painter(config, ocio.GroupTransform(steps), self.scene_linear)
        except failures() as error:
            raise Palette4dError(
                f"the view {look.view!r} of the display {look.display!r} cannot be used: {error}; "
                "choose another in the View menu"
            ) from error


def _to_8_bits(processor: Any) -> Any:
    import PyOpenColorIO as ocio

    return processor.getOptimizedCPUProcessor(
        ocio.BIT_DEPTH_F32, ocio.BIT_DEPTH_UINT8, ocio.OPTIMIZATION_DEFAULT
    )


def _shaper(scene_linear: bool) -> tuple[Any, Any]:
    """Return the transform from code values to the LUT's 0..1, and its inverse for arrays."""
    import PyOpenColorIO as ocio

    if not scene_linear:
        ranged = ocio.RangeTransform(minInValue=LOW, maxInValue=HIGH, minOutValue=0, maxOutValue=1)
        return ranged, lambda y: (LOW + y * np.float32(HIGH - LOW)).astype(np.float32)
    low, high = np.log2(OFFSET / 8), np.log2(HIGHEST + OFFSET)
    slope = 1 / (high - low)
    log = ocio.LogAffineTransform(
        logSideSlope=[slope] * 3,
        logSideOffset=[-low * slope] * 3,
        linSideSlope=[1.0] * 3,
        linSideOffset=[OFFSET] * 3,
    )
    log.setBase(2.0)
    return log, lambda y: (np.exp2(low + y * (high - low)) - OFFSET).astype(np.float32)
