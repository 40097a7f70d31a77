"""The 3D LUT of an edit at one time.

A LUT of size N samples the recolouring at the N x N x N colours whose channels are
shaper^-1(i / (N - 1)), computed in double precision by the core.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export.frame_edit import FrameEdit
from palette4d.lut_export.shaper import UNSHAPED, Shaper

from palette4d.colour.conversion_steps import Step
from palette4d.common.errors import Palette4dError

F32 = NDArray[np.float32]

#: OpenColorIO reads and writes sizes from 2 to 129.
SMALLEST, LARGEST = 2, 129

#: Size of the dense grid for errors. It is prime: for every LUT size, the grid's colours fall at
#: many places inside the LUT's cells, and on no node but the centre.
DENSE = 67


@dataclass(frozen=True)
class Lut3D:
    """A sampled colour function.

    Attributes
    ----------
    values : (N, N, N, 3) float32; ``values[r, g, b]`` is the output for the r-th red, g-th green
        and b-th blue. Blue is fastest in memory, as in `OpenColorIO.Lut3DTransform.setData` and in
        CLF.
    shaper : from code values to the LUT's 0..1.
    steps : a conversion before the shaper, in formats with lists of transforms (`spaces`). Its
        inverse follows the LUT.
    """

    values: F32
    shaper: Shaper = UNSHAPED
    steps: tuple[Step, ...] = ()

    @property
    def size(self) -> int:
        """N, the samples per side."""
        return int(self.values.shape[0])


def check_size(size: int) -> None:
    """Raise `Palette4dError` for sizes that OpenColorIO cannot write."""
    if not SMALLEST <= size <= LARGEST:
        raise Palette4dError(
            f"3D LUT size {size} is not possible; expected {SMALLEST} to {LARGEST} samples a side "
            "(OpenColorIO's limits), for example 17, 33 or 65"
        )


def grid(channel: F32) -> F32:
    """Return the (n, n * n, 3) colours of all combinations of the (n,) channel values."""
    red, green, blue = np.meshgrid(channel, channel, channel, indexing="ij")
    colours = np.stack([red, green, blue], axis=-1)
    return np.ascontiguousarray(colours.reshape(colours.shape[0], -1, 3))


def dense_grid(shaper: Shaper) -> F32:
    """Return the (DENSE, DENSE * DENSE, 3) colours that errors are measured on."""
    return grid(shaper.inverse((np.arange(DENSE) + 0.5) / DENSE).astype(np.float32))


def sample(
    edit: FrameEdit,
    size: int,
    shaper: Shaper = UNSHAPED,
    threads: int = 0,
    steps: tuple[Step, ...] = (),
) -> Lut3D:
    """Sample an edit with `size` values a side; the threads do not change the result.

    The colours of `edit` are those after `steps` (`Lut3D.steps`).
    """
    check_size(size)
    nodes = shaper.inverse(np.linspace(0, 1, size)).astype(np.float32)
    values = edit.apply(grid(nodes), threads)
    return Lut3D(values.reshape(size, size, size, 3), shaper, steps)
