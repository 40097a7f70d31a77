"""The compiled core: polytope slicing, mean value coordinates, recolouring, the sidecar reader."""

import os
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d.common.errors import SidecarError as SidecarError

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
U8 = NDArray[np.uint8]

__version__: str

class Polytope:
    """The 4D skew polytope (section 4.1). Build one with `parse_sidecar` or `read_sidecar`."""

    @property
    def vertices(self) -> F64:
        """(n, 4) float64, columns r, g, b, t; t is a frame number."""
    @property
    def vertex_ids(self) -> list[str]: ...
    @property
    def edges(self) -> I32:
        """(m, 2) int32 vertex indices, earlier end first."""
    @property
    def edge_ids(self) -> list[str]: ...
    @property
    def sections(self) -> list[dict[str, Any]]:
        """Blocks and transitions in order: first, last, transition, tracks, faces."""
    @property
    def first_frame(self) -> float: ...
    @property
    def last_frame(self) -> float: ...

class Edits:
    """Edited colours of vertices, colour stops on edges, and picks."""

    @property
    def vertex_rgb(self) -> dict[str, tuple[float, float, float]]: ...
    @property
    def vertex_ramp(self) -> dict[str, str]:
        """The ramps of edited vertices that have their own."""
    @property
    def stops(self) -> list[dict[str, Any]]:
        """id, edge (its id), frame, rgb; and ramp where the stop has its own."""
    @property
    def ramp(self) -> str:
        """The ramp of all other handles: "linear", "smooth" or "hold"."""
    @property
    def empty(self) -> bool:
        """Whether nothing is edited: no vertex, no stop and no pick that is switched on."""
    @property
    def pick_times(self) -> list[float]:
        """Frames of enabled picks: their own, those of paths, and the ends of ranges and fades."""
    def windows_at(self, frame: float) -> list[str]:
        """The ids of picks with windows that ask for something at a frame."""
    def picks_at(self, frame: float) -> FramePicks:
        """The picks and holds that ask for something at a frame."""
    def with_matte_levels(self, levels: int) -> Edits:
        """The same edits, with mattes of that many values where they were picked; 0: all."""
    def still_mattes(self) -> dict[int, tuple[bool, F32, list[float], list[float], bool]]:
        """What the mattes of enabled picks and holds are made from, by their numbers.

        Whether it is a hold, its (96, 96, 16) matte where it was picked, the shares of its 16
        lightnesses, the picked colour's point, and whether it was learned.
        """
    def pick_moments(self, frame: float) -> list[tuple[int, list[float], float]]:
        """Number, point and strength of what asks for something at a frame; picks first."""

class ColourConversion:
    """A chain of matrices and curves; see docs/sidecar.md."""

    def __init__(self, steps: str, name: str = ...) -> None:
        """From the JSON text of the steps; SidecarError when they are no such chain."""
    @property
    def identity(self) -> bool: ...
    @property
    def members(self) -> list[dict[str, Any]]:
        """The steps: kind ("matrix", "log", "gamma" or "curve") and its members; curves (x, y)."""
    def to_palette(self, colours: ArrayLike) -> F64:
        """(..., 3) clip numbers -> (..., 3) float64 palette numbers."""
    def to_clip(self, colours: ArrayLike) -> F64:
        """(..., 3) palette numbers -> (..., 3) float64 clip numbers."""

class ClipConversion:
    """How a sidecar's clip becomes what its palette is in."""

    @property
    def input_space(self) -> str: ...
    @property
    def config(self) -> str: ...
    @property
    def error(self) -> float:
        """The largest difference from OpenColorIO that the analysis measured."""
    @property
    def steps(self) -> ColourConversion: ...

class Sidecar:
    """A validated sidecar file."""

    @property
    def clip(self) -> dict[str, Any]:
        """name, source, first, last, step, rate (num, den), width, height, encoding."""
    @property
    def polytope(self) -> Polytope: ...
    @property
    def edits(self) -> Edits: ...
    @property
    def versions(self) -> list[tuple[str, Edits]]:
        """Names and edits of the kept versions, in the file's order."""
    def with_edits(
        self, edits: Mapping[str, Any], mattes: Mapping[str, Any] | None = ..., name: str = ...
    ) -> Sidecar:
        """The same palette with other members "edits" and "mattes", and no versions."""
    def picks_at(self, frame: float) -> FramePicks:
        """The picks and holds of the active edits; outside the clip, those at its ends."""
    def pick_matte_at(self, id: str, frame: float) -> FramePicks:
        """One pick or hold, which adds its share of the change to each channel.

        Empty for an unknown id, and where the pick asks for nothing.
        """
    @property
    def conversion(self) -> ClipConversion | None:
        """None where the palette is in the clip's own numbers."""

class Slice:
    """The polyhedral palette at one time (eq. 5)."""

    @property
    def frame(self) -> float: ...
    @property
    def section(self) -> int: ...
    @property
    def rgb(self) -> F64:
        """(n, 3) float64 original palette colours."""
    @property
    def faces(self) -> I32:
        """(f, 3) int32, anticlockwise from outside; (0, 3) for one or two colours."""
    @property
    def edges(self) -> I32:
        """(n,) int32 edge of each vertex, -1 when it lies on a polytope vertex."""
    @property
    def ends(self) -> I32:
        """(n, 2) int32 polytope vertices from, to."""
    @property
    def weights(self) -> F64:
        """(n,) float64 weight of `to` (eq. 6)."""

def read_sidecar(path: str | os.PathLike[str]) -> Sidecar: ...
def parse_sidecar(text: str | bytes, name: str = ...) -> Sidecar: ...

LONGEST_NAME: int

def file_safe(name: str | bytes, longest: int = ...) -> str:
    """A name (UTF-8) that is safe in files and in OpenColorIO, of so many bytes at most."""

def clip_name(file_name: str) -> str:
    """A media file's name without extension and frame number: that of its sidecar."""

def decode_sidecar(text: str | bytes, name: str = ...) -> tuple[Sidecar, dict[str, Any]]:
    """As `parse_sidecar`, and the members of the text."""

def encode_sidecar(members: Mapping[str, Any], name: str = ...) -> tuple[Sidecar, bytes]:
    """Return the core's view of members, and their text; SidecarError when they are unusable.

    NumPy's arrays and numbers count as lists and numbers. TypeError for what is no JSON value.
    """

def plain(value: Any, name: str = ...) -> Any:
    """Return a deep copy with dicts, lists, texts and numbers of Python alone; as above."""

def slice_at(polytope: Polytope, frame: float) -> Slice: ...
def edited_colours(polytope: Polytope, edits: Edits, slice: Slice) -> F64:
    """(n, 3) float64 edited colours of the slice's vertices."""

def palette_weights(points: ArrayLike, rgb: ArrayLike, faces: ArrayLike) -> tuple[F64, F64]:
    """(m, 3), (n, 3), (f, 3) -> (m, n) weights of q(p) and (m,) distances |p - q|, 0 inside.

    Points that are not finite give NaN.
    """

def polytope_weights(points: ArrayLike, polytope: Polytope, frame: float) -> F64:
    """Eq. 7: (m, 3) colours at one time -> (m, N) weights of the N polytope vertices."""

class FramePicks:
    """The picks and holds of one frame, for a `Recolourer`.

    A pick is (colour, change, strength, matte): the picked colour there and its whole change, in
    the palette's code values, how much of the change is asked for (above 0, at most 1), and a
    (96, 96, 16) float32 matte, 0 to 1, over two axes of saturation and lightness. `left` is such a
    grid too, of what holds leave of the palette's changes. `display` is (from, to, values): a curve
    from the palette's code values to those of a display, linear between evenly spaced values.
    `windows` has each pick's (left, top, right, bottom) and feather, or None, in pixels of a clip
    of this `size`, width and height.

    ValueError for another shape or a curve without a length.
    """

    def __init__(
        self,
        picks: Sequence[tuple[Sequence[float], Sequence[float], float, F32]],
        *,
        left: F32 | None = ...,
        display: tuple[float, float, Sequence[float]] | None = ...,
        windows: Sequence[tuple[Sequence[float], float, bool] | None] = ...,
        size: Sequence[float] = ...,
    ) -> None: ...
    def with_changes(self, changes: Sequence[Sequence[float]]) -> FramePicks:
        """The same picks with other changes, one for each."""
    @property
    def picks(self) -> list[tuple[list[float], list[float], float, F32]]: ...
    def of_part(self, part: tuple[float, float, float, float]) -> FramePicks:
        """The same picks of a part of the picture: left, top, right and bottom, in pixels."""
    @property
    def windows(self) -> list[tuple[list[float], float, bool] | None]: ...
    @property
    def count(self) -> int: ...
    @property
    def largest(self) -> float:
        """The largest change of a channel that a pick asks for."""
    @property
    def left(self) -> F32 | None: ...

def pick_points(
    colours: ArrayLike, display: tuple[float, float, Sequence[float]] | None = ...
) -> F64:
    """Return (n, 3) palette code values in pick space.

    Its coordinates are two of saturation, and lightness times 0.4.
    """

def hue_matte(picked: Sequence[float]) -> U8:
    """Return the (96, 96, 16) log odds of all colours of a display colour's hue, 0 to 126."""

def learn_matte(
    frames: Sequence[
        tuple[
            F32,
            Sequence[float],
            Sequence[tuple[Sequence[tuple[float, float]], float]],
            Sequence[tuple[Sequence[tuple[float, float]], float]],
            bool,
        ]
    ],
    picked: Sequence[float],
    *,
    holds: Sequence[Sequence[float]] = ...,
    display: tuple[float, float, Sequence[float]] | None = ...,
) -> dict[str, Any]:
    """Learn a pick's matte over colours from frames of its clip.

    A frame is an (h, w, 3) picture in the palette's code values (NaN: no colour), the picked colour
    there, areas of the object and of the background, and whether the object is where its areas are.
    An area is (points, half width), in pixels. The first frame is the one that was clicked on, and
    `picked` the colour there. `holds` are colours to keep.

    Returns odds, (96, 96, 16) uint8 log odds, 0 to 126; found, whether the first frame shows the
    object; and of that: share (of the frame), borders (0 to 4, those that it touches), far (share
    of its colours that are far from the pick). ValueError without frames or pixels, and for areas
    that are not finite.
    """

class Recolourer:
    """One frame's recolouring: p' = p + strength * (h(p) sum_i w_i(q) (v'_i - v_i) + picks at p).

    h is what holds leave, 0 to 1. A pick adds its matte, times the amount of its colour in p, times
    the part of its change that the palette does not do. Of several picks it is the mean of these,
    weighted by the mattes and by how near p is.
    """

    def __init__(
        self,
        original: ArrayLike,
        edited: ArrayLike,
        faces: ArrayLike,
        *,
        picks: FramePicks | None = ...,
    ) -> None: ...
    @property
    def identity(self) -> bool: ...
    def displaced(self, colours: ArrayLike, *, strength: float = ...) -> F64:
        """(n, 3) float64 in and out, in double; colours that are not finite stay."""
    def apply(
        self,
        image: NDArray[np.float32],
        *,
        strength: float = ...,
        premultiplied: bool = ...,
        threads: int = ...,
        out: NDArray[np.float32] | None = ...,
        precision: Literal["single", "double"] = ...,
        instructions: str = ...,
        conversion: ColourConversion | None = ...,
        picture: bool = ...,
    ) -> F32:
        """(h, w, 3 or 4) float32 in and out; threads 0 means one per processor.

        Pixels must be packed within a row, rows may lie anywhere (``image[::-1]``, a crop); `out`
        may be `image` itself. `precision` "single" is what the node and `palette4d render` use:
        some twenty times as fast as "double" (the default) and within 1e-4 of it. `instructions`
        is "best" or one of `instruction_sets`; the result is the same. With a `conversion` the
        image is in the clip's numbers, and the palette in those that it leads to. Windows of picks
        count only where the image is a `picture`: all of the clip's, at any size.
        """

def draw(
    image: NDArray[np.float32],
    output: Literal["recoloured", "weight", "palette", "outside", "pick"],
    map: Recolourer,
    *,
    original: ArrayLike | None = ...,
    edited: ArrayLike | None = ...,
    strength: float = ...,
    keep_lightness: float = ...,
    lightness: Sequence[float] = ...,
    mix: float = ...,
    matte_in_alpha: bool = ...,
    outside_at: float = ...,
    clean_up: float = ...,
    premultiplied: bool = ...,
    threads: int = ...,
    conversion: ColourConversion | None = ...,
    picture: tuple[int, int, int, int] | None = ...,
) -> F32:
    """Return what the node draws for a frame, (h, w, 3 or 4) float32 as the image.

    `map` holds the edit, or for a matte what `weight_reader`, `surface_reader` or
    `Sidecar.pick_matte_at` returns. `clean_up` is the share of the change by picks that is filtered
    along the picture's edges.
    `original` and `edited` are the (n, 3) colours of "palette". `lightness` are three weights.
    """

def scope_counts(
    image: NDArray[np.float32], *, columns: int = ..., zoom: float = ..., threads: int = ...
) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Return what waveform, parade and vectorscope show of display code values, as pixel counts.

    The first result is (columns, 4, 288): of each column the levels of Rec.709 luma, red, green and
    blue. Level `SCOPE_BELOW` is code value 0, a level is 1/255. A picture with fewer pixels in a
    row has fewer columns. The second result is (257, 257): rows are Cr from +0.5 / zoom down,
    columns Cb from -0.5 / zoom on. What is beyond a scope counts at its rim; pixels with a NaN are
    left out.
    """

SCOPE_BELOW: int
"""Levels of `scope_counts` below black; as many are above white."""

def weight_reader(polytope: Polytope, edits: Edits, slice: Slice, id: str) -> F64:
    """(n, 3) float64 edited colours whose Recolourer draws the matte of a vertex or stop."""

def surface_reader(slice: Slice) -> F64:
    """(n, 3) float64 edited colours whose Recolourer draws the matte of "outside"."""

def luminance_weights(encoding: str) -> list[float]:
    """Return the weights of red, green and blue by an encoding's name; Rec.709's if unknown."""

def kernel_text(part: str) -> str:
    """Return a part of the GPU kernel's text, or 'opencl' or 'metal' for all of one's dialect."""

def kernel_table(
    map: Recolourer,
    *,
    output: str = "recoloured",
    strength: float = 1.0,
    keep_lightness: float = 0.0,
    lightness: Sequence[float] = (0, 0, 0),
    mix: float = 1.0,
    matte_in_alpha: bool = False,
    outside_at: float = 0.05,
    premultiplied: bool = False,
    conversion: ColourConversion | None = None,
    clean_up: float = 0.0,
    size: tuple[int, int] = (0, 0),
) -> tuple[F32, F32]:
    """Return what the kernel reads for a frame: the table and the grids, both flat.

    `size` : rows and columns of the picture that is cleaned up. Its first row is its lowest.
    """

def straight_colours(image: NDArray[np.float32], *, premultiplied: bool) -> F32:
    """Return the (h, w, 3) float32 colours of an image (h, w, 3 or 4), not multiplied by alpha.

    Premultiplied colours are divided by alpha, also by a negative or a tiny one. They are NaN where
    alpha is 0 or not finite: recolouring lets such pixels pass. Other colours are copied.
    """

LEAST_ALPHA: float
"""Pixels with less alpha (1/255) are invisible in 8 bits: the analysis leaves them out."""

def instruction_sets() -> list[str]:
    """Return the instruction sets that `Recolourer.apply` can use here, slowest first."""

def return_memory() -> None:
    """Give freed memory back to the system, where the C library keeps it (glibc)."""

class ColourBinner:
    """Gathers a frame's pixels, strip by strip, to a bounded number of colours.

    8-bit samples are told apart exactly; others fall into cells 1/255 wide (wider beyond 0..1),
    which keep their means. What is not finite or has an alpha below 1/255 does not count. A frame's
    samples are of one kind. Methods may be called in any thread, in one at a time.
    """

    def __init__(self) -> None: ...
    def add(self, image: NDArray[Any], *, bits: int = ..., premultiplied: bool = ...) -> None:
        """Add (h, w, 3 or 4) uint8, uint16 or float32 pixels.

        Integers are taken over their largest value; `bits` says how many of a uint16's upper bits
        are in use. `premultiplied` colours are divided by alpha.
        """
    def add_luma_chroma(
        self,
        luma: NDArray[Any],
        blue: NDArray[Any],
        red: NDArray[Any],
        *,
        red_weight: float,
        blue_weight: float,
        bits: int,
        full_range: bool,
    ) -> None:
        """Add (h, w) planes Y', Cb, Cr, uint8 or uint16; the colours are clamped to 0..1."""
    def add_colours(self, rgb: ArrayLike, counts: ArrayLike) -> None:
        """Add (n, 3) colours with (n,) counts."""
    @property
    def pixels(self) -> float:
        """How many pixels count."""
    @property
    def ignored(self) -> float:
        """How many do not."""
    @property
    def transparent(self) -> float:
        """How many of those are ignored for their alpha."""
    def take(
        self, colours: int, coarse: int, scale: float = ...
    ) -> tuple[ColourTree, ColourTree, F64, F64] | None:
        """Return at most so many colours, fewer coarse ones, and their (3,) box, low and high.

        None when no pixel counts. Counts are multiplied by `scale`. The frame is forgotten.
        """
    def clear(self) -> None:
        """Forget the frame."""

class ColourTree:
    """Weighted colours in a k-d tree: what the losses are measured on."""

    def __init__(self, rgb: ArrayLike, counts: ArrayLike) -> None: ...
    @property
    def rgb(self) -> F64:
        """(n, 3) float64 colours, in the tree's order."""
    @property
    def counts(self) -> F64:
        """(n,) float64 pixels of each colour."""
    @property
    def total(self) -> float: ...
    def nearest_mean(self, v: ArrayLike, k: float) -> F64:
        """(m, 3) -> (m, 3) means of the k pixels nearest to each colour (v_N of eq. 3)."""
    def __len__(self) -> int: ...

class LossWeights:
    """What the losses weigh: lambda of eq. 4, k of eq. 3, and how a palette should be shaped.

    `convexity` weighs the concavity of the mesh; colours nearer than `separation` repel each other;
    a pixel that lies `reach` outside counts twice, farther ones still more (0: all as they lie). A
    pixel up to `slight` outside does not count in the share of pixels outside.
    """

    def __init__(
        self,
        lambda_: float,
        k: float,
        convexity: float = ...,
        separation: float = ...,
        reach: float = ...,
        slight: float = ...,
    ) -> None: ...

def palette_loss(
    colours: ColourTree,
    palette: ArrayLike,
    faces: ArrayLike,
    weights: LossWeights,
    gradient: bool = ...,
) -> tuple[float, float, float, float, float, F64]:
    """R (eq. 2), C (eq. 3), shape, share of pixels outside, largest distance, and gradient.

    `palette` is (n, 3); `shape` is what convexity, separation and reach add; the (n, 3) gradient is
    that of lambda R + C + shape, empty without `gradient`.
    """

class PolytopeLoss:
    """Losses of a 4D skew polytope of fixed structure, frame by frame."""

    def __init__(
        self,
        blocks: Sequence[tuple[float, float, Sequence[Sequence[int]], ArrayLike]],
        frames: ArrayLike,
        colours: Sequence[ColourTree],
    ) -> None:
        """Blocks (first, last, tracks, faces), (n,) frame numbers and their n colour trees."""
    def evaluate(
        self,
        vertices: ArrayLike,
        which: Sequence[int],
        weights: LossWeights,
        threads: int,
        gradient: bool,
    ) -> tuple[F64, F64]:
        """Rows R, C, shape, outside, largest distance of each frame; the summed (N, 4) gradient."""

def smoothness(
    vertices: ArrayLike, edges: I32, length: float, weights: ArrayLike
) -> tuple[float, F64]:
    """K of eq. 11 with a weight for each edge, and its (n, 4) gradient; `length` in frames."""

def find_links(
    distance: F64,
    allowed: NDArray[np.bool_],
    near_first: NDArray[np.bool_],
    near_second: NDArray[np.bool_],
    order: Sequence[int],
    *,
    strict: bool,
    bound: float,
    broken_cost: float,
    most_nodes: int,
) -> tuple[list[tuple[int, int]], int, bool]:
    """Shortest links of two palettes of n and m colours, among the allowed pairs (n, m).

    The links (none without a solution), how many edges break topological rule 2, and whether every
    solution was seen.
    """

def progressive_hull(rgb: ArrayLike, faces: ArrayLike, target: int) -> F64:
    """Simplify a closed convex mesh, (n, 3) and (f, 3), to at most `target` enclosing vertices."""

def progressive_hull_4d(
    points: ArrayLike, simplices: ArrayLike, target: int, limits: ArrayLike
) -> F64:
    """Simplify a convex hull in four dimensions to at most `target` enclosing vertices.

    (n, 4) points, (m, 4) facets, (l, 5) limits a, b on new vertices: a . x >= b.
    """
