"""The node in a real host: every frame that melt renders is the core's, to the host's rounding.

melt exits with 0 and hands the picture through whatever happens to a filter, so each test also
sees to it that pixels really changed, or really did not.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from host.scene import RATE, SERVICE, Image, Scene, read_image, recolour

from palette4d import _core

# Corners 0..7 count in red, green, blue bits; anticlockwise from outside.
BOX_FACES = [
    *([0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4]),
    *([2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5]),
]  # fmt: skip


def box_sidecar(path: Path, clip: Sequence[Image], first: int = 100) -> _core.Sidecar:
    """A sidecar around all of a clip's colours, edited in time.

    Nothing is edited at the first frame, a lot at the last, and there is a stop between.
    """
    count = len(clip)
    top = np.iinfo(clip[0].dtype).max
    low = np.min([frame[..., :3].min(axis=(0, 1)) for frame in clip], axis=0) / top - 0.02
    high = np.max([frame[..., :3].max(axis=(0, 1)) for frame in clip], axis=0) / top + 0.02
    corners = [[float((high if i >> c & 1 else low)[c]) for c in range(3)] for i in range(8)]
    vertices = [
        {"id": f"{end}{i}", "frame": frame, "rgb": corners[i]}
        for end, frame in (("a", first), ("b", first + count - 1))
        for i in range(8)
    ]
    document = {
        "schema": "palette4d.sidecar",
        "version": 1,
        "generator": "palette4d tests",
        "clip": {
            "name": "box",
            "source": "in_###.png",
            "frames": {"first": first, "last": first + count - 1, "step": 1, "skipped": []},
            "rate": [RATE, 1],
            "size": [clip[0].shape[1], clip[0].shape[0]],
            "encoding": "sRGB",
        },
        "polytope": {
            "vertices": vertices,
            "edges": [{"id": f"e{i}", "from": f"a{i}", "to": f"b{i}"} for i in range(8)],
            "blocks": [
                {
                    "first": first,
                    "last": first + count - 1,
                    "tracks": [[f"a{i}", f"b{i}"] for i in range(8)],
                    "faces": BOX_FACES,
                }
            ],
            "transitions": [],
        },
        "quality": {"stages": [], "options": {}, "versions": {}},
        "edits": {
            "vertices": [
                {"vertex": "b1", "rgb": [0.2, 0.9, 0.4]},
                {"vertex": "b6", "rgb": [1.3, 0.1, -0.2]},
            ],
            "stops": [
                {"id": "s0", "edge": "e3", "frame": first + count // 2, "rgb": [0.3, 0.2, 0.8]}
            ],
        },
        "extra": {},
    }
    path.write_text(json.dumps(document), encoding="utf-8")
    return _core.read_sidecar(str(path))


def moving_clip(depth: type[np.uint8] | type[np.uint16], count: int = 10) -> list[Image]:
    """Ramps of all three colours that drift, with some noise."""
    random = np.random.default_rng(5)
    y, x = np.mgrid[0:34, 0:46] / 45.0
    top = np.iinfo(depth).max
    clip = []
    for index in range(count):
        t = index / count
        rgb = np.stack([(x + t) % 1, (y * 1.3 + t / 2) % 1, (x * y + 1 - t) % 1], axis=-1)
        rgb = np.clip(rgb * 0.8 + 0.1 + random.normal(0, 0.02, rgb.shape), 0, 1)
        clip.append(np.round(rgb * top).astype(depth))
    return clip


@pytest.fixture(scope="module", params=[np.uint8, np.uint16], ids=["8bit", "16bit"])
def scene(
    request: pytest.FixtureRequest,
    melt: Path,
    bundle: Path,
    tmp_path_factory: pytest.TempPathFactory,
) -> Scene:
    folder = tmp_path_factory.mktemp("melt") / "clip"
    return Scene(melt, bundle.parent, folder, moving_clip(request.param))


@pytest.fixture(scope="module")
def sidecar(scene: Scene) -> _core.Sidecar:
    return box_sidecar(scene.folder / "box.p4d.json", scene.clip)


def path_of(scene: Scene) -> Path:
    return scene.folder / "box.p4d.json"


def test_the_node_is_offered_with_its_parameters(scene: Scene) -> None:
    assert f"- {SERVICE}\n" in scene.run("-query", "filters").stdout
    about = scene.run("-query", f"filter={SERVICE}").stdout
    for name in ("sidecar", "strength", "frameOffset", "status"):
        assert f"- identifier: {name}\n" in about


def test_every_frame_is_the_cores(scene: Scene, sidecar: _core.Sidecar) -> None:
    frames, said = scene.render(sidecar=path_of(scene))
    scene.check(frames, sidecar)
    assert "persistent" not in said


@pytest.fixture(scope="module", params=[np.uint8, np.uint16], ids=["8bit", "16bit"])
def still_scene(
    request: pytest.FixtureRequest,
    melt: Path,
    bundle: Path,
    tmp_path_factory: pytest.TempPathFactory,
) -> Scene:
    """One picture ten times over.

    With several threads melt now and then hands out the pixels of a neighbouring frame, edited or
    not. On a still picture that does not show, and a palette of the wrong time does.
    """
    folder = tmp_path_factory.mktemp("melt") / "still"
    return Scene(melt, bundle.parent, folder, moving_clip(request.param)[:1] * 10)


def test_many_threads_keep_their_times(still_scene: Scene) -> None:
    sidecar = box_sidecar(path_of(still_scene), still_scene.clip)
    frames, said = still_scene.render(sidecar=path_of(still_scene), real_time=-4)
    still_scene.check(frames, sidecar)
    assert "persistent" not in said


def test_keyframed_strength(scene: Scene, sidecar: _core.Sidecar) -> None:
    last = len(scene.clip) - 1
    frames, _ = scene.render(sidecar=path_of(scene), strength=f"0=0;{last}=1")
    scene.check(frames, sidecar, strength=[index / last for index in range(last + 1)])


def test_speed_and_the_ends_of_the_clip(scene: Scene, sidecar: _core.Sidecar) -> None:
    frames, said = scene.render(sidecar=path_of(scene), speed=0.5, inPoint=2)
    assert "persistent" not in said
    first = sidecar.clip["first"]
    expected = [
        recolour(sidecar, first + 2 + index / 2, image[..., :3])
        for index, image in enumerate(scene.clip)
    ]
    scene.check_against(frames, expected)
    # Four frames in, the clip is over after six.
    frames, _ = scene.render(sidecar=path_of(scene), inPoint=4, after="Pass through")
    for index, image in enumerate(scene.clip):
        passed = np.array_equal(frames[index][..., :3], image[..., :3])
        assert passed == (index >= 6), f"frame {index}"


def edited_too(scene: Scene, **colours: tuple[float, float, float]) -> _core.Sidecar:
    """The scene's sidecar with more vertices edited, or edited otherwise."""
    document = json.loads(path_of(scene).read_text())
    edits = [e for e in document["edits"]["vertices"] if e["vertex"] not in colours]
    edits += [{"vertex": name, "rgb": list(rgb)} for name, rgb in colours.items()]
    document["edits"]["vertices"] = edits
    path = scene.folder / "edited too.p4d.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return _core.read_sidecar(str(path))


def test_handles_set_in_melt(scene: Scene, sidecar: _core.Sidecar) -> None:
    # The second handle in order is a1; the 15th is b6, which the sidecar edits too.
    colours = {"handle02": "#3366cc", "handle02On": 1, "handle15": "#ff9900", "handle15On": 1}
    frames, said = scene.render(sidecar=path_of(scene), **colours)
    expected = edited_too(scene, a1=(0.2, 0.4, 0.8), b6=(1.0, 0.6, 0.0))
    assert "persistent" not in said
    scene.check(frames, expected)
    # Not in use, they are nothing: neither melt's own idea of their colours, nor one that is set.
    unused = {**colours, "handle02On": 0, "handle15On": 0}
    frames, _ = scene.render(sidecar=path_of(scene), **unused)
    scene.check(frames, sidecar)
    frames, _ = scene.render(sidecar=path_of(scene), editsFrom="Host", **unused)
    assert scene.unchanged(frames)


def test_a_handle_named_by_its_id_in_melt(scene: Scene, sidecar: _core.Sidecar) -> None:
    frames, _ = scene.render(
        sidecar=path_of(scene), handle32="#00ff00", handle32On=1, handle32Id="b1"
    )
    scene.check(frames, edited_too(scene, b1=(0.0, 1.0, 0.0)))


def test_a_weight_as_a_matte_in_melt(scene: Scene, sidecar: _core.Sidecar) -> None:
    # The fourth handle in order is a3, which becomes b3: track 3 of the box.
    frames, said = scene.render(sidecar=path_of(scene), output="Weight of a handle", weightOf=4)
    assert "persistent" not in said
    expected = []
    for index, image in enumerate(scene.clip):
        cut = _core.slice_at(sidecar.polytope, sidecar.clip["first"] + index)
        points = image.reshape(-1, 3) / float(np.iinfo(image.dtype).max)
        weights, _ = _core.palette_weights(points, cut.rgb, cut.faces)
        matte = np.clip(weights[:, 3], 0, 1).reshape(image.shape[:2])
        expected.append(np.repeat(matte[..., None], 3, axis=-1).astype(np.float32))
    assert np.ptp(expected[0]) > 0.2
    for frame, wanted in zip(frames, expected, strict=True):
        top = float(np.iinfo(frame.dtype).max)
        assert np.abs(frame[..., :3] / top - wanted).max() <= 2e-4 + 0.51 / top


def test_the_palette_and_the_mix_in_melt(scene: Scene, sidecar: _core.Sidecar) -> None:
    graded, _ = scene.render(sidecar=path_of(scene))
    frames, _ = scene.render(sidecar=path_of(scene), output="Palette")
    strip = scene.clip[0].shape[0] // 8
    for frame, whole in zip(frames, graded, strict=True):
        assert np.array_equal(frame[:-strip], whole[:-strip])
        assert len(np.unique(frame[-1, :, :3], axis=0)) == 8
    frames, _ = scene.render(sidecar=path_of(scene), mix=0)
    assert scene.unchanged(frames)


def test_without_a_sidecar_the_picture_passes(scene: Scene) -> None:
    frames, said = scene.render()
    assert scene.unchanged(frames)
    assert "persistent" not in said


@pytest.mark.parametrize("kind", ["missing", "broken"])
def test_an_unusable_sidecar_passes_the_picture_with_a_message(
    scene: Scene, sidecar: _core.Sidecar, kind: str
) -> None:
    bad = scene.folder / f"{kind}.p4d.json"
    if kind == "broken":
        bad.write_text("this is not JSON")
    frames, said = scene.render(sidecar=bad)
    assert scene.unchanged(frames)
    messages = [line for line in said.splitlines() if "persistent" in line]
    assert messages, said
    assert bad.name in messages[0]


def test_a_path_with_spaces_and_umlauts(scene: Scene, sidecar: _core.Sidecar) -> None:
    folder = scene.folder / "Grüne Blätter, Nr. 7"
    folder.mkdir(exist_ok=True)
    path = folder / "schöner Clip.p4d.json"
    path.write_bytes(path_of(scene).read_bytes())
    frames, _ = scene.render(sidecar=path)
    scene.check(frames, sidecar)


@pytest.fixture(scope="module", params=[np.uint8, np.uint16], ids=["8bit", "16bit"])
def seasons_scene(
    request: pytest.FixtureRequest,
    melt: Path,
    bundle: Path,
    seasons: Path,
    tmp_path_factory: pytest.TempPathFactory,
) -> Scene:
    """The paper's SEASONS clip (where it is at hand), from spring to winter."""
    # Every sixth frame, each second pixel: all seasons, in little time.
    clip = [read_image(path)[::2, ::2, :3] for path in sorted(seasons.glob("*.png"))[::6]]
    if request.param is np.uint16:
        # Between the 8-bit steps too.
        random = np.random.default_rng(7)
        clip = [
            np.clip(
                image.astype(np.int64) * 257 + random.integers(-128, 129, image.shape), 0, 65535
            ).astype(np.uint16)
            for image in clip
        ]
    folder = tmp_path_factory.mktemp("melt") / "seasons"
    return Scene(melt, bundle.parent, folder, clip)


def test_seasons(seasons_scene: Scene) -> None:
    scene = seasons_scene
    sidecar = box_sidecar(path_of(scene), scene.clip)
    frames, said = scene.render(sidecar=path_of(scene))
    assert "persistent" not in said
    scene.check(frames, sidecar)
    # Nothing is edited at the first frame: spring stays, winter does not.
    first, last = (
        float(np.abs(frames[i][..., :3].astype(np.float64) - scene.clip[i]).mean()) for i in (0, -1)
    )
    top = np.iinfo(scene.clip[0].dtype).max
    assert first < 1e-4 * top
    assert last > 0.02 * top
