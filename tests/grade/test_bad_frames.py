"""What a render shows for missing and unreadable frames; ffprobe-like counts by PyAV."""

from __future__ import annotations

import json
import os
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from clip_files import TimeCode, write_image, write_movie

from palette4d.cli import main
from palette4d.common.errors import Palette4dError
from palette4d.grade.document import Document
from palette4d.grade.picks import Area
from palette4d.grade.rendering import render
from palette4d.media.clip import open_clip
from palette4d.media.timecode import TIMECODE, start_timecode

PLAIN = Path(__file__).resolve().parents[1] / "golden" / "sidecars" / "v1_edited.p4d.json"


def grey(level: int) -> np.ndarray:
    return np.full((16, 24, 3), level, np.uint8)


def sequence(folder: Path, frames, broken=()) -> str:
    """Grey frames, lighter by 10 each; the broken ones hold no picture."""
    for frame in frames:
        write_image(folder / f"g.{frame:04d}.png", grey(10 * frame))
    for frame in broken:
        (folder / f"g.{frame:04d}.png").write_bytes(b"no picture")
    return str(folder / "g.####.png")


def timed(folder: Path, frames, extension: str, further: bool = False) -> str:
    """Frames of which frame 1 has the timecode 00:00:00:21."""
    for frame in frames:
        pixels = np.full((16, 24, 4 if further else 3), 0.1 * frame, np.float32)
        if extension == "dpx":
            pixels = (pixels * 65535).astype(np.uint16)
        at = 20 + frame
        code = at // 24 << 8 | at % 24 // 10 << 4 | at % 24 % 10
        names = {"names": ("R", "G", "B", "Z")} if further else {}
        path = folder / f"g.{frame}.{extension}"
        write_image(path, pixels, smpte__TimeCode=TimeCode(code), **names)
    return str(folder / f"g.#.{extension}")


def word(path: Path, frame: int) -> int:
    """The timecode of a file, its 32 bits."""
    (found,) = (v for n, _, v in open_clip(str(path)).load(frame).metadata if n == TIMECODE)
    return found[0]


def levels(path: str | Path) -> dict[int, int]:
    """The grey of each frame of a clip, in 8 bits."""
    clip = open_clip(str(path))
    return {frame: round(float(pixels.mean()) * 255) for frame, pixels in clip}


def count(path: Path) -> int:
    with av.open(str(path)) as movie:
        return sum(1 for _ in movie.decode(video=0))


NONE = {"strength": 0.0}


class TestFrames:
    """Sequences keep their numbers."""

    def test_the_frame_before_is_held(self, tmp_path: Path) -> None:
        clip = sequence(tmp_path / "in", [1, 2, 4, 5], broken=[3, 6])
        done = render(PLAIN, clip, tmp_path / "o.####.png", **NONE)
        assert levels(tmp_path / "o.####.png") == {1: 10, 2: 20, 3: 20, 4: 40, 5: 50, 6: 50}
        assert (done.filled, done.skipped) == ([3, 6], [3, 6])

    def test_several_in_a_row_and_the_first(self, tmp_path: Path) -> None:
        clip = sequence(tmp_path / "in", [3, 6], broken=[1])
        render(PLAIN, clip, tmp_path / "o.####.png", frames="1-6", **NONE)
        assert levels(tmp_path / "o.####.png") == {1: 30, 2: 30, 3: 30, 4: 30, 5: 30, 6: 60}

    def test_black(self, tmp_path: Path) -> None:
        clip = sequence(tmp_path / "in", [1, 2, 4])
        render(PLAIN, clip, tmp_path / "o.####.png", missing="black", frames="1-4", **NONE)
        assert levels(tmp_path / "o.####.png") == {1: 10, 2: 20, 3: 0, 4: 40}

    def test_an_error(self, tmp_path: Path) -> None:
        clip = sequence(tmp_path / "in", [1, 2, 4])
        with pytest.raises(Palette4dError, match="frame 3 missing"):
            render(PLAIN, clip, tmp_path / "o.####.png", missing="error", frames="1-4")

    def test_a_range_beyond_the_clip_is_no_gap(self, tmp_path: Path) -> None:
        clip = sequence(tmp_path / "in", [1, 2])
        with pytest.raises(Palette4dError, match="found no frames 3-4, before its first or behind"):
            render(PLAIN, clip, tmp_path / "o.####.png", frames="1-4")

    def test_only_bad_frames(self, tmp_path: Path) -> None:
        clip = sequence(tmp_path / "in", [1, 2], broken=[1, 2])
        with pytest.raises(Palette4dError, match="none readable"):
            render(PLAIN, clip, tmp_path / "o.####.png")

    @pytest.mark.parametrize("missing", ["hold", "black"])
    @pytest.mark.parametrize("extension", ["exr", "dpx"])
    def test_a_held_frame_has_its_own_timecode(
        self, tmp_path: Path, extension: str, missing: str
    ) -> None:
        clip = timed(tmp_path / "in", [1, 2, 4], extension)
        render(PLAIN, clip, tmp_path / f"o.#.{extension}", missing=missing, **NONE)
        assert [word(tmp_path / f"o.{i}.{extension}", i) for i in (2, 3, 4)] == [0x22, 0x23, 0x100]

    def test_a_held_frame_of_further_channels_has_its_own_timecode(self, tmp_path: Path) -> None:
        clip = timed(tmp_path / "in", [1, 2, 4], "exr", further=True)
        render(PLAIN, clip, tmp_path / "o.#.exr", **NONE)
        assert [word(tmp_path / f"o.{i}.exr", i) for i in (2, 3, 4)] == [0x22, 0x23, 0x100]

    @pytest.mark.parametrize(
        ("frames", "shown"),
        [("3", {3: 20}), ("3-4", {3: 20, 4: 40}), ("3-5x2", {3: 20, 5: 50}), ("6", {6: 50})],
    )
    def test_each_chunk_holds_the_same(self, tmp_path: Path, frames: str, shown) -> None:
        clip = sequence(tmp_path / "in", [1, 2, 4, 5, 7], broken=[6])
        done = render(PLAIN, clip, tmp_path / "o.####.png", frames=frames, **NONE)
        assert levels(tmp_path / "o.####.png") == shown
        assert set(done.skipped) <= set(shown)

    def test_the_first_of_a_chunk_of_a_movie(self, tmp_path: Path) -> None:
        clip = timed(tmp_path / "in", [1, 2, 4, 5], "dpx")
        render(PLAIN, clip, tmp_path / "o.mov", frames="3-5", **NONE)
        assert start_timecode(open_clip(str(tmp_path / "o.mov"))) == "00:00:00:23"


class TestMovies:
    """A movie has as many frames as the clip, so that nothing behind a gap comes early."""

    @pytest.mark.parametrize("words", [(), ("--skip-bad-frames",), ("--missing", "black")])
    def test_of_a_sequence(self, tmp_path: Path, words, capsys: pytest.CaptureFixture) -> None:
        clip = sequence(tmp_path / "in", [1, 2, 4, 5])
        out = tmp_path / "o.mov"
        assert (
            main.main(["render", str(PLAIN), clip, "-o", str(out), "--strength", "0", *words]) == 0
        )
        assert count(out) == 5
        found = levels(out)
        assert found[3] == pytest.approx(40, abs=1)
        assert found[2] == pytest.approx(0 if "black" in words else 20, abs=1)
        assert "unreadable frame 3" in capsys.readouterr().err

    def test_of_a_movie(self, tmp_path: Path) -> None:
        """A picture that cannot be decoded, in the middle of ProRes."""
        path = tmp_path / "in.mov"
        write_movie(
            path,
            "prores_ks",
            "yuv422p10le",
            [grey(40 * i) for i in range(1, 6)],
            "rgb24",
            rate=Fraction(24),
        )
        with av.open(str(path)) as movie:
            packets = [packet for packet in movie.demux(video=0) if packet.size]
            place, size = packets[2].pos, packets[2].size
        data = bytearray(path.read_bytes())
        data[place + 4 : place + size] = bytes(size - 4)
        path.write_bytes(data)
        done = render(PLAIN, path, tmp_path / "o.mov", **NONE)
        assert done.filled == [2]
        assert count(tmp_path / "o.mov") == 5
        found = levels(tmp_path / "o.mov")
        assert found[2] == found[1]
        assert found[3] > found[1] + 50


class TestAgain:
    """--skip-existing and --json."""

    def run(self, *words: object) -> int:
        return main.main(["render", *map(str, words), "--strength", "0"])

    def test_what_is_whole_stays(self, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
        clip = sequence(tmp_path / "in", [1, 2, 4])
        out = tmp_path / "o.####.png"
        assert self.run(PLAIN, clip, "-o", out, "--frames", "1-3", "--quiet") == 0
        write_image(tmp_path / "o.0001.png", grey(99))
        (tmp_path / "o.0004.png").touch()  # a program that was killed left it
        capsys.readouterr()
        words = [PLAIN, clip, "-o", out, "--skip-existing", "--json", "--frames", "1-4"]
        assert self.run(*words) == 0
        found = json.loads(capsys.readouterr().out)
        assert (found["frames"], found["kept"]) == ([4], [1, 2, 3])
        assert (found["filled"], found["skipped"]) == ([], [])
        assert [Path(file).name for file in found["files"]] == ["o.0004.png"]
        assert levels(out) == {1: 99, 2: 20, 3: 20, 4: 40}
        assert self.run(*words, "--skip-bad-frames") == 0
        said = capsys.readouterr()
        assert json.loads(said.out)["frames"] == []
        assert "frame 3" not in said.err

    @pytest.mark.parametrize("extension", ["png", "exr", "tif", "dpx", "jpg"])
    def test_damaged_frames_and_those_of_another_grade_are_rendered_again(
        self, tmp_path: Path, extension: str
    ) -> None:
        sidecar = tmp_path / "s.p4d.json"
        sidecar.write_bytes(PLAIN.read_bytes())
        clip = sequence(tmp_path / "in", [1, 2, 3, 4])
        out = tmp_path / f"o.#.{extension}"
        render(sidecar, clip, out, **NONE)
        whole = (tmp_path / f"o.1.{extension}").read_bytes()
        (tmp_path / f"o.1.{extension}").write_bytes(whole[:100])
        (tmp_path / f"o.2.{extension}").write_bytes(whole[: len(whole) // 2])
        write_image(tmp_path / "small.png", grey(1)[:8])
        render(sidecar, str(tmp_path / "small.png"), tmp_path / f"o.3.{extension}", force=True)
        told: list[tuple[int, int]] = []
        done = render(
            sidecar, clip, out, skip_existing=True, progress=lambda *n: told.append(n), **NONE
        )
        assert told == [(1, 3), (2, 3), (3, 3)]
        assert (done.frames, done.kept) == ([1, 2, 3], [4])
        assert any("3 damaged" in note for note in done.notes)
        assert (tmp_path / f"o.1.{extension}").stat().st_size == len(whole)  # EXR has its time
        assert render(sidecar, clip, out, skip_existing=True, **NONE).frames == []
        later = (tmp_path / f"o.2.{extension}").stat().st_mtime + 10
        os.utime(sidecar, (later, later))
        document = Document.load(sidecar)
        document.save_version("kept")
        document.save()
        assert render(sidecar, clip, out, skip_existing=True, **NONE).frames == []
        document.reset()
        done = render(document, clip, out, skip_existing=True, **NONE)  # whatever the file holds
        assert done.frames == [1, 2, 3, 4]
        assert any("4 of another grade" in note for note in done.notes)
        assert render(sidecar, clip, out, skip_existing=True, **NONE).frames == [1, 2, 3, 4]
        assert render(sidecar, clip, out, skip_existing=True, strength=1).frames == [1, 2, 3, 4]
        assert render(sidecar, clip, out, skip_existing=True, strength=np.float32(1)).frames == []

    @pytest.mark.parametrize("output", ["o.#.png", "o.mov"])
    def test_what_is_of_the_grade_before_an_edit_is_rendered_again(
        self, tmp_path: Path, output: str
    ) -> None:
        sidecar = tmp_path / "s.p4d.json"
        sidecar.write_bytes(PLAIN.read_bytes())
        clip = sequence(tmp_path / "in", [1, 2, 3])

        def edit(*_: int) -> None:
            document = Document.load(sidecar)
            document.reset()
            document.save()

        render(sidecar, clip, tmp_path / output, progress=edit, **NONE)
        assert render(sidecar, clip, tmp_path / output, skip_existing=True, **NONE).frames
        again = render(sidecar, clip, tmp_path / output, skip_existing=True, **NONE)
        assert again.frames == []

    def test_a_frame_that_came_late_takes_the_place_of_what_was_shown(self, tmp_path: Path) -> None:
        clip = sequence(tmp_path / "in", [1, 2, 4, 6], broken=[5])
        again: dict = {"skip_existing": True, **NONE}
        for output in ("o.####.png", "o.mov"):
            render(PLAIN, clip, tmp_path / output, **NONE)
            assert render(PLAIN, clip, tmp_path / output, **again).frames == []
        assert levels(tmp_path / "o.####.png")[3] == 20
        frames = tmp_path / "o.####.png"
        assert render(PLAIN, clip, frames, missing="black", **again).frames == [3, 5]
        assert render(PLAIN, clip, frames, **again).frames == [3, 5]
        sequence(tmp_path / "in", [3])
        assert render(PLAIN, clip, frames, **again).frames == [3]
        assert render(PLAIN, clip, tmp_path / "o.mov", **again).frames == [1, 2, 3, 4, 5, 6]
        sequence(tmp_path / "in", [5])
        assert render(PLAIN, clip, tmp_path / "o.mov", **again).frames == [1, 2, 3, 4, 5, 6]
        assert render(PLAIN, clip, frames, **again).frames == [5]
        assert render(PLAIN, clip, frames, **again).frames == []
        assert levels(frames) == {1: 10, 2: 20, 3: 30, 4: 40, 5: 50, 6: 60}

    def test_what_is_held_is_the_frame_before_as_it_is_now(self, tmp_path: Path) -> None:
        clip, out = sequence(tmp_path / "in", [1, 4]), tmp_path / "o.####.png"
        render(PLAIN, clip, out, **NONE)
        sequence(tmp_path / "in", [2])
        assert render(PLAIN, clip, out, skip_existing=True, **NONE).frames == [2, 3]
        assert levels(out) == {1: 10, 2: 20, 3: 20, 4: 40}

    def test_a_movie_of_other_frames_is_another(self, tmp_path: Path) -> None:
        clip, out = sequence(tmp_path / "in", [1, 2, 3, 4]), tmp_path / "o.mov"
        render(PLAIN, clip, out, frames="1-2", **NONE)
        assert render(PLAIN, clip, out, frames="3-4", skip_existing=True, **NONE).frames == [3, 4]

    def test_another_layer_is_another_picture(self, tmp_path: Path) -> None:
        names = ("R", "G", "B", "spec.R", "spec.G", "spec.B")
        pixels = np.repeat(np.float32([0.2, 0.6]), 3) * np.ones((16, 24, 1), np.float32)
        write_image(tmp_path / "c.0001.exr", pixels, names=names)
        clip, out = str(tmp_path / "c.0001.exr"), tmp_path / "o.####.png"
        render(PLAIN, clip, out, **NONE)
        spec = f"{clip}?layer=spec"
        assert render(PLAIN, spec, out, skip_existing=True, **NONE).frames == [1]
        assert levels(out) == {1: 153}

    def test_one_file_of_another_frame_is_rendered_again(self, tmp_path: Path) -> None:
        clip, out = sequence(tmp_path / "in", [1, 2, 3]), tmp_path / "one.png"
        kept = []
        for frame in ("2", "3", "3"):
            words = [PLAIN, clip, "-o", out, "--skip-existing", "--frames", frame]
            before = out.stat().st_ino if out.exists() else None
            assert self.run(*words) == 0
            kept.append(out.stat().st_ino == before)
        assert kept == [False, False, True]

    def test_the_clip_itself_is_no_earlier_render(self, tmp_path: Path) -> None:
        clip = sequence(tmp_path / "in", [1, 2, 3])
        with pytest.raises(Palette4dError, match="clip itself"):
            render(PLAIN, clip, clip, skip_existing=True, **NONE)

    def test_a_movie_stays_if_it_is_whole(
        self, tmp_path: Path, capsys: pytest.CaptureFixture
    ) -> None:
        sidecar, out = tmp_path / "s.p4d.json", tmp_path / "o.mov"
        sidecar.write_bytes(PLAIN.read_bytes())
        clip = sequence(tmp_path / "in", [1, 2, 3])
        words = [sidecar, clip, "-o", out, "--skip-existing"]
        assert self.run(*words) == 0
        whole = out.read_bytes()
        for damaged in (whole[:300], whole[: len(whole) // 2], whole[:-40], b"mine"):
            out.write_bytes(damaged)
            assert self.run(*words) == 0
            assert out.read_bytes() != damaged
            assert levels(out)[2] == pytest.approx(30, abs=1)
        status = out.stat().st_mtime_ns
        capsys.readouterr()
        assert self.run(*words) == 0
        assert "movie kept" in capsys.readouterr().out
        assert out.stat().st_mtime_ns == status
        assert self.run(*words, "--frames", "1-2") == 0
        assert count(out) == 2
        status = out.stat().st_mtime_ns
        assert self.run(*words, "--frames", "1-2") == 0
        assert out.stat().st_mtime_ns == status
        document = Document.load(sidecar)
        document.reset()
        document.save()
        assert self.run(*words, "--frames", "1-2") == 0
        assert out.stat().st_mtime_ns != status

    @pytest.mark.parametrize(
        "words", [("--force", "--skip-existing"), ("--skip-bad-frames", "--missing", "error")]
    )
    def test_options_that_contradict(self, tmp_path: Path, words) -> None:
        with pytest.raises(SystemExit) as ended:
            self.run(PLAIN, tmp_path, "-o", tmp_path / "o.mov", *words)
        assert ended.value.code == 2


@pytest.mark.parametrize("broken", [True, False])
def test_a_pick_is_learned_without_a_bad_frame(tmp_path: Path, broken: bool) -> None:
    """Frame 5 is one of those that a pick learns from, beside its own."""
    halves = np.where(np.arange(24)[None, :, None] < 12, [200, 40, 40], [90, 90, 95])
    for frame in range(1, 9):
        pixels = (halves + frame).repeat(16, 0).astype(np.uint8)
        write_image(tmp_path / "clip" / f"g.{frame:04d}.png", pixels)
    bad = tmp_path / "clip" / "g.0005.png"
    if broken:
        bad.write_bytes(b"no picture")
    else:
        bad.unlink()
    out = tmp_path / "g.p4d.json"
    analyze = ["analyze", str(tmp_path / "clip"), "-o", str(out), "--quiet"]
    assert main.main([*analyze, "--method", "static", "--skip-bad-frames"]) == 0
    pick = ["pick", "--pixel", "5,8", "--to", "#3060b0"]
    assert main.main(["edit", str(out), *pick, "--frame", "2"]) == 0
    assert main.main(["edit", str(out), *pick, "--frame", "5"]) == 1  # it cannot be seen
    document = Document.load(out)
    red = np.array([[[201, 41, 41]]], np.float32) / 255
    moved = document.recolour(red, 2)[0, 0]
    assert moved == pytest.approx(np.array([0x30, 0x60, 0xB0]) / 255, abs=0.03)


@pytest.mark.parametrize("fault", ["gone", "broken", "transparent", "trimmed"])
def test_a_new_version_without_a_picks_place_keeps_the_pick(
    tmp_path: Path, fault: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is picked where its colour is, in the nearest frame that shows it."""
    halves = np.where(np.arange(24)[None, :, None] < 12, [200, 40, 40], [90, 90, 95]).repeat(16, 0)
    alpha = np.full((16, 24, 1), 255)
    for version in ("v1", "v2"):
        for frame in range(1, 9):
            pixels = np.concatenate([halves + frame, alpha], 2).astype(np.uint8)
            if (version, fault, frame) == ("v2", "transparent", 5):
                pixels[2:14, 2:8] = 0
            write_image(tmp_path / version / f"g.{frame:04d}.png", pixels)
    out = tmp_path / "g.p4d.json"
    analyze = ["-o", str(out), "--quiet"]
    assert main.main(["analyze", str(tmp_path / "v1"), *analyze, "--method", "static"]) == 0
    pick = ["pick", "--pixel", "5,8", "--to", "#3060b0", "--frame", "5"]
    assert main.main(["edit", str(out), *pick]) == 0
    bad = tmp_path / "v2" / "g.0005.png"
    if fault == "gone":
        bad.unlink()
    elif fault == "broken":
        bad.write_bytes(b"no picture")
    again = ["analyze", str(tmp_path / "v2"), *analyze, "--skip-bad-frames", "--keep-edits"]
    again += ["--frames", "1-4"] if fault == "trimmed" else []
    assert main.main(again) == 0
    assert "picked where their colour is" in capsys.readouterr().err
    (kept,) = Document.load(out).grade.picks
    assert kept.frame == (5 if fault == "transparent" else 4)
    red = np.array([[[201, 41, 41]]], np.float32) / 255
    moved = Document.load(out).recolour(red, 2)[0, 0]
    assert moved == pytest.approx(np.array([0x30, 0x60, 0xB0]) / 255, abs=0.03)


@pytest.mark.parametrize("fault", ["gone", "broken"])
def test_areas_and_corrections_of_frames_that_cannot_be_read_are_told(
    tmp_path: Path, fault: str, capsys: pytest.CaptureFixture[str]
) -> None:
    halves = np.where(np.arange(24)[None, :, None] < 12, [200, 40, 40], [90, 90, 95]).repeat(16, 0)
    for version in (0, 1):
        for frame in range(1, 9):
            pixels = (halves + frame + version).astype(np.uint8)
            write_image(tmp_path / f"v{version}" / f"g.{frame:04d}.png", pixels)
    out = tmp_path / "g.p4d.json"
    analyze = ["-o", str(out), "--quiet"]
    assert main.main(["analyze", str(tmp_path / "v0"), *analyze, "--method", "static"]) == 0
    document = Document.load(out)
    document.pick(2, pixel=(5, 8), to="#3060b0", areas=[Area(6, ((3, 3),), 2)])
    document.correct_path("p1", 6, pixel=(4, 8))
    document.save()
    bad = tmp_path / "v1" / "g.0006.png"
    if fault == "gone":
        bad.unlink()
    else:
        bad.write_bytes(b"no picture")
    again = ["analyze", str(tmp_path / "v1"), *analyze, "--skip-bad-frames", "--keep-edits"]
    assert main.main(again) == 0
    said = capsys.readouterr().err
    assert "without areas whose frames are gone, or cannot be read: p1" in said
    assert "without the corrections of their paths: p1" in said
    (kept,) = Document.load(out).grade.picks
    assert (kept.pixel, kept.areas) == ((5, 8), ())
    assert kept.path
