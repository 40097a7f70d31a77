"""The 3D lattice of an edit at one time.

A lattice of size N samples the recolouring at the N x N x N colours whose channels are
shaper^-1(i / (N - 1)), computed in double precision by the core; the node in the host is within
1e-4 of that.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export.frame_edit import FrameEdit
from palette4d.lut_export.shaper import UNSHAPED, Shaper

from palette4d.colour.conversion_steps import Step
from palette4d.common.errors import Palette4dError

F32 = NDArray[np.float32]

#: What OpenColorIO reads and writes: at least two samples a side, at most 129.
SMALLEST, LARGEST = 2, 129

#: Samples a side of the grid that errors are measured on. It is prime, so that the grid's colours
#: lie at every place within a lattice's cells, whatever its size, and on no node but the centre.
DENSE = 67


@dataclass(frozen=True)
class Lattice:
    """A sampled colour function.

    Attributes
    ----------
    values : (N, N, N, 3) float32
        ``values[r, g, b]`` is the colour, in the clip's numbers, that replaces the r-th red, g-th
        green and b-th blue: in memory blue runs fastest, which is the order of
        `OpenColorIO.Lut3DTransform.setData` and of CLF. A .cube file lists red fastest; its writer
        reorders.
    shaper : Shaper
        What lies between the clip's numbers and the lattice's 0..1.
    steps : tuple of dict
        A conversion that goes before the shaper, and whose inverse goes after the lattice
        (`spaces`), where the format can hold both.
    """

    values: F32
    shaper: Shaper = UNSHAPED
    steps: tuple[Step, ...] = ()

    @property
    def size(self) -> int:
        """N, the samples a side."""
        return int(self.values.shape[0])


def check_size(size: int) -> None:
    """Refuse sizes that OpenColorIO cannot write.

    Raises
    ------
    Palette4dError
        `size` is not within 2..129.
    """
    if not SMALLEST <= size <= LARGEST:
        raise Palette4dError(
            f"lattice size {size} is not possible; expected {SMALLEST} to {LARGEST} samples a side "
            "(OpenColorIO's limits), for example 17, 33 or 65"
        )


def samples(size: int, shaper: Shaper = UNSHAPED) -> F32:
    """Return the (N,) float32 channel values of a lattice's nodes."""
    return shaper.inverse(np.linspace(0, 1, size)).astype(np.float32)


def grid(channel: F32) -> F32:
    """Return the (n, n * n, 3) colours of all combinations of the (n,) channel values."""
    red, green, blue = np.meshgrid(channel, channel, channel, indexing="ij")
    colours = np.stack([red, green, blue], axis=-1)
    return np.ascontiguousarray(colours.reshape(colours.shape[0], -1, 3))


def dense_grid(shaper: Shaper) -> F32:
    """Return the (DENSE, DENSE * DENSE, 3) colours that errors are measured on."""
    return grid(shaper.inverse((np.arange(DENSE) + 0.5) / DENSE).astype(np.float32))


def build(
    edit: FrameEdit,
    size: int,
    shaper: Shaper = UNSHAPED,
    threads: int = 0,
    steps: tuple[Step, ...] = (),
) -> Lattice:
    """Sample an edit.

    Parameters
    ----------
    edit : FrameEdit
        The edit at one time.
    size : int
        N, 2..129.
    shaper : Shaper
        The domain.
    threads : int
        0: one a processor; the result does not depend on it.
    steps : tuple of dict
        See `Lattice.steps`; the edit is one of the colours that they lead to.

    Raises
    ------
    Palette4dError
        The size is not possible.
    """
    check_size(size)
    values = edit.apply(grid(samples(size, shaper)), threads)
    return Lattice(values.reshape(size, size, size, 3), shaper, steps)


def nearer(size: int | None) -> str:
    """Return what is nearer to an edit than a table of so many samples a side; None: than a CDL.

    No more is promised: a strong edit may be off by more than the preview tier at any size.
    """
    if size is None:
        return "a table (.clf, .cube) comes nearer"
    exact = "the node and `palette4d render` are exact"
    return f"a larger --size comes nearer; {exact}" if size < LARGEST else exact
