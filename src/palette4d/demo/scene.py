"""The built-in sample clip's pictures: a lake in the hills, from a summer day to an autumn dusk.

NumPy draws it with the project's own value noise. The same size and time give the same picture on
all machines of one kind. The colours change with the time u in 0..1:

- two kinds of trees share one green and split into yellow and red (u 0.12 to 0.58);
- the meadow turns from green to straw;
- the sky goes from blue through orange and pink to deep blue (u 0.45 to 1);
- the lake is teal by day and merges with the sky's colour at dusk, when it mirrors it;
- lit windows appear (from u 0.62), and the sun leaves (by u 0.74).
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d.common.files import make_folder
from palette4d.media.frame_writer import FramePattern, check_targets, sample_type, write_frame

F32 = NDArray[np.float32]
Real = NDArray[np.floating[Any]]

_SUPERSAMPLING = 2
_SHORE = 0.70  # height of the waterline; 0 is the top of the picture, 1 the bottom

# (time, colour) keys; colours are display-referred R'G'B'.
_ZENITH = (
    (0.00, (0.17, 0.42, 0.84)),
    (0.42, (0.22, 0.44, 0.82)),
    (0.64, (0.30, 0.27, 0.56)),
    (0.80, (0.15, 0.14, 0.40)),
    (1.00, (0.04, 0.06, 0.20)),
)
_MIDDLE = (
    (0.00, (0.45, 0.68, 0.94)),
    (0.42, (0.58, 0.70, 0.90)),
    (0.64, (0.89, 0.48, 0.48)),
    (0.80, (0.52, 0.28, 0.48)),
    (1.00, (0.09, 0.12, 0.31)),
)
_HORIZON = (
    (0.00, (0.80, 0.90, 0.97)),
    (0.42, (0.95, 0.89, 0.78)),
    (0.64, (1.00, 0.66, 0.30)),
    (0.80, (0.88, 0.42, 0.30)),
    (1.00, (0.19, 0.22, 0.44)),
)
_LIGHT = (
    (0.00, (0.72, 0.72, 0.70)),
    (0.42, (0.74, 0.69, 0.60)),
    (0.64, (0.62, 0.42, 0.26)),
    (0.78, (0.14, 0.10, 0.12)),
    (1.00, (0.02, 0.03, 0.06)),
)
_AMBIENT = (
    (0.00, (0.44, 0.48, 0.54)),
    (0.42, (0.44, 0.45, 0.48)),
    (0.64, (0.38, 0.31, 0.36)),
    (0.78, (0.28, 0.23, 0.34)),
    (1.00, (0.13, 0.16, 0.28)),
)
_SUN = ((0.0, (1.0, 0.98, 0.90)), (0.42, (1.0, 0.94, 0.74)), (0.70, (1.0, 0.62, 0.28)))
_CLOUD = (
    (0.00, (0.98, 0.99, 1.00)),
    (0.42, (1.00, 0.95, 0.90)),
    (0.64, (1.00, 0.62, 0.50)),
    (0.80, (0.72, 0.36, 0.46)),
    (1.00, (0.14, 0.16, 0.34)),
)
_WATER = ((0.0, (0.08, 0.42, 0.46)), (0.5, (0.12, 0.38, 0.44)), (1.0, (0.05, 0.10, 0.24)))
_GRASS = ((0.10, (0.40, 0.62, 0.20)), (0.55, (0.80, 0.66, 0.32)))
_LEAVES = {
    "birch": ((0.12, (0.24, 0.50, 0.15)), (0.36, (0.66, 0.62, 0.16)), (0.58, (1.00, 0.80, 0.14))),
    "maple": ((0.12, (0.24, 0.50, 0.15)), (0.36, (0.58, 0.36, 0.13)), (0.58, (0.90, 0.17, 0.11))),
    "pine": ((0.0, (0.10, 0.27, 0.19)), (1.0, (0.10, 0.25, 0.19))),
}
_LAMP = np.array((1.0, 0.82, 0.38), np.float32)


def value_noise(x: Real, y: Real, seed: int) -> F32:
    """Smooth noise in 0..1 with one random value per corner of a unit square; x, y broadcast."""
    left, top = np.floor(x), np.floor(y)
    first_column, first_row = int(left.min()), int(top.min())
    columns = np.arange(first_column, int(left.max()) + 2, dtype=np.int64)
    rows = np.arange(first_row, int(top.max()) + 2, dtype=np.int64)
    lattice = _random(columns, rows[:, None], seed).ravel()
    corner = (top.astype(np.int32) - first_row) * len(columns) + (
        left.astype(np.int32) - first_column
    )
    right, down = x - left, y - top
    right, down = right * right * (3 - 2 * right), down * down * (3 - 2 * down)
    upper_left, lower_left = lattice[corner], lattice[corner + len(columns)]
    upper = upper_left + (lattice[corner + 1] - upper_left) * right
    lower = lower_left + (lattice[corner + len(columns) + 1] - lower_left) * right
    return np.asarray(upper + (lower - upper) * down, np.float32)


def fractal_noise(x: Real, y: Real, seed: int, octaves: int = 4) -> F32:
    """Sum of value noises, each twice as fine and half as strong, in 0..1."""
    total = np.zeros(np.broadcast_shapes(x.shape, y.shape), np.float32)
    weight, scale, weights = 0.5, 1.0, 0.0
    for octave in range(octaves):
        scaled = np.float32(scale)
        total += np.float32(weight) * value_noise(x * scaled, y * scaled, seed + 101 * octave)
        weights += weight
        weight, scale = weight / 2, scale * 2
    return np.asarray(total / np.float32(weights), np.float32)


def _random(column: NDArray[np.int64], row: NDArray[np.int64], seed: int) -> F32:
    """One number in 0..1 for each lattice point, from an integer hash."""
    mixed = (column * 374761393 + row * 668265263 + seed * 974634777) & 0xFFFFFFFF
    mixed = ((mixed ^ (mixed >> 15)) * 2246822519) & 0xFFFFFFFF
    mixed = ((mixed ^ (mixed >> 13)) * 3266489917) & 0xFFFFFFFF
    bits = (mixed ^ (mixed >> 16)) & 0xFFFFFF
    return np.asarray(bits.astype(np.float32) / np.float32(0xFFFFFF), np.float32)


def keyed(keys: tuple[tuple[float, tuple[float, float, float]], ...], time: float) -> F32:
    """(3,) colour between keys, eased at both ends of each interval."""
    times = [key[0] for key in keys]
    colours = np.array([key[1] for key in keys], np.float32)
    if time <= times[0]:
        return np.asarray(colours[0])
    for index in range(1, len(keys)):
        if time < times[index]:
            part = _step(times[index - 1], times[index], time)
            return np.asarray(colours[index - 1] * (1 - part) + colours[index] * part, np.float32)
    return np.asarray(colours[-1])


def _step(low: float, high: float, value: ArrayLike) -> F32:
    """0 below low, 1 above high, eased between."""
    part = np.clip((np.asarray(value, np.float32) - low) / (high - low), 0, 1)
    return np.asarray(part * part * (3 - 2 * part), np.float32)


def _over(picture: F32, colour: F32, cover: F32) -> None:
    """Lay a colour over a picture in place where cover (h, w) is above 0."""
    picture += cover[..., None] * (colour - picture)


@dataclass(frozen=True)
class _Tree:
    x: float
    base: float
    height: float
    kind: str


_TREES = (
    _Tree(0.955, 0.560, 0.20, "pine"),
    _Tree(1.03, 0.545, 0.25, "pine"),
    _Tree(1.62, 0.520, 0.24, "pine"),
    _Tree(1.735, 0.545, 0.20, "pine"),
    _Tree(1.10, 0.565, 0.25, "maple"),
    _Tree(1.52, 0.550, 0.27, "birch"),
    _Tree(1.66, 0.585, 0.25, "maple"),
    _Tree(0.93, 0.635, 0.22, "birch"),
    _Tree(1.045, 0.650, 0.27, "maple"),
    _Tree(1.175, 0.650, 0.24, "birch"),
    _Tree(1.60, 0.660, 0.30, "birch"),
    _Tree(1.73, 0.675, 0.31, "maple"),
    _Tree(0.10, 0.685, 0.33, "maple"),
    _Tree(0.235, 0.690, 0.26, "birch"),
    _Tree(-0.02, 0.690, 0.24, "birch"),
    _Tree(0.335, 0.695, 0.17, "maple"),
)


class Scene:
    """The landscape at one size; `picture(u)` draws it at a time u in 0..1."""

    def __init__(self, width: int, height: int) -> None:
        """Prepare the parts that do not change with time, for width x height pixels."""
        self.width, self.height = width, height
        rows, columns = height * _SUPERSAMPLING, width * _SUPERSAMPLING
        # x always ends at 16/9, so that every size shows the whole scene.
        x = (np.arange(columns, dtype=np.float32) + 0.5) / np.float32(columns) * np.float32(16 / 9)
        y = (np.arange(rows, dtype=np.float32) + 0.5) / np.float32(rows)
        self._x, self._y = (
            np.broadcast_to(x, (rows, columns)),
            np.broadcast_to(y[:, None], (rows, columns)),
        )
        line = x[None, :]
        none = np.zeros_like(line)
        self._far = 0.56 - 0.36 * fractal_noise(line * 2.1 + 3.7, none, 11, 6)
        self._near = 0.65 - 0.20 * fractal_noise(line * 2.9 + 9.1, none, 23, 6)
        bump = np.exp(-(((line - 1.45) / 0.52) ** 2))
        self._hill = 0.705 - 0.165 * bump - 0.02 * fractal_noise(line * 6, none, 31, 4)
        left = np.exp(-(((line - 0.0) / 0.36) ** 2))
        self._meadow = 0.712 - 0.05 * left - 0.008 * fractal_noise(line * 9, none, 37, 3)
        self._bank = (
            1.03
            - 0.12 * np.exp(-(((line - 0.12) / 0.42) ** 2))
            - 0.035 * (fractal_noise(line * 30, none, 43, 3))
        )
        self._cloud_x, self._cloud_y = self._x * 1.5, self._y * 5.2
        self._rock = fractal_noise(self._x * 16, self._y * 30, 53, 4)
        self._turf = fractal_noise(self._x * 42, self._y * 95, 59, 3)
        self._leaf = fractal_noise(self._x * 62, self._y * 62, 61, 3)
        self._grain = value_noise(self._x * 320, self._y * 320, 67) - np.float32(0.5)
        self._trees = [self._tree(tree, index) for index, tree in enumerate(_TREES)]

    def picture(self, u: float) -> F32:
        """(h, w, 3) float32 display-referred R'G'B' in 0..1 at a time from 0 (day) to 1 (night)."""
        picture = self._sky(u)
        self._land(picture, u)
        self._house(picture, u)
        for tree, (window, cover, shade) in zip(_TREES, self._trees, strict=True):
            self._paint_tree(picture[window], tree, cover, shade, u)
        self._lake(picture, u)
        self._foreground(picture, u)
        picture += 0.010 * self._grain[..., None]
        height, width = self.height, self.width
        fine = picture.reshape(height, _SUPERSAMPLING, width, _SUPERSAMPLING, 3)
        return np.asarray(np.clip(fine.mean(axis=(1, 3)), 0, 1), np.float32)

    def _lit(self, colour: F32, shade: Real, u: float) -> F32:
        """A matt surface of a colour: ambient light, and sunlight scaled by shade (h, w)."""
        return np.asarray(
            colour * (keyed(_AMBIENT, u) + keyed(_LIGHT, u) * shade[..., None]), np.float32
        )

    def _sky(self, u: float) -> F32:
        down = np.clip(self._y / 0.60, 0, 1)[..., None]
        zenith, middle, horizon = keyed(_ZENITH, u), keyed(_MIDDLE, u), keyed(_HORIZON, u)
        upper, lower = _step(0.0, 0.62, down), _step(0.45, 1.0, down)
        sky = (zenith * (1 - upper) + middle * upper) * (1 - lower) + horizon * lower

        # Stars are at the rare peaks of the noise.
        night = float(_step(0.86, 1.0, u))
        if night > 0:
            cell = _random(
                np.floor(self._x * 70).astype(np.int64), np.floor(self._y * 70).astype(np.int64), 71
            )
            place = (self._x * 70 % 1 - 0.5) ** 2 + (self._y * 70 % 1 - 0.5) ** 2
            stars = (cell > 0.985) * np.exp(-place * 45) * _step(0.5, 0.2, 0) * night
            sky = sky + stars[..., None] * 0.8

        sun_x, sun_y = 0.74 - 0.06 * u, 0.08 + 0.41 * u
        away = np.hypot(self._x - sun_x, self._y - sun_y)
        colour, up = keyed(_SUN, u), float(1 - _step(0.70, 0.84, u))
        glow = up * (0.34 * np.exp(-away / 0.10) + 0.26 * np.exp(-away / 0.34) * min(1.0, 2 * u))
        sky = sky + glow[..., None] * (colour - 0.25 * sky)

        drift = np.float32(0.55 * u)
        cloud = fractal_noise(self._cloud_x + drift, self._cloud_y, 83, 5)
        cover = _step(0.47, 0.76, cloud) * _step(0.60, 0.34, self._y) * np.float32(0.85)
        lit = keyed(_CLOUD, u) * (0.80 + 0.20 * _step(0.9, 0.55, cloud))[..., None]
        sky = sky + cover[..., None] * (lit - sky)

        disc = _step(0.036, 0.032, away) * up
        sky += disc[..., None] * (np.minimum(colour * 1.06, 1) - sky)
        return np.asarray(sky, np.float32)

    def _land(self, picture: F32, u: float) -> None:
        haze = keyed(_HORIZON, u) * 0.55 + keyed(_MIDDLE, u) * 0.45
        edge = 1.5 / self._y.shape[0]
        for ridge, rock, veil, low in (
            (self._far, (0.34, 0.40, 0.52), 0.52, 0.20),
            (self._near, (0.22, 0.36, 0.36), 0.26, 0.24),
        ):
            below = self._y - ridge
            shade = 0.25 + 0.6 * self._rock - 0.6 * np.clip(below, 0, 0.3)
            stone = self._lit(np.array(rock, np.float32), shade, u)
            mist = veil + low * _step(0.0, 0.2, below)
            stone = stone * (1 - mist[..., None]) + haze * mist[..., None]
            _over(picture, stone, _step(-edge, edge, below))
        grass = keyed(_GRASS, u)
        for ridge in (self._hill, self._meadow):
            below = self._y - ridge
            shade = 0.30 + 0.62 * self._turf + 0.25 * _step(0.10, 0.0, below)
            _over(picture, self._lit(grass, shade, u), _step(-edge, edge, below))
        # A strip of sand and stones along the water.
        strip = _step(_SHORE - 0.016, _SHORE - 0.004, self._y + 0.012 * (self._turf - 0.5))
        sand = self._lit(np.array((0.62, 0.56, 0.46), np.float32), 0.2 + 0.6 * self._turf, u)
        _over(picture, sand, strip)

    def _house(self, picture: F32, u: float) -> None:
        x, y, edge = self._x, self._y, 1.2 / self._y.shape[0]

        def box(left: float, right: float, top: float, bottom: float) -> F32:
            inside = np.minimum(np.minimum(x - left, right - x), np.minimum(y - top, bottom - y))
            return _step(-edge, edge, inside)

        wood = (0.86 + 0.14 * _step(0.35, 0.65, (y * 90) % 1)) * (0.9 + 0.2 * self._turf)
        red = np.array((0.78, 0.15, 0.12), np.float32)
        white = np.array((0.96, 0.95, 0.92), np.float32)
        slate = np.array((0.32, 0.31, 0.36), np.float32)
        front, side = (1.275, 1.375), (1.375, 1.485)
        top, bottom, peak = 0.545, 0.636, 0.478
        # Side wall in the sun, front wall with the gable in half shade.
        _over(picture, self._lit(red, 0.95 * wood, u), box(*side, top, bottom))
        _over(picture, self._lit(red, 0.45 * wood, u), box(*front, top, bottom))
        middle, half = sum(front) / 2, (front[1] - front[0]) / 2
        slope = peak + (top - peak) * np.abs(x - middle) / half
        gable = _step(-edge, edge, np.minimum(y - slope, top + 0.001 - y))
        _over(picture, self._lit(red, 0.45 * wood, u), gable)
        roof_left = middle + (y - peak) * half / (top - peak)
        roof_right = roof_left + (side[1] - front[1]) + 0.012
        roof = np.minimum(
            np.minimum(x - roof_left, roof_right - x), np.minimum(y - peak, 0.553 - y)
        )
        _over(picture, self._lit(slate, 0.75 * wood, u), _step(-edge, edge, roof))
        # The roof's edge on the gable's other side, and a chimney.
        rim = _step(0.009, 0.006, np.abs(y - slope)) * box(
            front[0] - 0.008, middle, peak - 0.01, 0.556
        )
        _over(picture, self._lit(white, np.full_like(y, 0.5), u), rim)
        chimney = box(1.415, 1.435, 0.462, 0.500)
        _over(picture, self._lit(slate * 0.9, 0.8 * wood, u), chimney)

        glow = float(_step(0.62, 0.72, u))
        glass = self._lit(np.array((0.30, 0.36, 0.42), np.float32), np.full_like(y, 0.6), u)
        pane = glass * (1 - glow) + _LAMP * glow
        windows = np.zeros_like(y)
        for left in (1.292, 1.335, 1.393, 1.440):
            frame = box(left - 0.004, left + 0.028, 0.566, 0.606)
            _over(picture, self._lit(white, np.full_like(y, 0.6), u), frame)
            window = box(left, left + 0.024, 0.570, 0.602)
            cross = _step(0.0022, 0.0012, np.abs(x - left - 0.012))
            windows = np.maximum(windows, window * (1 - 0.6 * cross))
        round_one = _step(0.0125 + edge, 0.0125 - edge, np.hypot(x - middle, y - 0.522))
        windows = np.maximum(windows, round_one)
        _over(picture, pane, windows)
        if glow > 0:  # light on the air and the grass around
            halo = np.exp(-np.hypot((x - 1.38) / 0.16, (y - 0.60) / 0.075))
            picture += (0.30 * glow * halo)[..., None] * _LAMP * (1 - picture)

    def _tree(self, tree: _Tree, index: int) -> tuple[tuple[slice, slice], F32, F32]:
        """(window, cover, shade) of a crown: its place in the picture, and its lighting."""
        rows, columns = self._y.shape
        wide = 0.40 if tree.kind == "pine" else 0.62
        box = (tree.x - wide * tree.height, tree.x + wide * tree.height)
        left, right = (int(np.clip(edge * 9 / 16, 0, 1) * columns) for edge in box)
        top = int(np.clip(tree.base - 1.08 * tree.height, 0, 1) * rows)
        bottom = int(np.clip(tree.base + 0.01, 0, 1) * rows)
        window = (slice(top, max(bottom, top + 1)), slice(left, max(right, left + 1)))
        # Seen from the foot of the tree, in units of its height.
        x = (self._x[window] - tree.x) / tree.height
        y = (tree.base - self._y[window]) / tree.height
        leaf = self._leaf[window]
        rough = fractal_noise(x * 7 + 13 * index, y * 7, 89 + index, 3) - np.float32(0.5)
        if tree.kind == "pine":
            tier = (y * 5.5) % 1
            reach = 0.30 * (1 - y) * (0.72 + 0.28 * (1 - tier)) + 0.10 * rough * (1 - y)
            cover = _step(-0.012, 0.012, np.minimum(reach - np.abs(x), y - 0.06))
            shade = 0.40 + 1.2 * x + 0.5 * (leaf - 0.5) - 0.25 * tier
            return window, cover, np.asarray(np.clip(shade, 0, 1.2), np.float32)
        cover = np.zeros_like(x)
        shade = np.zeros_like(x)
        blobs: tuple[tuple[float, float, float], ...] = (
            (0.0, 0.53, 0.27),
            (-0.20, 0.42, 0.20),
            (0.20, 0.40, 0.20),
            (0.0, 0.48, 0.24),
            (-0.13, 0.64, 0.19),
            (0.15, 0.62, 0.20),
            (0.01, 0.79, 0.17),
        )
        if tree.kind == "birch":
            blobs = tuple((0.72 * a, 0.06 + 0.98 * b, 0.88 * r) for a, b, r in blobs)
        for number, (across, up, radius) in enumerate(blobs):
            sway = 0.05 * float(_random(np.array([number]), np.array([index]), 97)[0] - 0.5)
            dx, dy = (x - across - sway) / radius, (y - up) / radius
            inside = 1 + 0.55 * rough - np.hypot(dx, dy)
            ball = _step(-0.06, 0.06, inside)
            # One light serves for the high sun on the right by day and for the low sun at dusk.
            light = 0.46 + 0.26 * dx + 0.34 * dy + 0.75 * (leaf - 0.5)
            shade = shade * (1 - ball) + light * ball
            cover = np.maximum(cover, ball)
        trunk = _step(0.034, 0.022, np.abs(x)) * _step(0.0, 0.02, y) * _step(0.36, 0.30, y)
        shade = np.where(cover >= trunk, np.clip(shade, 0.0, 1.2), -1.0)  # -1 marks the trunk
        return window, np.maximum(cover, trunk), np.asarray(shade, np.float32)

    def _paint_tree(self, picture: F32, tree: _Tree, cover: F32, shade: F32, u: float) -> None:
        leaves = self._lit(keyed(_LEAVES[tree.kind], u), shade, u)
        bark = (0.80, 0.78, 0.72) if tree.kind == "birch" else (0.34, 0.25, 0.20)
        trunk = self._lit(np.array(bark, np.float32), np.full_like(shade, 0.3), u)
        _over(picture, np.where(shade[..., None] < 0, trunk, leaves), cover)

    def _lake(self, picture: F32, u: float) -> None:
        rows, columns = picture.shape[:2]
        first = int(_SHORE * rows)
        x, y = self._x[first:], self._y[first:]
        depth = (y - _SHORE) / (1 - _SHORE)
        # Ripples are wide near the viewer and narrow far away, and wander with time.
        ripple_x, ripple_y = x * 9, 26 / (depth + 0.16)
        ripple = fractal_noise(ripple_x, ripple_y + np.float32(5 * u), 103, 3) - np.float32(0.5)
        sway = fractal_noise(x * 40, y * 180 + np.float32(9 * u), 107, 2) - np.float32(0.5)
        up = _SHORE - 0.006 - 0.92 * (y - _SHORE) + 0.05 * ripple * (0.3 + depth)
        across = x + 0.030 * sway * (0.2 + depth)
        row = np.clip((up * rows).astype(np.int64), 0, first - 1)
        column = np.clip((across * (9 / 16) * columns).astype(np.int64), 0, columns - 1)
        mirrored = picture[row, column]
        water = keyed(_WATER, u) * (0.88 + 0.5 * ripple)[..., None]
        strength = 0.26 + 0.62 * float(_step(0.40, 0.66, u))
        mirror = np.clip(strength + 0.10 * (1 - depth), 0, 0.92)[..., None]
        lake = water * (1 - mirror) + mirrored * mirror
        sparkle = _step(0.20, 0.34, ripple) * (0.10 + 0.08 * (1 - depth))
        lake = lake + sparkle[..., None] * (keyed(_HORIZON, u) - lake)
        picture[first:] = lake

    def _foreground(self, picture: F32, u: float) -> None:
        edge = 1.5 / self._y.shape[0]
        below = self._y - self._bank
        shade = 0.10 + 0.75 * self._turf + 0.2 * _step(0.06, 0.0, below)
        _over(picture, self._lit(keyed(_GRASS, u) * 0.85, shade, u), _step(-edge, edge, below))


def sample_clip(
    output: str | os.PathLike[str],
    *,
    frames: int = 48,
    size: tuple[int, int] = (320, 180),
    first: int = 1,
    half: bool = False,
    force: bool = False,
    progress: Callable[[int, int], object] | None = None,
) -> list[Path]:
    """Draw the scene from day to night and write it, 24 frames a second.

    Parameters
    ----------
    output : str or path
        `OUT.####.png`, `.tif` (16 bits) or `.exr` (32-bit float, or `half`).
    frames : int
        Number of frames; a single frame shows the middle of the time-lapse.
    size : (int, int)
        Width and height in pixels.
    first : int
        Number of the first frame.
    force : bool
        Replace files that exist.
    progress : callable, optional
        Called with (frames written, frames in all).

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    Palette4dError
        The output cannot be written.
    """
    import OpenImageIO as oiio

    pattern = FramePattern.parse(os.fspath(output))
    samples = sample_type(pattern.extension, "uint16", half=half)
    files = pattern.paths(range(first, first + frames))
    check_targets(files, force=force)
    make_folder(pattern.folder)
    metadata = [
        ("oiio:ColorSpace", oiio.TypeDesc("string"), "srgb_rec709_scene"),
        ("FramesPerSecond", oiio.TypeDesc("rational"), (24, 1)),
    ]
    scene = Scene(*size)
    for index, path in enumerate(files):
        time = index / (frames - 1) if frames > 1 else 0.5
        write_frame(path, scene.picture(time), samples, metadata=metadata)
        if progress is not None:
            progress(index + 1, frames)
    return files
