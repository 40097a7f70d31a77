"""Large frames: strip by strip gives the same bytes, and memory stays bounded."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from clip_files import write_image

from palette4d.grade import rendering
from palette4d.grade.rendering import render
from palette4d.media import clip_base
from palette4d.media.array_clip import ArrayClip

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"
EDITED = GOLDEN / "v1_edited.p4d.json"
PICKS = GOLDEN / "v2_picks.p4d.json"


def pictures(folder: Path, kind: type, channels: int) -> str:
    """Two random frames with a gap, also with hidden pixels where there is alpha."""
    random = np.random.default_rng(3)
    extension = "png" if kind is np.uint16 else "exr"
    for frame in (1, 3):
        image = random.random((41, 23, channels)).astype(np.float32)
        if channels == 4:
            image[::5, ::3, 3] = 0
        stored = (image * 65535).astype(kind) if kind is np.uint16 else image.astype(kind)
        write_image(folder / f"in.{frame}.{extension}", stored)
    return str(folder / f"in.#.{extension}")


@pytest.mark.parametrize("sidecar", [EDITED, PICKS], ids=["handles", "picks"])
@pytest.mark.parametrize(
    ("kind", "channels", "out", "more"),
    [
        (np.float16, 3, "exr", {"half": True}),
        (np.float32, 4, "exr", {}),
        (np.uint16, 4, "png", {}),
        (np.uint16, 3, "tif", {}),
        (np.float32, 4, "png", {}),
        (np.uint16, 3, "dpx", {}),
        (np.uint16, 3, "png", {"compare": "side"}),
        (np.uint16, 3, "png", {"show": "palette"}),
    ],
)
def test_strips_give_the_same_pixels(
    sidecar: Path,
    kind: type,
    channels: int,
    out: str,
    more: dict,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from palette4d.media.clip import open_clip

    clip = pictures(tmp_path, kind, channels)
    render(sidecar, clip, tmp_path / f"whole.#.{out}", frames="1-3", **more)
    monkeypatch.setattr(rendering, "LARGE", 100)
    monkeypatch.setattr(clip_base, "STRIP", 23 * 7)
    done = render(sidecar, clip, tmp_path / f"strips.#.{out}", frames="1-3", **more)
    assert done.filled == [2]
    whole, strips = (open_clip(str(tmp_path / f"{name}.#.{out}")) for name in ("whole", "strips"))
    for frame in (1, 2, 3):
        assert whole.read(frame).tobytes() == strips.read(frame).tobytes()


@pytest.mark.parametrize(
    ("out", "more"),
    [
        ("mov", {}),
        ("mp4", {}),
        ("mov", {"codec": "prores4444"}),
        ("mov", {"codec": "dnxhr-444"}),
    ],
    ids=str,
)
def test_strips_give_the_same_movie(
    out: str, more: dict, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from palette4d.media.clip import open_clip

    random = np.random.default_rng(5)
    for frame in (1, 2):
        image = (random.random((163, 259, 4)) * 65535).astype(np.uint16)
        write_image(tmp_path / f"in.{frame}.png", image)
    clip = str(tmp_path / "in.#.png")
    render(EDITED, clip, tmp_path / f"whole.{out}", **more)
    monkeypatch.setattr(clip_base, "STRIP", 259 * 13)
    render(EDITED, clip, tmp_path / f"strips.{out}", **more)
    whole, strips = (open_clip(str(tmp_path / f"{name}.{out}")) for name in ("whole", "strips"))
    for frame in (0, 1):
        assert whole.read(frame).tobytes() == strips.read(frame).tobytes()


def test_the_arrays_of_a_clip_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rendering, "LARGE", 100)
    images = np.random.default_rng(1).random((2, 16, 16, 3)).astype(np.float32)
    before = images.copy()
    render(EDITED, ArrayClip(images), tmp_path / "o.#.png")
    assert (images == before).all()


@pytest.mark.slow
@pytest.mark.parametrize("out", ["o.#.exr", "o.#.png", "o.mov"])
def test_8k_takes_less_than_a_gigabyte(tmp_path: Path, out: str) -> None:
    resource = pytest.importorskip("resource")
    row = np.linspace(0, 1, 7680, dtype=np.float32)
    image = np.empty((4320, 7680, 3), np.float16)
    image[:] = row[None, :, None]
    for frame in (1, 2):
        write_image(tmp_path / f"in.{frame}.exr", image)
    words = ["render", EDITED, tmp_path / "in.#.exr", "-o", tmp_path / out, "--quiet"]
    subprocess.run([sys.executable, "-m", "palette4d", *map(str, words)], check=True)
    used = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    assert used * (1 if sys.platform == "darwin" else 1024) < 1_000_000_000
