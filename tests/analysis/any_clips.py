"""Small rendered clips of every kind that users bring, written as real files.

Each function takes a folder and returns what `palette4d analyze` is given: a pattern or a movie.
The picture is a landscape under a sun that crosses the sky, in colours as a display shows them;
`LIGHT` turns them into scene-linear light.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from av.video.reformatter import ColorRange, Colorspace
from clip_files import write_image, write_movie
from numpy.typing import NDArray

F64 = NDArray[np.float64]

HEIGHT, WIDTH, FRAMES = 64, 96, 10
ROWS, COLUMNS = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
RED_LIGHT = np.array([0.95, 0.04, 0.06])

PQ, BT2020 = 16, 9  # H.273: transfer characteristics, primaries


def landscape(t: float, times_as_large: int = 1) -> F64:
    """(h, w, 3) display colours of the landscape at time `t` from 0 to 1."""
    large = np.mgrid[0 : HEIGHT * times_as_large, 0 : WIDTH * times_as_large]
    rows, columns = large / times_as_large
    down, across = (rows / HEIGHT)[..., None], (columns / WIDTH)[..., None]
    sky = (1 - down) * [0.25, 0.45, 0.8] + down * [0.8, 0.75, 0.7]
    ground = (1 - across) * [0.2, 0.4, 0.12] + across * [0.5, 0.42, 0.2]
    hills = 0.55 + 0.08 * np.sin(columns / 9 + 2)
    ridge = np.clip((rows / HEIGHT - hills) * 20, 0, 1)[..., None]
    out = (1 - ridge) * sky + ridge * ground * (0.6 + 0.5 * down)
    glow = sun(t, times_as_large)
    out = (1 - glow) * out + glow * [0.98, 0.85, 0.35]
    house = ((columns > 60) & (columns < 78) & (rows > 34) & (rows < 50))[..., None]
    return np.where(house, [0.55, 0.18, 0.14] * (1.1 - 0.4 * down), out) * (1 - 0.15 * t)


def sun(t: float, times_as_large: int = 1) -> F64:
    """(h, w, 1) share of the sun in each pixel: 1 inside of its disc, 0 outside."""
    large = np.mgrid[0 : HEIGHT * times_as_large, 0 : WIDTH * times_as_large]
    rows, columns = large / times_as_large
    distance = np.hypot(columns - (20 + 55 * t), rows - (24 - 30 * t * (1 - t)))
    return np.clip((9 - distance) / 3, 0, 1)[..., None]


def harbour(t: float) -> F64:
    """(h, w, 3) display colours of another picture: a harbour at night."""
    down = (ROWS / HEIGHT)[..., None]
    sky = (1 - down) * [0.03, 0.04, 0.12] + down * [0.12, 0.1, 0.25]
    waves = 0.5 + 0.5 * np.sin(COLUMNS / 4 + 6 * t) * np.sin(ROWS / 2)
    water = [0.04, 0.14, 0.2] + waves[..., None] * [0.02, 0.2, 0.22]
    out = np.where(down < 0.5, sky, water)
    lamps = np.hypot(COLUMNS % 24 - 12, ROWS - 30)
    lit = np.clip((5 - lamps) / 4, 0, 1)[..., None]
    return (1 - lit) * out + lit * [0.95, 0.6, 0.2]


def times(count: int = FRAMES) -> F64:
    """Times 0 to 1 of so many frames."""
    return np.linspace(0, 1, count)


def frames(count: int = FRAMES, times_as_large: int = 1) -> list[F64]:
    """The landscape, as the clip that the others are compared with."""
    return [landscape(t, times_as_large) for t in times(count)]


def linear(colours: F64) -> F64:
    """Scene-linear light of display colours (a pure power)."""
    return np.maximum(colours, 0) ** 2.2


def png(folder: Path, pictures: Iterable[F64], first: int = 1) -> str:
    """Write 8-bit PNG files; return their pattern."""
    return _sequence(folder, pictures, "png", np.uint8, first)


def _sequence(
    folder: Path, pictures: Iterable[F64], ending: str, kind: type, first: int = 1
) -> str:
    for i, picture in enumerate(pictures, start=first):
        stored = picture
        if np.issubdtype(kind, np.integer):
            stored = np.rint(np.clip(picture, 0, 1) * np.iinfo(kind).max)
        write_image(folder / f"clip.{i:04d}.{ending}", stored.astype(kind))
    return str(folder / f"clip.####.{ending}")


def clean(folder: Path) -> str:
    """The landscape alone."""
    return png(folder, frames())


def cut(folder: Path) -> str:
    """Six frames of the landscape, then six of the harbour: frame 7 begins a shot."""
    return png(folder, [*frames(6), *(harbour(t) for t in times(6))])


def cut_of_two(folder: Path) -> str:
    """Landscape, three frames of harbour, snow: frames 5 and 8 begin shots."""
    snow = [0.7 + 0.25 * landscape(t).mean(axis=2, keepdims=True) * [1, 1, 1.1] for t in times(4)]
    return png(folder, [*frames(4), *(harbour(t) for t in times(3)), *snow])


def flash(folder: Path) -> str:
    """Frame 5 is nearly white."""
    pictures = frames()
    pictures[4] = 0.1 * pictures[4] + 0.9
    return png(folder, pictures)


def fade(folder: Path) -> str:
    """From black over four frames, and back: the first and the last frame are black."""
    pictures = frames(14)
    return png(folder, [p * min(1, i / 4, (13 - i) / 4) for i, p in enumerate(pictures)])


def title(folder: Path) -> str:
    """White letters on frames 4 to 7, on 6 % of the picture."""
    letters = (np.abs(ROWS - 50) < 6) & (COLUMNS > 12) & (COLUMNS < 84) & (COLUMNS % 6 < 2.5)
    pictures = frames()
    for picture in pictures[3:7]:
        picture[letters] = 0.97
    return png(folder, pictures)


def letterbox(folder: Path) -> str:
    """Black bars that leave a picture of 2.4 : 1."""
    pictures = frames()
    for picture in pictures:
        picture[:12] = picture[-12:] = 0
    return png(folder, pictures)


def grain(folder: Path) -> str:
    """Film grain: noise in every channel, a deviation of 2 %."""
    generator = np.random.default_rng(1)
    return png(folder, [p + 0.02 * generator.standard_normal(p.shape) for p in frames()])


def hot_pixels(folder: Path) -> str:
    """Six pixels of 98,304 that are always full green, magenta, cyan, blue, red, yellow."""
    pictures = frames(times_as_large=4)
    colours = [[0, 1, 0], [1, 0, 1], [0, 1, 1], [0, 0, 1], [1, 0, 0], [1, 1, 0]]
    for picture in pictures:
        for i, colour in enumerate(colours):
            picture[28 + 36 * i, 44 + 52 * i] = colour
    return png(folder, pictures)


def rare_light(folder: Path) -> str:
    """A red light of 49 of 98,304 pixels, 0.05 % of the picture."""
    pictures = frames(times_as_large=4)
    for picture in pictures:
        picture[152:159, 280:287] = RED_LIGHT
    return png(folder, pictures)


def interlaced(folder: Path) -> str:
    """MPEG-2 of woven fields, the second half a frame later, 4:2:0 as broadcast has it."""
    pictures = []
    for t in times():
        woven = landscape(t)
        woven[1::2] = landscape(t + 0.5 / FRAMES)[1::2]
        pictures.append(np.rint(np.clip(woven, 0, 1) * 255).astype(np.uint8))
    path = folder / "fields.mov"
    options = {"flags": "+ildct+ilme", "top": "1", "qscale": "2", "b": "8M"}
    write_movie(path, "mpeg2video", "yuv420p", pictures, "rgb24", options=options)
    return str(path)


def matte() -> F64:
    """(h, w, 1) alpha: a soft disc, nothing outside."""
    distance = np.hypot(COLUMNS - WIDTH / 2, ROWS - HEIGHT / 2)
    return np.clip((26 - distance) / 6, 0, 1)[..., None]


def straight_alpha(folder: Path) -> str:
    """PNG; what is fully transparent has a colour that the picture has not."""
    alpha = matte()
    hidden = np.where(alpha > 0, 0, [1.0, 0.0, 1.0])
    pictures = [np.where(alpha > 0, p, hidden) for p in frames()]
    stored = [np.rint(255 * np.concatenate([p, alpha], axis=2)) for p in pictures]
    for i, picture in enumerate(stored, start=1):
        path = folder / f"clip.{i:04d}.png"
        write_image(path, picture.astype(np.uint8), oiio__UnassociatedAlpha=1)
    return str(folder / "clip.####.png")


def premultiplied_alpha(folder: Path) -> str:
    """The same pictures, multiplied by alpha, as half-float EXR."""
    alpha = matte()
    pictures = [np.concatenate([p * alpha, alpha], axis=2) for p in frames()]
    return _sequence(folder, pictures, "exr", np.float16)


def monochrome(folder: Path) -> str:
    """One channel of 16 bits."""
    grey = [p @ [[0.2126], [0.7152], [0.0722]] for p in frames()]
    return _sequence(folder, grey, "tif", np.uint16)


def log_codes(light: F64) -> F64:
    """Cineon's code values of light, over 1023: 90 % white at 685, black at 95."""
    density = np.log10(np.maximum(light * 0.9892 + 0.0108, 1e-6)) / 1.0
    return (685 + 300 * density) / 1023


def log_dpx(folder: Path) -> str:
    """Cineon's curve in DPX of 10 bits."""
    for i, picture in enumerate(frames(), start=1):
        codes = np.rint(log_codes(linear(picture)) * 1023).astype(np.uint16)
        path = folder / f"clip.{i:04d}.dpx"
        write_image(path, codes * 64 + codes // 16, **{"oiio__BitsPerSample": 10})
    return str(folder / "clip.####.dpx")


def log_movie(folder: Path) -> str:
    """The same codes in a QuickTime movie, v210: 4:2:2 of 10 bits."""
    pictures = []
    for picture in frames():
        codes = np.rint(log_codes(linear(picture)) * 65535)
        pictures.append(codes.astype(np.uint16))
    path = folder / "log.mov"
    write_movie(path, "v210", "yuv422p10le", pictures, "rgb48le")
    return str(path)


def hdr_exr(folder: Path) -> str:
    """Scene-linear light whose sun reaches 50; some of the ground lies below 0."""
    pictures = []
    for t in times():
        light = linear(landscape(t, 2))
        light *= 1 + 49 / light.max() * sun(t, 2)
        light[104:112, 20:60, 2] = -0.02
        pictures.append(light)
    return _sequence(folder, pictures, "exr", np.float16)


def pq_codes(nits: F64) -> F64:
    """SMPTE ST 2084: 0 to 1 for light of 0 to 10,000 cd/m2."""
    y = (nits / 10000) ** 0.1593017578125
    return ((0.8359375 + 18.8515625 * y) / (1 + 18.6875 * y)) ** 78.84375


def pq_movie(folder: Path) -> str:
    """PQ of 10 bits with a sun of 1,500 cd/m2, tagged as Rec. 2100."""
    pictures = []
    for t in times():
        light = 200 * linear(landscape(t)) * (1 + 7 * sun(t))
        rgb = pq_codes(light)
        luma = rgb @ [0.2627, 0.6780, 0.0593]
        blue, red = (rgb[..., 2] - luma) / 1.8814, (rgb[..., 0] - luma) / 1.4746
        planes = [876 * luma + 64, 896 * blue + 512, 896 * red + 512]
        pictures.append(np.rint(np.stack(planes)).astype(np.uint16))

    def tag(stream: object) -> None:
        stream.codec_context.color_trc = PQ
        stream.codec_context.color_primaries = BT2020

    path = folder / "pq.mkv"
    write_movie(
        path,
        "ffv1",
        "yuv444p10le",
        pictures,
        "yuv444p10le",
        size=(HEIGHT, WIDTH),
        colorspace=Colorspace.BT2020,
        color_range=ColorRange.MPEG,
        prepare=tag,
    )
    return str(path)
