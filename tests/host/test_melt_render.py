"""melt and the command `palette4d render` make the same pictures, frame by frame.

The road of a user: analyse a clip, edit its palette, render it with the command and in a host.
"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from host.scene import Image, Scene, read_image
from numpy.typing import NDArray

AUTUMN = 46  # the leaves of SEASONS are orange in this frame


def palette4d(*words: object) -> str:
    """What the command line prints; the test fails with its error."""
    done = subprocess.run(
        [sys.executable, "-m", "palette4d", *map(str, words)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def rendered_by_the_command(sidecar: Path, clip: Path) -> list[NDArray[np.float32]]:
    """Every frame as `palette4d render` writes it in float, within 0..1 as melt hands it back."""
    folder = sidecar.parent / f"{sidecar.stem} by the command"
    palette4d("render", sidecar, clip, "-o", folder / "out.####.exr", "--quiet")
    return [np.clip(read_image(path)[..., :3], 0, 1) for path in sorted(folder.glob("*.exr"))]


def in_16_bits(image: Image) -> Image:
    """The same colours in 16 bits: the depth at which melt asks the node for float."""
    return image if image.dtype == np.uint16 else image[..., :3].astype(np.uint16) * 257


@dataclass(frozen=True)
class Rendered:
    """A clip, rendered both ways."""

    scene: Scene
    frames: list[Image]  # by melt
    expected: list[NDArray[np.float32]]  # by the command
    said: str

    def change(self, index: int) -> NDArray[np.float64]:
        """(h, w, 3) what the edit did to a frame in melt, of 1."""
        before, after = self.scene.clip[index], self.frames[index][..., :3]
        return (after.astype(np.float64) - before) / 65535


def render_both_ways(melt: Path, bundle: Path, sidecar: Path, clip: Path) -> Rendered:
    files = sorted(clip.glob("*.png"))
    folder = sidecar.parent / f"{sidecar.stem} in melt"
    scene = Scene(melt, bundle.parent, folder, [in_16_bits(read_image(path)) for path in files])
    expected = rendered_by_the_command(sidecar, clip)
    frames, said = scene.render(sidecar=sidecar)
    return Rendered(scene, frames, expected, said)


@pytest.fixture(scope="module")
def crimson_autumn(
    melt: Path, bundle: Path, seasons: Path, tmp_path_factory: pytest.TempPathFactory
) -> Rendered:
    """SEASONS, all of it at its full size, edited as the README does: autumn's gold turns red,
    the orange that it ends in crimson; until frame 28 the leaves stay as they were."""
    sidecar = tmp_path_factory.mktemp("seasons") / "seasons.p4d.json"
    palette4d("analyze", seasons, "-o", sidecar, "--quiet")
    summer = ("--near", "0.91,0.84,0.04", "--frame", 28)
    palette4d("edit", sidecar, "set", *summer, "--rgb", 0.91, 0.84, 0.04)
    for leaves, frame, colour in (
        ("0.95,0.85,0", 35, (0.9, 0.35, 0.1)),
        ("1,0.6,0", 49, (0.8, 0.12, 0.15)),
    ):
        palette4d("edit", sidecar, "set", "--near", leaves, "--frame", frame, "--rgb", *colour)
    return render_both_ways(melt, bundle, sidecar, seasons)


@pytest.mark.slow
def test_seasons_in_melt_is_what_the_command_renders(crimson_autumn: Rendered) -> None:
    assert "persistent" not in crimson_autumn.said
    assert len(crimson_autumn.frames) == 50
    crimson_autumn.scene.check_against(crimson_autumn.frames, crimson_autumn.expected)


@pytest.mark.slow
def test_an_edit_in_autumn_leaves_spring_alone(crimson_autumn: Rendered) -> None:
    for index in range(11):
        assert np.abs(crimson_autumn.change(index)).max() < 1 / 255, f"frame {index} changed"
    for index in range(38, AUTUMN + 2):
        assert np.abs(crimson_autumn.change(index)).mean() > 0.01, f"frame {index} did not change"


@pytest.mark.slow
def test_the_orange_leaves_turn_crimson(crimson_autumn: Rendered) -> None:
    red, green, blue = np.moveaxis(crimson_autumn.scene.clip[AUTUMN] / 65535, -1, 0)
    orange = (red > 0.5) & (green < 0.75 * red) & (blue < 0.4 * red)
    assert orange.mean() > 0.03
    change = crimson_autumn.change(AUTUMN)[orange].mean(axis=0)
    assert change[1] < -0.07
    assert change[2] > 0.05


@pytest.fixture(scope="module")
def recoloured_sample(
    melt: Path, bundle: Path, tmp_path_factory: pytest.TempPathFactory
) -> Rendered:
    """The built-in sample clip in small, with two vertices and a colour stop edited."""
    folder = tmp_path_factory.mktemp("sample")
    clip, sidecar = folder / "sample", folder / "sample.p4d.json"
    palette4d("sample-clip", "-o", clip / "sample.####.png", "--size", "128x72", "--quiet")
    palette4d("analyze", clip, "-o", sidecar, "--quiet", "--method", "static")
    # The sky at the beginning, the yellow trees in the middle, the night sky at the end.
    summer = ("--near", "0.2,0.45,0.95", "--frame", 1)
    palette4d("edit", sidecar, "set", "--anyway", *summer, "--rgb", 0.5, 0.2, 0.9)
    yellow = ("--near", "0.75,0.6,0.1", "--frame", 22.5)
    palette4d("edit", sidecar, "set", "--anyway", *yellow, "--rgb", 0.95, 0.3, 0.6)
    night = ("--near", "0.02,0.07,0.28", "--frame", 48)
    palette4d("edit", sidecar, "set", "--anyway", *night, "--rgb", 0.0, 0.4, 0.25)
    return render_both_ways(melt, bundle, sidecar, clip)


def test_the_sample_clip_in_melt_is_what_the_command_renders(recoloured_sample: Rendered) -> None:
    assert "persistent" not in recoloured_sample.said
    assert len(recoloured_sample.frames) == 48
    assert recoloured_sample.scene.clip[0].dtype == np.uint16
    recoloured_sample.scene.check_against(recoloured_sample.frames, recoloured_sample.expected)


def test_every_edit_of_the_sample_clip_shows(recoloured_sample: Rendered) -> None:
    for index in (0, 21, 22, 47):
        assert np.abs(recoloured_sample.change(index)).mean() > 0.005, f"frame {index}"
