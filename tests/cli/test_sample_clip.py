"""The built-in sample clip: always the same, in range, with the colours that its page names."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from palette4d.cli import sample_clip
from palette4d.common.arguments import Parser
from palette4d.common.errors import Palette4dError
from palette4d.demo.scene import Scene, fractal_noise, value_noise
from palette4d.media.clip import open_clip


def run(*words: object) -> int:
    """Run the verb alone, without the other verbs' modules."""
    parser = Parser()
    sample_clip.add_parser(parser.add_subparsers())
    args = parser.parse_args(["sample-clip", *map(str, words)])
    return args.run(args)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene(160, 90)


def test_default_is_a_whole_clip():
    assert sample_clip.FRAMES >= 48
    assert sample_clip.SIZE == (320, 180)


@pytest.mark.parametrize(
    ("name", "depth", "options"),
    [("s.####.png", "uint16", []), ("s.####.exr", "float", []), ("s.####.exr", "half", ["--half"])],
)
def test_frames_are_written(tmp_path, name, depth, options):
    output = tmp_path / "a clip" / name
    assert run("-o", output, "--frames", 3, "--size", "64x36", *options) == 0
    clip = open_clip(str(output))
    assert clip.frames == [1, 2, 3]
    assert (clip.width, clip.height, clip.depth, clip.encoding) == (64, 36, depth, "sRGB")
    assert clip.rate == Fraction(24)
    tolerance = {"uint16": 1e-5, "float": 0, "half": 5e-4}[depth]
    for frame, pixels in clip:
        drawn = Scene(64, 36).picture((frame - 1) / 2)
        np.testing.assert_allclose(pixels, drawn, atol=tolerance)
    with pytest.raises(Palette4dError, match="found a file there"):
        run("-o", output, "--frames", 1, "--size", "64x36")
    assert run("-o", output, "--frames", 1, "--size", "64x36", "--force", *options) == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["-o", "o.png"], "one file"),
        (["-o", "o.#.gif"], "extension"),
        (["-o", "o.#.png", "--half"], "half=True"),
    ],
)
def test_wrong_requests_are_refused(tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(Palette4dError, match=message):
        run(*words)
    assert list(tmp_path.iterdir()) == []


def test_pictures_are_in_range_and_repeatable(scene):
    again = Scene(160, 90)
    for u in (0.0, 0.3, 0.66, 1.0):
        picture = scene.picture(u)
        assert picture.shape == (90, 160, 3)
        assert picture.dtype == np.float32
        assert picture.min() >= 0
        assert picture.max() <= 1
        np.testing.assert_array_equal(picture, again.picture(u))


def test_neighbouring_frames_are_close(scene):
    before, after = scene.picture(0.50), scene.picture(0.50 + 1 / 47)
    assert np.abs(before - after).mean() < 0.03


def near(picture: np.ndarray, x: float, y: float) -> np.ndarray:
    """Mean colour around a place given in parts of width and height."""
    row, column = int(y * 90), int(x * 160)
    return picture[row - 2 : row + 3, column - 2 : column + 3].mean(axis=(0, 1))


MAPLE, BIRCH = (0.10 * 9 / 16, 0.685 - 0.6 * 0.33), (0.235 * 9 / 16, 0.690 - 0.6 * 0.26)


def test_leaves_split_from_green_into_yellow_and_red(scene):
    summer, autumn = scene.picture(0.0), scene.picture(0.5)
    assert np.abs(near(summer, *MAPLE) - near(summer, *BIRCH)).max() < 0.12
    for tree in (MAPLE, BIRCH):
        red, green, blue = near(summer, *tree)
        assert green > red > blue
    red, green, _ = near(autumn, *MAPLE)
    assert red > 2 * green
    red, green, blue = near(autumn, *BIRCH)
    assert red > green > 2 * blue
    assert green > 0.6 * red


def test_lake_and_sky_merge_at_dusk(scene):
    water, sky = (0.30, 0.88), (0.30, 0.30)
    apart = [np.abs(near(p, *water) - near(p, *sky)).max() for p in map(scene.picture, (0.0, 0.8))]
    assert apart[0] > 0.25
    assert apart[1] < 0.5 * apart[0]


def test_lights_appear(scene):
    def lit(picture: np.ndarray) -> int:
        window = picture[48:56, 110:136]
        return int(
            ((window[..., 0] > 0.8) & (window[..., 2] < 0.65) & (window[..., 1] > 0.6)).sum()
        )

    assert lit(scene.picture(0.2)) == 0
    assert lit(scene.picture(0.9)) > 5


def test_noise_is_smooth_and_in_range():
    x = np.linspace(-5, 5, 400, dtype=np.float32)[None, :]
    y = np.linspace(-3, 3, 200, dtype=np.float32)[:, None]
    for noise in (value_noise(x, y, 7), fractal_noise(x, y, 7)):
        assert noise.shape == (200, 400)
        assert noise.min() >= 0
        assert noise.max() <= 1
        assert noise.std() > 0.1
        assert np.abs(np.diff(noise, axis=1)).max() < 0.2
    assert not np.array_equal(value_noise(x, y, 7), value_noise(x, y, 8))
