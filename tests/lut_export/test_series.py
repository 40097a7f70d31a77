"""Dated series: names, index, resuming, what is never overwritten, frames where the edit turns."""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import PyOpenColorIO as ocio
import pytest
from numpy.typing import NDArray
from palette4d.lut_export import series
from palette4d.lut_export.frame_edit import frame_edit
from palette4d.lut_export.measured_write import BakeSettings
from palette4d.lut_export.series import Request, Series
from parity.cases import edited, split_merge_document

from palette4d import Palette4dError, _core
from palette4d.common.errors import WriteError
from palette4d.jobs.workers import Workers

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"
EDITED = GOLDEN / "v1_edited.p4d.json"


def options(*frames: int, **changes: object) -> Request:
    settings = BakeSettings(**{"size": 5, "format": "resolve_cube", **changes})  # type: ignore[arg-type]
    return Request(Path(), Path(), frames, settings)


def export(sidecar: Path, folder: Path, request: Request, jobs: int = 1) -> Series:
    one = replace(request, sidecar=sidecar, folder=folder)
    return series.export([one], Workers(jobs))[0]


def state(folder: Path) -> dict[str, tuple[bytes, int]]:
    """Content and time of change of every file."""
    return {p.name: (p.read_bytes(), p.stat().st_mtime_ns) for p in sorted(folder.iterdir())}


def test_files_and_index(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "luts"
    done = export(EDITED, folder, options(0, 4, 9))
    names = ["edited.0000.cube", "edited.0004.cube", "edited.0009.cube"]
    clip = _core.read_sidecar(str(EDITED)).clip
    names = [f"{clip['name']}.{frame:04d}.cube" for frame in (0, 4, 9)]
    index = f"{clip['name']}.series.json"
    assert sorted(p.name for p in folder.iterdir()) == sorted([*names, index])
    assert (done.baked, done.kept, done.failed) == ([0, 4, 9], [], {})
    document = json.loads((folder / index).read_text("utf-8"))
    assert document == done.document
    assert document["schema"] == "palette4d.series"
    assert document["sidecar"]["sha256"] == hashlib.sha256(EDITED.read_bytes()).hexdigest()
    assert [entry["file"] for entry in document["frames"]] == names
    for entry in document["frames"]:
        data = (folder / entry["file"]).read_bytes()
        assert hashlib.sha256(data).hexdigest() == entry["sha256"]
        assert entry["id"].encode() in data
        assert entry["size"] == 5
        assert entry["error"] == entry["grid"]["relative_largest"]


def test_a_series_is_the_grade_of_its_start(tmp_path: Path) -> None:
    sidecar = tmp_path / "s.p4d.json"
    sidecar.write_bytes(EDITED.read_bytes())
    export(sidecar, tmp_path / "whole", options(0, 4, 9))
    document = json.loads(EDITED.read_text("utf-8"))
    document["edits"]["vertices"] = []

    def edit(*_: int) -> None:
        sidecar.write_text(json.dumps(document), "utf-8")

    request = replace(options(0, 4, 9), sidecar=sidecar, folder=tmp_path / "edited")
    series.export([request], Workers(1), edit)
    luts = [
        {path.name: path.read_bytes() for path in (tmp_path / name).iterdir()}
        for name in ("whole", "edited")
    ]
    assert luts[0] == luts[1]


def test_each_file_is_the_edit_of_its_frame(warm_sidecar: Path, tmp_path: Path) -> None:
    document = json.loads(warm_sidecar.read_text("utf-8"))
    # Only the end is edited: the edit grows from frame 0 to 10.
    document["edits"]["vertices"] = document["edits"]["vertices"][8:]
    warm_sidecar.write_text(json.dumps(document), "utf-8")
    export(warm_sidecar, tmp_path / "l", options(0, 5, 10, format="clf"))
    sidecar = _core.read_sidecar(str(warm_sidecar))
    moved = []
    for frame in (0, 5, 10):
        colours = np.ones((1, 1, 3), dtype=np.float32)
        path = tmp_path / "l" / f"cube.{frame:04d}.clf"
        processor = ocio.Config.CreateRaw().getProcessor(ocio.FileTransform(src=str(path)))
        processor.getDefaultCPUProcessor().applyRGB(colours)
        want = frame_edit(sidecar, frame).exact(np.ones((1, 3)))
        np.testing.assert_allclose(colours[0], want, atol=1e-6)
        moved.append(1 - colours[0, 0, 2])
    assert moved[0] == 0
    assert 0 < moved[1] < moved[2]


@pytest.mark.usefixtures("full_grid")
def test_processes_write_the_same_bytes(tmp_path: Path) -> None:
    for jobs in (1, 2):
        export(EDITED, tmp_path / str(jobs), options(0, 9), jobs)
    one, two = ({n: data for n, (data, _) in state(tmp_path / j).items()} for j in "12")
    assert one == two


class TestResuming:
    def test_what_matches_is_left_alone(self, tmp_path: Path) -> None:
        export(EDITED, tmp_path, options(0, 4, 9))
        before = state(tmp_path)
        again = export(EDITED, tmp_path, options(0, 4, 9))
        assert (again.baked, again.kept) == ([], [0, 4, 9])
        assert state(tmp_path) == before

    def test_more_frames_join_the_index(self, tmp_path: Path) -> None:
        export(EDITED, tmp_path, options(0, 4))
        done = export(EDITED, tmp_path, options(4, 9))
        assert (done.baked, done.kept) == ([9], [4])
        assert [entry["frame"] for entry in done.document["frames"]] == [0, 4, 9]

    def test_a_missing_file_is_baked_again(self, tmp_path: Path) -> None:
        first = export(EDITED, tmp_path, options(0, 4))
        before = state(tmp_path)
        (tmp_path / first.document["frames"][1]["file"]).unlink()
        done = export(EDITED, tmp_path, options(0, 4))
        assert (done.baked, done.kept) == ([4], [0])
        after = state(tmp_path)
        assert {n: d for n, (d, _) in after.items()} == {n: d for n, (d, _) in before.items()}

    def test_a_changed_file_is_not_replaced_unasked(self, tmp_path: Path) -> None:
        first = export(EDITED, tmp_path, options(0, 4))
        mine = tmp_path / first.document["frames"][1]["file"]
        mine.write_text("mine", "utf-8")
        before = state(tmp_path)
        with pytest.raises(Palette4dError, match="force=True"):
            export(EDITED, tmp_path, options(0, 4, 9))
        assert state(tmp_path) == before
        done = export(EDITED, tmp_path, replace(options(0, 4), force=True))
        assert (done.baked, done.kept) == ([4], [0])
        assert "LUT_3D_SIZE" in mine.read_text("utf-8")

    def test_an_unlisted_file_of_the_same_bytes_is_taken_over(self, tmp_path: Path) -> None:
        """As after an export that was killed before it wrote its index."""
        first = export(EDITED, tmp_path, options(0, 4))
        first.index.unlink()
        before = {n: s for n, s in state(tmp_path).items() if n.endswith(".cube")}
        done = export(EDITED, tmp_path, options(0, 4))
        assert done.baked == [0, 4]
        assert {n: s for n, s in state(tmp_path).items() if n.endswith(".cube")} == before

    def test_an_unlisted_other_file_fails_alone(self, tmp_path: Path) -> None:
        name = _core.read_sidecar(str(EDITED)).clip["name"]
        mine = tmp_path / f"{name}.0004.cube"
        mine.write_text("mine", "utf-8")
        done = export(EDITED, tmp_path, options(0, 4, 9))
        assert done.baked == [0, 9]
        assert list(done.failed) == [4]
        assert "found a file there" in done.failed[4]
        assert mine.read_text("utf-8") == "mine"

    @pytest.mark.parametrize(
        ("change", "word"), [({"size": 6}, "other options"), ({"strength": 0.5}, "other options")]
    )
    def test_other_options_are_refused(
        self, change: dict[str, object], word: str, tmp_path: Path
    ) -> None:
        export(EDITED, tmp_path, options(0, 4))
        before = state(tmp_path)
        with pytest.raises(Palette4dError, match=word):
            export(EDITED, tmp_path, options(0, 4, **change))
        assert state(tmp_path) == before

    def test_a_config_that_changed_under_its_name_is_refused_and_forced(
        self, tmp_path: Path
    ) -> None:
        config, folder = tmp_path / "own.ocio", tmp_path / "l"

        def write(gain: float) -> None:
            made = ocio.Config.CreateFromBuiltinConfig("ocio://studio-config-latest")
            scale = ocio.MatrixTransform(np.diag([gain, gain, gain, 1]).ravel())
            space = made.getColorSpace("ACEScg")
            steps = [space.getTransform(ocio.COLORSPACE_DIR_TO_REFERENCE), scale]
            group = ocio.GroupTransform(steps)
            made.addColorSpace(
                ocio.ColorSpace(name="mine", encoding="scene-linear", toReference=group)
            )
            config.write_text(made.serialize(), "utf-8")

        request = options(0, 4, space="mine", ocio_config=str(config))
        write(1)
        export(EDITED, folder, request)
        assert export(EDITED, folder, request).kept == [0, 4]
        before = state(folder)
        write(2)
        with pytest.raises(Palette4dError, match="other options"):
            export(EDITED, folder, request)
        assert state(folder) == before
        assert export(EDITED, folder, replace(request, force=True)).baked == [0, 4]
        assert all(state(folder)[name][0] != data for name, (data, _) in before.items())

    def test_another_edit_is_refused_and_forced(
        self, write_sidecar: Callable[..., Path], tmp_path: Path
    ) -> None:
        folder = tmp_path / "l"
        export(write_sidecar(), folder, options(0, 4, 8))
        sidecar = write_sidecar(lambda c: (c[0] * 0.9, c[1], c[2]))
        with pytest.raises(Palette4dError, match="another state of the sidecar"):
            export(sidecar, folder, options(0, 4))
        done = export(sidecar, folder, replace(options(0, 4), force=True))
        assert done.baked == [0, 4]
        # The third file is still there, but of the other edit: it is not listed.
        assert [entry["frame"] for entry in done.document["frames"]] == [0, 4]

    @pytest.mark.parametrize(
        "text",
        [
            "",
            "{}",
            '{"frames": 3}',
            "[]",
            '{"frames": [{}]}',
            pytest.param("[" * 100_000, id="deep"),
        ],
    )
    def test_a_broken_index(self, text: str, tmp_path: Path) -> None:
        done = export(EDITED, tmp_path, options(0))
        done.index.write_text(text, "utf-8")
        with pytest.raises(Palette4dError, match="no index of a series that can be read"):
            export(EDITED, tmp_path, options(0))
        assert done.index.read_text("utf-8") == text
        assert export(EDITED, tmp_path, replace(options(0), force=True)).baked == [0]


class TestInterrupted:
    PROGRAM = """
import sys
from palette4d.cli.main import main
if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
"""

    def start(self, tmp_path: Path, *words: str) -> subprocess.Popen[str]:
        program = tmp_path / "program.py"
        program.write_text(self.PROGRAM, "utf-8")
        return subprocess.Popen(
            [sys.executable, str(program), "export", str(EDITED), "--every", "4", *words],
            stderr=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    @pytest.mark.skipif(os.name == "nt", reason="Windows sends a program no such signal")
    @pytest.mark.parametrize("jobs", [pytest.param("1", marks=pytest.mark.slow), "2"])
    def test_ctrl_c_leaves_whole_files_and_an_index(self, jobs: str, tmp_path: Path) -> None:
        folder = tmp_path / "l"
        process = self.start(tmp_path, "-o", str(folder), "--jobs", jobs, "--size", "21")
        deadline = time.monotonic() + 120
        # The second file is there once the first was taken note of.
        while len([p for p in folder.glob("*.cube") if p.name[0] != "."]) < 2:
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < deadline
            time.sleep(0.02)
        # As a terminal does: to every process of the group.
        os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=120)
        assert process.returncode == 130, (out, err)
        assert "palette4d: interrupted" in err
        assert "Traceback" not in err
        (index,) = folder.glob("*.series.json")
        entries = json.loads(index.read_text("utf-8"))["frames"]
        assert 0 < len(entries) < 6
        there = {path.name for path in folder.iterdir()} - {index.name}
        assert {entry["file"] for entry in entries} <= there
        for name in there:
            assert name.endswith(".cube"), name
            assert not name.startswith(".")
        for entry in entries:
            data = (folder / entry["file"]).read_bytes()
            assert hashlib.sha256(data).hexdigest() == entry["sha256"]

        again = self.start(tmp_path, "-o", str(folder), "--size", "21", "--jobs", "1", "--json")
        out, err = again.communicate(timeout=300)
        assert again.returncode == 0, err
        assert [entry["frame"] for entry in json.loads(out)["frames"]] == [0, 4, 8, 12, 16, 20]


def test_a_disk_that_fills_up_ends_it_at_once(tmp_path: Path) -> None:
    """From the first frame on this process may write small files only; its workers may not know."""
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    told: list[int] = []

    def fill(done: int, total: int) -> None:
        told.append(done)
        if done:
            resource.setrlimit(resource.RLIMIT_FSIZE, (3000, limits[1]))

    wanted = replace(options(0, 2, 4, 6, 8, 10), sidecar=EDITED, folder=tmp_path / "l")
    try:
        with pytest.raises(WriteError, match=r"File too large; expected .* goes on from them"):
            series.export([wanted], Workers(2), fill)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert max(told) == 1  # no other frame was tried
    (index,) = (tmp_path / "l").glob("*.json")
    entries = json.loads(index.read_text("utf-8"))["frames"]
    assert {e["file"] for e in entries} | {index.name} == set(state(tmp_path / "l"))
    done = export(EDITED, tmp_path / "l", wanted)
    assert (len(done.kept), len(done.baked)) == (1, 5)


class TestStops:
    def test_where_the_edit_turns(self) -> None:
        sidecar = _core.read_sidecar(str(EDITED))
        times = series.stops(sidecar)
        document = json.loads(EDITED.read_text("utf-8"))
        for stop in document["edits"]["stops"]:
            assert any(abs(t - stop["frame"]) <= 0.5 for t in times)
        assert list(times) == sorted(set(times))
        # Between them the replacement of a palette colour moves along a line.
        polytope, edits = sidecar.polytope, sidecar.edits
        assert (times[0], times[-1]) >= (polytope.first_frame, 0)
        assert len(edits.vertex_rgb) + len(edits.stops) > 0

    def test_an_edit_in_the_middle(self, write_sidecar: Callable[..., Path]) -> None:
        path = write_sidecar()
        document = json.loads(path.read_text("utf-8"))
        document["edits"]["stops"] = [
            {"id": "s1", "edge": "e8", "frame": 4.4, "rgb": [1, 0.8, 0.5]}
        ]
        path.write_text(json.dumps(document), "utf-8")
        assert series.stops(_core.read_sidecar(str(path))) == (0, 4, 10)

    @pytest.mark.parametrize("ramp", ["linear", "smooth", "hold"])
    def test_between_them_an_edit_is_a_line(self, ramp: str) -> None:
        stops = [("ea", 9, (0.0, 0.0, 1.0)), ("ea", 21, (0.5, 1.0, 0.0))]
        document = edited(split_merge_document(), {"a1": (1.0, 1.0, 0.0)}, stops, ramp=ramp)
        sidecar = _core.parse_sidecar(json.dumps(document))
        times = series.stops(sidecar)
        assert {0, 9, 21, 30} <= set(times)
        assert len(times) < (31 if ramp == "smooth" else 15)

        def moved(frame: float) -> NDArray[np.float64]:
            cut = _core.slice_at(sidecar.polytope, frame)
            return (_core.edited_colours(sidecar.polytope, sidecar.edits, cut) - cut.rgb)[0]

        for start, end in itertools.pairwise(times):
            for frame in range(start, end):
                share = (frame - start) / (end - start)
                line = moved(start) + share * (moved(end) - moved(start))
                np.testing.assert_allclose(moved(frame), line, rtol=0, atol=0.01)

    def test_picks_have_the_times_of_their_paths_and_ramps(self) -> None:
        document = edited(split_merge_document(), {}, [])
        path = [{"frame": frame, "rgb": [0.5, 0.5, 0.5]} for frame in (12, 18)]
        pick = {"id": "p1", "kind": "pick", "frame": 15, "rgb": [0.5, 0.5, 0.5], "path": path}
        pick |= {"to": [0.6, 0.5, 0.5], "from": 10, "fade": 4, "until": 20}
        document["edits"]["picks"] = [pick, pick | {"id": "p2", "frame": 3, "enabled": False}]
        times = series.stops(_core.parse_sidecar(json.dumps(document)))
        assert times == (6, 10, 12, 15, 18, 20, 24)

    def test_nothing_edited(self, write_sidecar: Callable[..., Path]) -> None:
        with pytest.raises(Palette4dError, match="nothing is edited"):
            series.stops(_core.read_sidecar(str(write_sidecar())))


def test_every(write_sidecar: Callable[..., Path]) -> None:
    sidecar = _core.read_sidecar(str(write_sidecar()))
    assert series.every(sidecar, 4) == (0, 4, 8)
    assert series.every(sidecar, 100) == (0,)


def test_frames_outside(tmp_path: Path) -> None:
    with pytest.raises(Palette4dError, match=r"frame 21 is outside.*as 1 more are.*to 20"):
        export(EDITED, tmp_path / "l", options(3, 21, 22))
    assert not (tmp_path / "l").exists()


def test_negative_frames_and_names() -> None:
    assert series.file_name("a", -5, 4, ".clf") == "a.-005.clf"
    assert series.file_name("a", 123456, 4, ".clf") == "a.123456.clf"
    assert series.file_name("a", -5, 0, ".clf") == "a.-5.clf"


def test_a_name_with_a_slash(tmp_path: Path) -> None:
    with pytest.raises(Palette4dError, match="expected letters"):
        export(EDITED, tmp_path, replace(options(0), name="../x"))
    assert not list(tmp_path.iterdir())


def test_a_frame_that_misses_its_limit_fails_alone(tmp_path: Path) -> None:
    """v1_edited is not edited in its first frames: they hold any limit."""
    done = export(EDITED, tmp_path, options(0, 4, format="cc", max_error=1e-9))
    assert done.failed
    assert all("stays above the limit" in text for text in done.failed.values())
    listed = [entry["frame"] for entry in done.document["frames"]]
    assert listed == [frame for frame in (0, 4) if frame not in done.failed]
