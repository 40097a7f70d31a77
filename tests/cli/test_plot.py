"""The verb plot: pictures of many kinds of sidecars, and what they must show."""

from __future__ import annotations

import itertools
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from edits import sequence
from matplotlib.backends.backend_agg import FigureCanvasAgg
from numpy.typing import NDArray

from palette4d import _core
from palette4d.cli.main import main
from palette4d.grade.clip_colours import Share
from palette4d.grade.document import Document
from palette4d.plotting import page, style
from palette4d.plotting.rows import PlottedPalette, arrange

GOLDEN = Path(__file__).resolve().parent.parent / "golden" / "sidecars"
ALL_GOLDEN = sorted(GOLDEN.glob("v*_*.p4d.json"))


def pixels(path: Path) -> NDArray[np.uint8]:
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def holds(image: NDArray[np.uint8], rgb: list[float], least: int) -> bool:
    """Whether at least so many pixels have a colour, to a rounding of 8 bits."""
    wanted = np.round(np.clip(rgb, 0, 1) * 255)
    near = (np.abs(image.astype(int) - wanted) <= 1).all(axis=-1)
    return int(near.sum()) >= least


def tetrahedron_through(blocks: int) -> dict[str, Any]:
    """A sidecar with many blocks: vertices at every block's first and last frame."""
    document: dict[str, Any] = json.loads(
        (GOLDEN / "v1_tetrahedron.p4d.json").read_text(encoding="utf-8")
    )
    faces = document["polytope"]["blocks"][0]["faces"]
    base = [[0.05, 0.05, 0.05], [0.9, 0.15, 0.1], [0.2, 0.8, 0.1], [0.3, 0.4, 0.95]]
    times = sorted(t for k in range(blocks) for t in (5 * k, 5 * k + 4))
    polytope: dict[str, Any] = {"vertices": [], "edges": [], "blocks": [], "transitions": []}
    for time in times:
        for rgb in base:
            number = len(polytope["vertices"]) + 1
            polytope["vertices"].append({"id": f"v{number}", "frame": time, "rgb": rgb})
    for k in range(len(times) - 1):
        tracks = [[f"v{4 * k + c + 1}", f"v{4 * k + c + 5}"] for c in range(4)]
        for start, end in tracks:
            number = len(polytope["edges"]) + 1
            polytope["edges"].append({"id": f"e{number}", "from": start, "to": end})
        if k % 2:
            polytope["transitions"].append({"tracks": tracks, "faces": faces})
        else:
            polytope["blocks"].append(
                {"first": times[k], "last": times[k + 1], "tracks": tracks, "faces": faces}
            )
    document["polytope"] = polytope
    document["clip"]["frames"] = {"first": 0, "last": times[-1], "step": 1, "skipped": []}
    document["clip"]["name"] = "\u5b63\u7bc0 $x_1$ \u2744"  # no glyphs for some; no mathematics
    return document


@pytest.mark.parametrize("sidecar", ALL_GOLDEN, ids=lambda path: path.name.split(".")[0])
def test_every_golden_sidecar_gives_a_picture(sidecar: Path, tmp_path: Path) -> None:
    out = tmp_path / "palette.png"
    assert main(["plot", str(sidecar), "-o", str(out), "--width", "800"]) == 0
    image = pixels(out)
    assert image.shape[1] == 800
    assert image.shape[0] > 250
    loaded = _core.read_sidecar(str(sidecar))
    vertices = np.asarray(loaded.polytope.vertices)
    for rgb in style.shown(vertices[:, :3], str(loaded.clip["encoding"])):
        assert holds(image, list(rgb), 20)
    assert [path.name for path in tmp_path.iterdir()] == ["palette.png"]


def test_the_edited_colours_are_seen(tmp_path: Path) -> None:
    document = json.loads((GOLDEN / "v1_edited.p4d.json").read_text(encoding="utf-8"))
    plain = dict(document, edits={"vertices": [], "stops": []})
    sidecar = tmp_path / "a.p4d.json"
    images = []
    vertex = document["polytope"]["vertices"][2]["id"]
    new_vertex, new_stop = [0.93, 0.37, 0.71], [0.61, 0.29, 0.83]
    edited = dict(
        document,
        edits={
            "vertices": [{"vertex": vertex, "rgb": new_vertex}],
            "stops": [{"id": "s7", "edge": "e2", "frame": 4.5, "rgb": new_stop}],
        },
    )
    for content in (plain, edited):
        sidecar.write_text(json.dumps(content), encoding="utf-8")
        out = tmp_path / "a.png"
        assert main(["plot", str(sidecar), "-o", str(out), "--width", "1200", "--force"]) == 0
        images.append(pixels(out))
    for colour in (new_vertex, new_stop):
        assert not holds(images[0], colour, 1)
        assert holds(images[1], colour, 25)


def test_upper_half_before_lower_half_after(tmp_path: Path) -> None:
    document = json.loads((GOLDEN / "v1_edited.p4d.json").read_text(encoding="utf-8"))
    before, after = [0.31, 0.62, 0.47], [0.93, 0.37, 0.71]
    document["polytope"]["vertices"][0]["rgb"] = before
    document["edits"] = {"vertices": [{"vertex": "v1", "rgb": after}], "stops": []}
    sidecar, out = tmp_path / "a.p4d.json", tmp_path / "a.png"
    sidecar.write_text(json.dumps(document), encoding="utf-8")
    # Only the timeline: the polyhedra of another frame do not hold these colours.
    assert main(["plot", str(sidecar), "-o", str(out), "--frames", "20", "--width", "1600"]) == 0
    image = pixels(out).astype(int)
    rows = [
        np.flatnonzero((np.abs(image - np.round(np.array(c) * 255)) <= 1).all(axis=-1).any(axis=1))
        for c in (before, after)
    ]
    assert len(rows[0]) > 4
    assert len(rows[1]) > 4
    assert rows[0].max() < rows[1].min()


def test_svg_holds_the_ids_as_text(tmp_path: Path) -> None:
    out = tmp_path / "a.svg"
    assert main(["plot", str(GOLDEN / "v1_edited.p4d.json"), "-o", str(out)]) == 0
    text = out.read_text(encoding="utf-8")
    loaded = _core.read_sidecar(str(GOLDEN / "v1_edited.p4d.json"))
    for name in loaded.polytope.vertex_ids:
        assert f'id="vertex-{name}"' in text
        assert f">{name} " in text or f">{name}</text>" in text
    for stop in loaded.edits.stops:
        assert f'id="stop-{stop["id"]}"' in text


def test_pdf_and_reproducible_pictures(tmp_path: Path) -> None:
    sidecar = str(GOLDEN / "v1_tetrahedron.p4d.json")
    for extension in ("pdf", "svg", "png"):
        outs = [tmp_path / f"{k}.{extension}" for k in range(2)]
        for out in outs:
            words = ["-o", str(out), "--width", "400"]
            assert main(["plot", sidecar, *words]) == 0
        assert outs[0].read_bytes() == outs[1].read_bytes()
    assert (tmp_path / "0.pdf").read_bytes().startswith(b"%PDF")


def test_many_blocks_and_a_name_the_font_lacks(tmp_path: Path) -> None:
    sidecar = tmp_path / "many.p4d.json"
    sidecar.write_text(json.dumps(tetrahedron_through(30)), encoding="utf-8")
    out = tmp_path / "many.png"
    assert main(["plot", str(sidecar), "-o", str(out), "--width", "900"]) == 0
    assert pixels(out).shape[1] == 900


def test_frames_and_clip_show_the_pictures(tmp_path: Path) -> None:
    import OpenImageIO as oiio

    folder = tmp_path / "clip"
    folder.mkdir()
    colour = [0.42, 0.23, 0.35]
    for frame in range(21):
        output = oiio.ImageOutput.create("frame.png")
        assert output.open(str(folder / f"f.{frame:04d}.png"), oiio.ImageSpec(64, 36, 3, "uint8"))
        assert output.write_image(np.full((36, 64, 3), colour, dtype=np.float32))
        output.close()
    out = tmp_path / "a.png"
    arguments = ["plot", str(GOLDEN / "v1_split.p4d.json"), "-o", str(out), "--width", "800"]
    assert main([*arguments, "--frames", "3,12.5"]) == 0
    without = pixels(out)
    assert not holds(without, colour, 30)
    assert (
        main([*arguments, "--frames", "3,12.5", "--force", "--clip", f"{folder}/f.####.png"]) == 0
    )
    with_clip = pixels(out)
    assert with_clip.shape[0] > without.shape[0]
    # Two moments; nothing is edited, so there is nothing to show after: two thumbnails.
    thumbnail = (800 / 1200 * 420) * (800 / 1200 * 420 * 36 / 64)
    assert holds(with_clip, colour, int(1.9 * thumbnail))
    assert not holds(with_clip, colour, int(2.5 * thumbnail))

    # An edit that does not reach these frames still gets its row: before and after are the same.
    document = json.loads((GOLDEN / "v1_split.p4d.json").read_text(encoding="utf-8"))
    unmoved = document["polytope"]["vertices"][0]
    document["edits"] = {
        "vertices": [{"vertex": unmoved["id"], "rgb": unmoved["rgb"]}],
        "stops": [],
    }
    sidecar = tmp_path / "edited.p4d.json"
    sidecar.write_text(json.dumps(document), encoding="utf-8")
    arguments[1] = str(sidecar)
    assert (
        main([*arguments, "--frames", "3,12.5", "--force", "--clip", f"{folder}/f.####.png"]) == 0
    )
    assert holds(pixels(out), colour, int(3.8 * thumbnail))


def test_a_note_says_that_the_clip_is_not_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "a.png"
    assert main(["plot", str(GOLDEN / "v1_split.p4d.json"), "-o", str(out), "--width", "400"]) == 0
    printed = capsys.readouterr()
    assert printed.err.startswith("palette4d: note: the clip's pixels could not be read")
    assert "--clip" in printed.err
    assert printed.out.strip() == str(out)


def drawn(document: dict[str, Any]) -> tuple[Any, Any]:
    """The page's axes and renderer; an SVG's ids name the rims of the discs."""
    sidecar = _core.parse_sidecar(json.dumps(document))
    canvas = FigureCanvasAgg(page.build(sidecar, []))
    return canvas.figure.axes[0], canvas.get_renderer()


@pytest.mark.parametrize("blocks", [2, 12])
def test_close_discs_make_way_and_ids_do_not_overlap(blocks: int) -> None:
    axes, renderer = drawn(tetrahedron_through(blocks))
    rims = [line for line in axes.lines if str(line.get_gid()).startswith("vertex-")]
    assert len(rims) == 8 * blocks
    for y in {line.get_ydata()[0] for line in rims}:
        row = sorted((r.get_xdata()[0], r.get_markersize() / 2) for r in rims if y in r.get_ydata())
        for (x, radius), (after, other) in itertools.pairwise(row):
            assert after - x >= radius + other
        assert min(radius for _, radius in row) >= 1.6
    ids = [t for t in axes.texts if t.get_text().startswith("v")]
    assert len(ids) >= 8
    boxes = [text.get_window_extent(renderer).padded(-1) for text in ids]
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))


@pytest.mark.parametrize("name", ["v1_split", "v1_merge", "v1_edited"])
def test_polyhedra_and_rows_have_the_ids_of_tracks(name: str) -> None:
    document = Document.load(GOLDEN / f"{name}.p4d.json")
    tracks = {t.name: {*t.vertices, *t.edges} for t in document.grade.tracks}
    for frame in (0, 4.5, 9.5, 15, 20):
        column = page.column(document.grade.core, frame, None)
        palette = document.grade.palette(frame)
        assert len(set(column.ids)) == len(palette.ids)  # every disc has a label of its own
        for track, id_, rgb, shown in zip(
            column.ids, palette.ids, palette.rgb, column.shape.rgb, strict=True
        ):
            assert id_ in tracks[track]
            np.testing.assert_allclose(rgb, shown)
    columns = [page.column(document.grade.core, 4.5, None)]
    shares = {track: Share(0.25, 0.5, 4.0) for track in tracks}
    figure = page.build(document.grade.core, columns, shares=shares)
    texts = [text.get_text() for text in figure.axes[0].texts]
    for track in tracks:  # in its row, and where it is beside its disc
        assert any(track in text.split() for text in texts)
    assert sum("25 %" in text for text in texts) == len(tracks)
    assert sum("most at 4: 50 %" in text for text in texts) == len(tracks)
    renderer = FigureCanvasAgg(figure).get_renderer()
    for text in figure.axes[0].texts:
        box = text.get_window_extent(renderer)
        assert figure.bbox.x0 <= box.x0 <= box.x1 <= figure.bbox.x1, text.get_text()
    for id_ in columns[0].ids:
        assert texts.count(id_) >= 2


def test_pictures_and_solids_have_their_frame_numbers() -> None:
    sidecar = _core.read_sidecar(str(GOLDEN / "v1_split.p4d.json"))
    image = np.full((9, 16, 3), 0.4, np.float32)
    for picture, times in ((None, 1), (image, 2)):
        axes = page.build(sidecar, [page.column(sidecar, at, picture) for at in (3, 12.5)]).axes[0]
        texts = [text.get_text() for text in axes.texts]
        assert [texts.count("frame 3"), texts.count("frame 12.5")] == [times, times]


def test_the_legend_tells_what_is_there() -> None:
    texts = []
    for name in ("v1_tetrahedron", "v1_edited"):
        sidecar = _core.read_sidecar(str(GOLDEN / f"{name}.p4d.json"))
        axes = page.build(sidecar, [page.column(sidecar, 1, None)]).axes[0]
        legend = [text.get_text() for text in axes.get_legend().get_texts()]
        texts.append(" ".join([*legend, *(text.get_text() for text in axes.texts)]))
    for word in ("edited", "stop", "lock", "arrows"):
        assert word not in texts[0]
        assert word in texts[1]
    assert "RGB cube" in texts[0]
    assert "pixels" not in texts[1]


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["-o", "a.jpg"], ".png, .svg, .pdf"),
        (["-o", "a.png", "--frames", "99"], "from 0 to 20"),
        (["-o", "none/a.png"], "no folder"),
        (["-o", "a.png", "--clip", "nowhere.####.png"], "nowhere"),
    ],
)
def test_refusals(
    arguments: list[str],
    word: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["plot", str(GOLDEN / "v1_split.p4d.json"), *arguments]) == 1
    message = capsys.readouterr().err
    assert message.startswith("palette4d: error: ")
    assert word in message
    assert list(tmp_path.iterdir()) == []


def test_existing_picture_needs_force(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "a.png"
    out.write_bytes(b"mine")
    assert main(["plot", str(GOLDEN / "v1_split.p4d.json"), "-o", str(out)]) == 1
    assert "--force" in capsys.readouterr().err
    assert out.read_bytes() == b"mine"


@pytest.mark.parametrize("name", ["v1_split", "v1_merge"])
def test_a_fork_is_a_chain_of_its_own(name: str) -> None:
    palette = PlottedPalette.of(_core.read_sidecar(str(GOLDEN / f"{name}.p4d.json")))
    rows = arrange(palette.frames, palette.rgb, palette.edges)
    # Four colours on one side, five on the other: one fork.
    assert len(rows.chains) == 5
    assert rows.count == 5
    placed = [v for chain in rows.chains for v in chain.vertices]
    assert sorted(placed) == list(range(len(palette.ids)))
    assert sorted(e for chain in rows.chains for e in chain.edges) == list(
        range(len(palette.edges))
    )
    forks = [
        abs(int(rows.row[rows.vertex_chain[v]]) - int(rows.row[rows.edge_chain[e]]))
        for e, ends in enumerate(palette.edges)
        for v in ends
        if rows.vertex_chain[v] != rows.edge_chain[e]
    ]
    assert forks == [1]  # beside the row it leaves or joins


def test_chains_that_never_meet_share_a_row() -> None:
    # a: 0..100; b: 0..20 joins a at 20; c leaves a at 60.
    frames = np.array([0.0, 0.0, 20.0, 60.0, 100.0, 100.0])
    rgb = np.array([[0.5] * 3, [0.6] * 3, [0.5] * 3, [0.5] * 3, [0.5] * 3, [0.6] * 3])
    rows = arrange(frames, rgb, [(0, 2), (1, 2), (2, 3), (3, 4), (3, 5)])
    assert len(rows.chains) == 3
    assert rows.count == 2


def test_versions_are_drawn_and_compared(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "clip.p4d.json"
    path.write_bytes((GOLDEN / "v1_split.p4d.json").read_bytes())
    red, blue = [0.93, 0.07, 0.21], [0.11, 0.23, 0.97]
    for name, colour in (("red", red), ("blue", blue)):
        rgb = ",".join(map(str, colour))
        assert main(["edit", str(path), "set", "v1", "--rgb", rgb]) == 0
        assert main(["edit", str(path), "version", "save", name]) == 0
    assert main(["edit", str(path), "reset"]) == 0

    def drawn(*words: str) -> tuple[bool, bool]:
        out = tmp_path / "palette.png"
        words = ("plot", str(path), "-o", str(out), "--force", "--width", "800", *words)
        assert main([*words]) == 0
        return holds(pixels(out), red, 40), holds(pixels(out), blue, 40)

    assert drawn() == (False, False)
    assert drawn("--version", "red") == (True, False)
    assert drawn("--compare", "red,blue") == (True, True)
    assert drawn("--compare", "blue") == (False, True)
    assert main(["plot", str(path), "-o", str(tmp_path / "a.png"), "--compare", "green,red"]) == 1
    assert "'blue', 'red'" in capsys.readouterr().err
    for verb in (["bake", str(path), "--frame", "0", "-o"], ["render", str(path), "clip", "-o"]):
        assert main([*verb, str(tmp_path / "a.cube"), "--version", "green"]) == 1
        assert "'blue', 'red'" in capsys.readouterr().err
    cube = tmp_path / "a.cube"
    for words in ([], ["--version", "red"]):
        assert main(["bake", str(path), "--frame", "0", "-o", str(cube), "--force", *words]) == 0
        assert ("nothing is edited" in capsys.readouterr().out) == (not words)


def test_settings_of_the_working_folder_are_not_read(tmp_path: Path) -> None:
    """A clip's folder may be a stranger's."""
    (tmp_path / "matplotlibrc").write_text("no.such.setting: 1\nbackend: module://stranger\n")
    words = ["plot", str(GOLDEN / "v1_tetrahedron.p4d.json"), "-o", "plot.svg"]
    run = subprocess.run(
        [sys.executable, "-P", "-m", "palette4d", *words],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert "matplotlibrc" not in run.stderr
    assert "stranger" not in run.stderr
    assert (tmp_path / "plot.svg").is_file()


def test_a_backend_that_does_not_exist_and_no_place_for_fonts(tmp_path: Path) -> None:
    (tmp_path / "tmp").mkdir()
    (tmp_path / "file").touch()
    environment = {
        **os.environ,
        "MPLBACKEND": "rubbish",
        "MPLCONFIGDIR": str(tmp_path / "file" / "config"),
        "TMPDIR": str(tmp_path / "tmp"),
    }
    sidecar, out = GOLDEN / "v1_tetrahedron.p4d.json", tmp_path / "out.png"
    done = subprocess.run(
        [sys.executable, "-P", "-m", "palette4d", "plot", str(sidecar), "-o", str(out)],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert out.is_file()
    assert not list((tmp_path / "tmp").iterdir())


def test_what_a_picture_shows_is_not_replaced_by_it(tmp_path: Path) -> None:
    clip, sidecar = tmp_path / "clip", tmp_path / "named.svg"
    clip.mkdir()
    pattern = sequence(clip, "frame", 0, 4)
    shutil.copyfile(GOLDEN / "v1_edited.p4d.json", sidecar)
    frame = clip / "frame.0002.png"
    before = frame.read_bytes(), sidecar.read_bytes()
    words = ["plot", str(sidecar), "--clip", str(pattern), "--force", "-o"]
    assert main([*words, str(frame)]) == 1
    assert main([*words, str(sidecar)]) == 1
    assert (frame.read_bytes(), sidecar.read_bytes()) == before
    assert main([*words, str(clip / "other.png"), "--width", "400"]) == 0
