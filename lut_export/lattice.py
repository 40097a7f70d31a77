"""The 3D lattice of an edit at one time.

A lattice of size N samples the recolouring at the N x N x N colours whose channels are
low + i (high - low) / (N - 1), computed in float32 by the node's own core, so that a node of the
lattice and the node in the host give the same bytes for the same colour.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palette4d import _core
from palette4d.errors import Palette4dError

F32 = NDArray[np.float32]

#: What OpenColorIO reads and writes: at least two samples a side, at most 129.
SMALLEST, LARGEST = 2, 129


@dataclass(frozen=True)
class Lattice:
    """A sampled colour function.

    Attributes
    ----------
    values : (N, N, N, 3) float32
        ``values[r, g, b]`` is the colour that replaces the r-th red, g-th green and b-th blue: in
        memory blue runs fastest, which is the order of `OpenColorIO.Lut3DTransform.setData` and of
        CLF. A .cube file lists red fastest; its writer reorders.
    low, high : float
        The domain: the channel values of the first and last sample.
    """

    values: F32
    low: float = 0.0
    high: float = 1.0

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


def recolourer_at(sidecar: _core.Sidecar, frame: float) -> _core.Recolourer:
    """Return the recolouring of a sidecar at one time, a real frame number."""
    polytope = sidecar.polytope
    palette = _core.slice_at(polytope, frame)
    edited = _core.edited_colours(polytope, sidecar.edits, palette)
    return _core.Recolourer(palette.rgb, edited, palette.faces)


def samples(size: int, low: float = 0.0, high: float = 1.0) -> F32:
    """Return the (N,) float32 channel values of a lattice's nodes."""
    return np.linspace(low, high, size, dtype=np.float64).astype(np.float32)


def midpoints(size: int, low: float = 0.0, high: float = 1.0) -> F32:
    """Return the (N - 1,) float32 channel values half way between nodes, where a table is worst."""
    nodes = np.linspace(low, high, size, dtype=np.float64)
    return ((nodes[1:] + nodes[:-1]) / 2).astype(np.float32)


def grid(channel: F32, reds: slice = slice(None)) -> F32:
    """Return the (k, n * n, 3) colours of all combinations of the (n,) channel values.

    `reds` picks k of the red values: a slab of the cube, to work through a large one in pieces.
    """
    red, green, blue = np.meshgrid(channel[reds], channel, channel, indexing="ij")
    colours = np.stack([red, green, blue], axis=-1)
    return np.ascontiguousarray(colours.reshape(colours.shape[0], -1, 3))


def build(recolourer: _core.Recolourer, size: int, *, strength: float = 1.0) -> Lattice:
    """Sample a recolouring on the domain 0..1.

    Parameters
    ----------
    recolourer : Recolourer
        The edit at one time.
    size : int
        N, 2..129.
    strength : float
        As in the node: 0 leaves colours alone, 1 is the edit.

    Raises
    ------
    Palette4dError
        The size is not possible.
    """
    check_size(size)
    colours = grid(samples(size))
    values = recolourer.apply(colours, strength=strength, threads=0)
    return Lattice(values.reshape(size, size, size, 3))
