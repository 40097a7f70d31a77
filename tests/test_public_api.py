"""`import palette4d`: its public names, quick import, and docs/python.md line by line."""

import re
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from clip_files import write_image, write_movie

import palette4d
from palette4d.demo.scene import Scene

PUBLIC = {
    "Area",
    "Document",
    "Palette4dError",
    "SidecarError",
    "UnfinishedError",
    "__version__",
    "analyze",
    "analyze_shots",
    "bake",
    "config",
    "export",
    "export_dctl",
    "export_glsl",
    "install_plugin",
    "load",
    "open_clip",
    "plot",
    "render",
    "sample_clip",
}
ROOT = Path(__file__).resolve().parents[1]
GOLDEN = ROOT / "tests" / "golden" / "sidecars"


@pytest.fixture(scope="module")
def clip_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """shot.####.png, frames 1 to 48 of the sample clip, and shot.mov of the first 13."""
    folder = tmp_path_factory.mktemp("clip")
    scene = Scene(32, 18)
    pictures = [np.clip(scene.picture(i / 47), 0, 1) for i in range(48)]
    codes = [np.rint(picture * 255).astype(np.uint8) for picture in pictures]
    for i, picture in enumerate(codes):
        write_image(folder / f"shot.{i + 1:04d}.png", picture)
    write_movie(folder / "shot.mov", "png", "rgb24", codes[:13], "rgb24", rate=Fraction(24))
    return folder


def test_a_document_has_few_members_all_of_them_on_the_page() -> None:
    document = palette4d.load(GOLDEN / "v1_edited.p4d.json")
    members = {name for name in dir(document) if not name.startswith("_")}
    assert len(members) <= 40
    page = (ROOT / "docs" / "python.md").read_text("utf-8")
    assert {name for name in members if not re.search(rf"\.{name}\b", page)} == set()


def test_only_these_names_are_public() -> None:
    assert set(palette4d.__all__) == set(dir(palette4d)) == PUBLIC
    for name in PUBLIC:
        assert getattr(palette4d, name) is not None
    with pytest.raises(AttributeError):
        palette4d.nothing  # noqa: B018


def test_importing_loads_next_to_nothing() -> None:
    code = "import palette4d, sys; print(sorted({'numpy', 'palette4d._core'} & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True
    )
    assert done.stdout == "[]\n"


def test_the_rooms_import_nothing_but_the_core_from_the_package(repo_root: Path) -> None:
    """The contract of the layers cannot see this one: `palette4d` offers what all rooms have."""
    for folder in ("src/palette4d", "analysis", "lut_export"):
        for path in (repo_root / folder).rglob("*.py"):
            if path.parent.name == "cli":  # the command line is written on top of the API
                continue
            for names in re.findall(r"^ *from palette4d import (.*)$", path.read_text(), re.M):
                assert names == "_core", path


def test_every_line_of_the_page_runs(
    repo_root: Path, clip_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = (repo_root / "docs/python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"(?:^(?: {4}.*|)\n)+", page, re.MULTILINE)
    code = [re.sub(r"^ {4}", "", block, flags=re.MULTILINE) for block in blocks if block.strip()]
    assert len(code) >= 10
    monkeypatch.chdir(clip_folder)
    names: dict[str, Any] = {}
    for block in code:
        exec(compile(block, "docs/python.md", "exec"), names)
    doc = names["doc"]
    assert doc.grade.palette(frame=30).edited.tolist() != doc.grade.palette(frame=30).rgb.tolist()
    assert doc.grade.versions == ("before warm", "warm")
    assert palette4d.load("shot.p4d.json").fields() == doc.fields()
    assert Path("autumn.cube").stat().st_size > 0
    for name in PUBLIC:
        assert f"`{name}" in page
    for name in (name for name in dir(palette4d.Document) if not name.startswith("_")):
        assert re.search(rf"\w\.{name}\b|`{name}`", page), f"docs/python.md lacks {name}"


def test_the_palettes_of_files_and_of_arrays_hold_their_pixels(clip_folder: Path) -> None:
    told: list[tuple[str, int, int]] = []
    frames = "1-8"
    clip = palette4d.open_clip(str(clip_folder / "shot.####.png"), frames=frames)
    array = np.stack([image for _, image in clip])

    def progress(stage: str, done: int, total: int) -> None:
        told.append((stage, done, total))

    ours = palette4d.analyze(array, method="static", progress=progress)
    theirs = palette4d.analyze(clip_folder / "shot.####.png", frames=frames, method="static")
    assert told
    assert ours.grade.frames == (0, 7, 1)
    assert theirs.grade.frames == (1, 8, 1)
    assert ours.path is None
    for doc, frame in ((ours, 3), (theirs, 4)):
        rebuilt = doc.weights(array[3], frame) @ doc.grade.palette(frame).rgb
        assert np.abs(rebuilt - array[3]).mean() < 0.01


def test_a_bake_holds_what_is_not_saved_yet(tmp_path: Path) -> None:
    doc = palette4d.load(GOLDEN / "v1_split.p4d.json")
    doc.set("v1", rgb=(0.3, 0.1, 0.1))
    edited = palette4d.bake(doc, frame=0, path=tmp_path / "edited.cube", size=5)
    doc.undo()
    plain = palette4d.bake(doc, frame=0, path=tmp_path / "plain.cube", size=5)
    assert (edited.identity, plain.identity) == (False, True)
    assert (tmp_path / "edited.cube").read_text() != (tmp_path / "plain.cube").read_text()
    with pytest.raises(palette4d.Palette4dError):
        palette4d.bake(doc, frame=99, path=tmp_path / "late.cube")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["edited.cube", "plain.cube"]


@pytest.mark.parametrize(
    "settings", [{"vertexes": 3}, {"vertices": -1}, {"method": "best"}, {"eta1": 2}]
)
def test_settings_that_do_not_exist_are_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(palette4d.Palette4dError):
        palette4d.analyze(np.zeros((2, 4, 4, 3)), **settings)


def test_every_setting_of_the_command_line_can_be_given(clip_folder: Path) -> None:
    doc = palette4d.analyze(
        clip_folder / "shot.####.png", frames="1-2", method="static", lambda_=20, threads=1
    )
    assert doc.fields()["quality"]["options"]["lambda"] == 20
    assert doc.fields()["quality"]["options"]["method"] == "static"
