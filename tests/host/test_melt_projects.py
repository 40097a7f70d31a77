"""The node in melt as editors use it: several nodes in a chain, projects on disk, long renders."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from host.scene import SERVICE, Image, Scene, read_image, recolour, run_until_it_writes
from host.test_melt import box_sidecar, moving_clip

from palette4d import _core

DEPTHS = {"8bit": ("rgba", "rgba"), "16bit": ("rgba64", "rgba64be")}  # melt's format, the file's


@pytest.fixture(scope="module", params=DEPTHS)
def scene(
    request: pytest.FixtureRequest,
    melt: Path,
    bundle: Path,
    tmp_path_factory: pytest.TempPathFactory,
) -> Scene:
    depth = np.uint8 if request.param == "8bit" else np.uint16
    folder = tmp_path_factory.mktemp("melt projects") / "clip"
    return Scene(melt, bundle.parent, folder, moving_clip(depth))


@pytest.fixture(scope="module")
def sidecars(scene: Scene) -> tuple[_core.Sidecar, _core.Sidecar]:
    """Two grades of the same palette."""
    first = box_sidecar(scene.folder / "first.p4d.json", scene.clip)
    document = json.loads((scene.folder / "first.p4d.json").read_text())
    document["edits"] = {"vertices": [{"vertex": "a4", "rgb": [0.1, 0.6, 0.5]}], "stops": []}
    path = scene.folder / "second.p4d.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return first, _core.read_sidecar(str(path))


def consumer(scene: Scene, threads: int = -1) -> tuple[str, ...]:
    form, pixels = DEPTHS["8bit" if scene.clip[0].dtype == np.uint8 else "16bit"]
    return (
        *("-consumer", "avformat:out_%03d.png", "vcodec=png", "an=1", f"pix_fmt={pixels}"),
        *(f"mlt_image_format={form}", f"real_time={threads}"),
    )


def render(
    scene: Scene, *words: str, folder: Path | None = None, threads: int = -1, **environment: str
) -> tuple[list[Image], str]:
    """The frames that melt writes into a folder (the scene's), and what it said."""
    words += consumer(scene, threads)
    files, said = scene.write("out_*.png", *words, folder=folder, **environment)
    assert len(files) == len(scene.clip), said
    return [read_image(path) for path in files], said


def without_a_message(rendered: tuple[list[Image], str]) -> list[Image]:
    frames, said = rendered
    assert "persistent" not in said
    return frames


def check_chain(
    clip: list[Image], frames: list[Image], sidecars: tuple[_core.Sidecar, _core.Sidecar]
) -> None:
    """One grade after the other, rounded to the clip's depth between them as melt does."""
    first, second = sidecars
    top = float(np.iinfo(clip[0].dtype).max)
    for index, (frame, image) in enumerate(zip(frames, clip, strict=True)):
        once = np.round(recolour(first, 100 + index, image[..., :3]) * top).astype(image.dtype)
        wanted = recolour(second, 100 + index, once)
        # Where the first grade was rounded the other way, the second moves that on.
        error = np.abs(frame[..., :3].astype(np.float64) - wanted.astype(np.float64) * top)
        assert error.max() <= 2.5, f"frame {index}: off by {error.max()} of {top}"
        assert np.median(error) <= 0.5
        assert np.abs(wanted - image[..., :3] / top).mean() > 0.002, f"frame {index} is unchanged"


CLIP = ("-profile", "profile", "abnormal:in_%03d.png")
GRADES = ("-attach", SERVICE, "sidecar=first.p4d.json")
GRADES += ("-attach", SERVICE, "sidecar=second.p4d.json")


@pytest.fixture(scope="module")
def project_clip(scene: Scene) -> list[Image]:
    """What melt makes of the clip in a project without any effect: it passes through 4:2:2."""
    scene.run(*CLIP, "-consumer", "xml:plain.mlt")
    return without_a_message(render(scene, "plain.mlt"))


def test_several_nodes_in_a_chain(
    scene: Scene, sidecars: tuple[_core.Sidecar, _core.Sidecar]
) -> None:
    frames = without_a_message(render(scene, *CLIP, *GRADES))
    check_chain(scene.clip, frames, sidecars)


@pytest.fixture(scope="module")
def movie(scene: Scene) -> str:
    """The clip as a movie of RGB in the scene's folder."""
    form = ("vcodec=ffv1", "an=1", "pix_fmt=bgr0", "mlt_image_format=rgba", "real_time=-1")
    scene.write("clip.mkv", *CLIP, "-consumer", "avformat:clip.mkv", *form)
    return "clip.mkv"


def test_many_threads_on_a_movie(
    scene: Scene, movie: str, sidecars: tuple[_core.Sidecar, _core.Sidecar]
) -> None:
    """docs/hosts/melt.md: threads exchange frames of image sequences, and not those of movies."""
    words = ("-profile", "profile", f"avformat:{movie}")
    clip = without_a_message(render(scene, *words))
    assert all((a != b).any() for a, b in zip(clip[1:], clip, strict=False))
    check_chain(clip, without_a_message(render(scene, *words, *GRADES, threads=-4)), sidecars)


def test_a_movie_at_another_speed(
    scene: Scene, movie: str, sidecars: tuple[_core.Sidecar, _core.Sidecar]
) -> None:
    """docs/hosts/kdenlive.md: the node counts the frames shown; *Speed* is the clip's factor."""
    words = ("-profile", "profile", f"timewarp:2:{movie}")
    grade = ("-attach", SERVICE, "sidecar=first.p4d.json")

    def rendered(*effect: str) -> list[Image]:
        files, said = scene.write("out_*.png", *words, *effect, *consumer(scene))
        assert "persistent" not in said
        return [read_image(path) for path in files]

    clip = rendered()
    assert len(clip) == len(scene.clip) // 2
    top = float(np.iinfo(clip[0].dtype).max)

    def worst(frames: list[Image]) -> float:
        errors = [
            np.abs(frame[..., :3] / top - recolour(sidecars[0], 100 + 2 * index, image[..., :3]))
            for index, (frame, image) in enumerate(zip(frames, clip, strict=True))
        ]
        return float(np.max(errors))

    assert worst(rendered(*grade, "speed=2")) <= 0.51 / top
    assert worst(rendered(*grade)) > 0.01


def test_a_project_on_disk(
    scene: Scene, project_clip: list[Image], sidecars: tuple[_core.Sidecar, _core.Sidecar]
) -> None:
    scene.run(*CLIP, *GRADES, "-consumer", "xml:show.mlt")
    assert (scene.folder / "show.mlt").read_text().count(f">{SERVICE}<") == 2
    frames = without_a_message(render(scene, "show.mlt"))
    check_chain(project_clip, frames, sidecars)


def test_a_project_keeps_handles_and_keyframes(
    scene: Scene, project_clip: list[Image], sidecars: tuple[_core.Sidecar, _core.Sidecar]
) -> None:
    last = len(scene.clip) - 1
    path = scene.folder / "second.p4d.json"
    scene.run(
        *(*CLIP, "-attach", SERVICE, f"sidecar={path}"),
        *(f"strength=0=0;{last}=1", "handle07=#ffcc00", "handle07On=1", "editsFrom=Host"),
        *("-consumer", "xml:keyed.mlt"),
    )
    frames = without_a_message(render(scene, "keyed.mlt"))
    document = json.loads(path.read_text())
    document["edits"] = {"vertices": [{"vertex": "a6", "rgb": [1.0, 0.8, 0.0]}], "stops": []}
    path = scene.folder / "by hand.p4d.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    sidecar = _core.read_sidecar(str(path))
    top = float(np.iinfo(scene.clip[0].dtype).max)
    for index, (frame, image) in enumerate(zip(frames, project_clip, strict=True)):
        wanted = recolour(sidecar, 100 + index, image[..., :3], index / last)
        assert np.abs(frame[..., :3] / top - wanted).max() <= 0.51 / top, f"frame {index}"
    assert np.abs(frames[4][..., :3] / top - project_clip[4][..., :3] / top).mean() > 0.002


def test_a_project_rendered_from_another_folder(
    scene: Scene, project_clip: list[Image], sidecars: tuple[_core.Sidecar, _core.Sidecar]
) -> None:
    """docs/hosts/melt.md: a sidecar below the project's folder is stored as a relative path."""
    elsewhere = scene.folder.parent / "elsewhere"
    elsewhere.mkdir(exist_ok=True)
    absolute = str(scene.folder / "first.p4d.json")

    def rendered(stored: str, **environment: str) -> tuple[list[Image], str]:
        scene.run(*CLIP, "-attach", SERVICE, f"sidecar={stored}", "-consumer", "xml:moved.mlt")
        return render(scene, str(scene.folder / "moved.mlt"), folder=elsewhere, **environment)

    frames, said = rendered(absolute)
    assert "first.p4d.json: the file does not exist" in said
    for found, passed in zip(frames, project_clip, strict=True):
        assert np.array_equal(found[..., :3], passed[..., :3])
    for frames, said in (
        rendered(absolute, PALETTE4D_PATH=str(scene.folder)),
        rendered("/" + absolute),
        rendered("$P4D_CLIP/first.p4d.json", P4D_CLIP=str(scene.folder)),
    ):
        assert "persistent" not in said
        top = float(np.iinfo(scene.clip[0].dtype).max)
        for index, (found, image) in enumerate(zip(frames, project_clip, strict=True)):
            wanted = recolour(sidecars[0], 100 + index, image[..., :3])
            assert np.abs(found[..., :3] / top - wanted).max() <= 0.51 / top, f"frame {index}"


def peak_memory(scene: Scene, bundle: Path, count: int, threads: int, *effect: str) -> int:
    """KiB that melt takes at most for `count` frames through an effect."""
    form, pixels = DEPTHS["8bit" if scene.clip[0].dtype == np.uint8 else "16bit"]
    raw = scene.folder / "out.raw"
    raw.unlink(missing_ok=True)
    words = (
        *("-quiet", "-profile", "profile", "color:#ff8050", f"out={count - 1}"),
        *("-attach", *effect, "-consumer", f"avformat:{raw.name}", "f=rawvideo"),
        *("vcodec=rawvideo", "an=1", f"mlt_image_format={form}", f"real_time={threads}"),
        f"pix_fmt={pixels.replace('be', 'le')}",
    )
    _, memory = run_until_it_writes(
        [str(scene.melt), *words],
        scene.folder,
        {"OFX_PLUGIN_PATH": str(bundle.parent)},
        lambda: raw.exists() and raw.stat().st_size,
    )
    height, width = scene.clip[0].shape[:2]
    assert raw.stat().st_size == count * height * width * 4 * scene.clip[0].itemsize
    raw.unlink()
    return memory


@pytest.mark.parametrize("threads", [pytest.param(-1, marks=pytest.mark.slow), -4])
def test_a_thousand_frames_take_no_more_memory_than_an_effect_that_does_nothing(
    scene: Scene,
    sidecars: tuple[_core.Sidecar, _core.Sidecar],
    bundle: Path,
    idle_bundle: Path,
    threads: int,
) -> None:
    # melt 7.42 itself keeps some 33 KiB of every frame of any OpenFX effect.
    def growth(plugin: Path, *effect: str) -> int:
        return peak_memory(scene, plugin, 1000, threads, *effect) - peak_memory(
            scene, plugin, 200, threads, *effect
        )

    # A grade of its own for each frame: what is prepared for one is of no use to others.
    node = growth(
        *(bundle, SERVICE, f"sidecar={scene.folder / 'first.p4d.json'}", "inPoint=3"),
        *("handle01On=1", "handle01=0=#000000;999=#ffffff", "speed=0.005"),
    )
    idle = growth(idle_bundle, "openfx.org.palette4d.tests.Idle")
    # Threads take the allocator's memory apart in ways that vary from run to run.
    assert node < idle + 24 * 1024, f"grew by {node} KiB, the idle effect by {idle} KiB"
