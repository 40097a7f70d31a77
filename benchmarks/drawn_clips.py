"""Clips drawn with numpy: what palettes find hard, without a file.

Each function returns (frames, height, width, 3) float32 code values, rounded to 8 bits.
"""

from __future__ import annotations

import colorsys
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
HEIGHT, WIDTH = 108, 192
ROWS, COLUMNS = np.mgrid[0:HEIGHT, 0:WIDTH] / HEIGHT
DOWN, ACROSS = ROWS[..., None], COLUMNS[..., None]


def _hue(h: float, s: float = 0.9, v: float = 0.95) -> F64:
    return np.array(colorsys.hsv_to_rgb(h % 1, s, v))


def _disc(x: float, y: float, radius: float, soft: float = 0.3) -> F64:
    distance = np.hypot(COLUMNS - x, ROWS - y)
    return np.clip((radius - distance) / (soft * radius), 0, 1)[..., None]


def _landscape() -> F64:
    sky = (1 - DOWN) * [0.25, 0.45, 0.8] + DOWN * [0.8, 0.75, 0.7]
    ground = (1 - ACROSS / 1.8) * [0.2, 0.4, 0.12] + ACROSS / 1.8 * [0.5, 0.42, 0.2]
    hills = 0.55 + 0.08 * np.sin(12 * ACROSS + 2)
    ridge = np.clip((DOWN - hills) * 20, 0, 1)
    out = (1 - ridge) * sky + ridge * ground * (0.6 + 0.5 * DOWN)
    house = (ACROSS > 1.1) & (ACROSS < 1.4) & (DOWN > 0.52) & (DOWN < 0.75)
    return np.where(house, [0.55, 0.18, 0.14] * (1.1 - 0.4 * DOWN), out)


def _mix(a: F64, b: object, share: F64 | float) -> F64:
    return (1 - share) * a + share * np.asarray(b)


def fountain(t: float) -> F64:
    """A fountain at night in light that changes its colour; lamps, and their light on water."""
    night = _mix(np.array([0.02, 0.02, 0.05]), [0.05, 0.05, 0.1], DOWN)
    trees = np.clip((0.35 + 0.06 * np.sin(17 * ACROSS) - DOWN) * 8, 0, 1) * (DOWN > 0.15)
    night = _mix(night, [0.05, 0.11, 0.04], 0.8 * trees)
    spread = np.abs(ACROSS - 0.9) / (0.08 + 0.35 * DOWN**2)
    spray = np.clip(1.2 - spread, 0, 1) * np.clip((DOWN - 0.15) * 4, 0, 1) * (DOWN < 0.78)
    spray = spray * (0.75 + 0.25 * np.sin(40 * ACROSS + 30 * DOWN - 50 * t))
    light = _hue(0.6 - 0.75 * t, 0.75 + 0.2 * np.cos(9 * t))
    water = (DOWN > 0.78) * np.clip(1.1 - np.abs(ACROSS - 0.9), 0, 1)
    ripples = 0.5 + 0.5 * np.sin(60 * DOWN + 9 * np.sin(8 * ACROSS + 20 * t))
    night = _mix(night, 0.6 * light, 0.7 * water * ripples)
    night = _mix(night, _mix(light, [1, 1, 1], 0.5 * spray**3), spray)
    lamps = _disc(0.25, 0.5, 0.05) + _disc(1.55, 0.48, 0.05)
    return _mix(night, [1.0, 0.85, 0.55], np.clip(lamps, 0, 1))


def flashes(t: float) -> F64:
    """A landscape; lightning for two frames, and once for one."""
    out = 0.6 * _landscape()
    lit = any(abs(t - at) < width for at, width in ((0.3, 0.02), (0.7, 0.03)))
    return _mix(out, [0.93, 0.95, 1.0], 0.75) if lit else out


def fades(t: float) -> F64:
    """A landscape that fades in from black and out to white."""
    out = _landscape() * min(1.0, 4 * t)
    return _mix(out, [1, 1, 1], float(np.clip(4 * t - 3, 0, 1)))


def dusk(t: float) -> F64:
    """A landscape from noon to night: windows light up."""
    tint = _mix(np.array([1.0, 1.0, 1.0]), [1.05, 0.55, 0.35], np.sin(np.pi * t) ** 2)
    out = _landscape() * tint * (1 - 0.8 * t**2)
    windows = (np.abs(ACROSS - 1.25) < 0.08) & (np.abs(DOWN - 0.62) < 0.04)
    return np.where(windows & (t > 0.6), [1.0, 0.8, 0.35], out)


def stage(t: float) -> F64:
    """A grey stage; a red spot comes and goes, then a blue one, for a time both."""
    out = _mix(np.array([0.06, 0.06, 0.07]), [0.35, 0.34, 0.33], DOWN) * (1 + 0.1 * ACROSS)
    for x, colour, peak in ((0.6, [0.95, 0.1, 0.08], 0.3), (1.2, [0.1, 0.2, 0.98], 0.65)):
        strength = np.clip(1.6 - 5 * abs(t - peak), 0, 1)
        out = _mix(out, colour, 0.9 * strength * _disc(x, 0.6, 0.32, 0.8))
    return out


def splits(t: float) -> F64:
    """Two cards of one colour drift apart in hue and come together again, before grey."""
    apart = np.sin(np.pi * t) ** 2
    out = np.broadcast_to(0.15 + 0.6 * DOWN * np.ones(3), (HEIGHT, WIDTH, 3)).copy()
    left = (np.abs(ACROSS - 0.5) < 0.25) & (np.abs(DOWN - 0.5) < 0.3)
    right = (np.abs(ACROSS - 1.3) < 0.25) & (np.abs(DOWN - 0.5) < 0.3)
    out = np.where(left, _hue(0.12 - 0.12 * apart, 0.8, 0.9), out)
    return np.where(right, _hue(0.12 + 0.3 * apart, 0.8, 0.9), out)


def wheel(t: float) -> F64:
    """A wheel of all hues that turns and loses its colour: much moves, little is worth a handle."""
    angle = np.arctan2(ROWS - 0.5, COLUMNS - 0.9) / (2 * np.pi) + t
    rgb = np.stack([np.clip(np.abs((angle * 6 + s) % 6 - 3) - 1, 0, 1) for s in (0, 4, 2)], axis=-1)
    grey = rgb.mean(axis=2, keepdims=True)
    return _mix(np.array([0.5, 0.48, 0.45]), _mix(rgb, grey, 0.8 * t), _disc(0.9, 0.5, 0.4, 0.1))


def signs(t: float) -> F64:
    """A street at night: neon signs go on and off, each with a colour of its own."""
    out = _mix(np.array([0.03, 0.03, 0.06]), [0.16, 0.14, 0.14], DOWN * (0.5 + 0.3 * ACROSS))
    for i in range(5):
        on = (3 * t + 0.37 * i) % 1 < 0.55
        inside = (np.abs(ACROSS - 0.2 - 0.34 * i) < 0.11) & (np.abs(DOWN - 0.3 - 0.08 * i) < 0.07)
        out = np.where(inside & on, _hue(0.21 * i + 0.02, 0.85), out)
    return out


SCENES: dict[str, tuple[Callable[[float], F64], int]] = {
    "fountain": (fountain, 42),
    "flashes": (flashes, 40),
    "fades": (fades, 40),
    "dusk": (dusk, 48),
    "stage": (stage, 40),
    "splits": (splits, 36),
    "wheel": (wheel, 30),
    "signs": (signs, 40),
}


def drawn(name: str, noise: float = 2.0) -> NDArray[np.float32]:
    """Draw a clip; `noise` is the deviation of its grain, in steps of 8 bits."""
    scene, count = SCENES[name]
    generator = np.random.default_rng(1)
    frames = np.stack([scene(t) for t in np.linspace(0, 1, count)])
    frames += noise / 255 * generator.standard_normal(frames.shape)
    return (np.rint(np.clip(frames, 0, 1) * 255) / 255).astype(np.float32)


def pan(still: NDArray[np.float64], count: int = 36) -> NDArray[np.float32]:
    """Move a window over a still, (h, w, 3) of 0 to 1: the way from one corner to the other."""
    high, wide = still.shape[0] // 2, still.shape[1] // 2
    starts = np.linspace((0, 0), (still.shape[0] - high, still.shape[1] - wide), count).astype(int)
    return np.stack([still[r : r + high : 2, c : c + wide : 2] for r, c in starts]).astype(
        np.float32
    )
