"""Clips of every kind, from real files through the real reader and the whole analysis.

`docs/lab/clips.md` states for each kind what is asserted here.
"""

from __future__ import annotations

import functools
import json
import warnings
from dataclasses import dataclass
from typing import Any

import any_clips
import numpy as np
import pytest
from palette4d.analysis import pipeline
from palette4d.analysis.pipeline import Analysis
from scipy.spatial import ConvexHull

from palette4d import _core
from palette4d.cli import main
from palette4d.grade import sidecar
from palette4d.media.clip import Clip, open_clip

# kind: most of L, most handles, most distance of a pixel outside. Each is about one and a half
# times what was measured, which docs/lab/clips.md states.
KINDS = {
    "clean": (0.03, 16, 0.02),
    "flash": (0.03, 32, 0.02),
    "fade": (0.08, 30, 0.02),
    "title": (0.03, 26, 0.05),
    "letterbox": (0.015, 20, 0.02),
    "grain": (0.12, 20, 0.1),
    "hot_pixels": (0.04, 22, 1.0),
    "rare_light": (0.02, 18, 0.05),
    "interlaced": (0.1, 22, 0.12),
    "straight_alpha": (0.035, 16, 0.02),
    "premultiplied_alpha": (0.03, 16, 0.02),
    "monochrome": (0.003, 6, 0.005),
    "log_dpx": (0.025, 16, 0.02),
    "log_movie": (0.04, 16, 0.07),
    "hdr_exr": (2.8, 24, 1.4),
    "pq_movie": (0.025, 16, 0.02),
}


@dataclass(frozen=True)
class Found:
    """What became of a clip: read back from the text that the sidecar would hold."""

    clip: Clip
    document: dict[str, Any]
    analysis: Analysis
    polytope: _core.Polytope

    @property
    def rows(self) -> dict[str, Any]:
        return {row["stage"]: row for row in self.document["quality"]["stages"]}

    def palette(self, frame: float) -> np.ndarray:
        return _core.slice_at(self.polytope, frame).rgb

    def fit(self, frame: int):
        return next(fit for fit in self.analysis.report.fits if fit.frame == frame)

    def volume(self) -> float:
        """Mean volume of the convex hulls of the palettes."""
        return float(np.mean([ConvexHull(self.palette(n)).volume for n in self.clip.frames]))


@pytest.fixture(scope="module")
def analysed(tmp_path_factory):
    """A function that writes a kind of clip and analyses it, once; cuts would be refused."""

    @functools.cache
    def analyse(kind: str) -> Found:
        folder = tmp_path_factory.mktemp(kind)
        clip = open_clip(getattr(any_clips, kind)(folder))
        analysis = pipeline.analyze(clip)
        polytope = _core.parse_sidecar(sidecar.dumps(analysis.document)).polytope
        return Found(clip, analysis.document, analysis, polytope)

    return analyse


@pytest.mark.parametrize("kind", KINDS)
def test_the_palette_fits_and_beats_a_static_one(kind, analysed):
    found = analysed(kind)
    most_loss, most_handles, farthest = KINDS[kind]
    last = found.document["quality"]["stages"][-1]
    assert last["L"] <= most_loss
    assert last["vertices"] <= most_handles
    assert last["max_distance"] <= farthest
    assert last["L_prime"] <= found.rows["static_hull"]["L_prime"] * (1 + 1e-9)
    assert last["outside"] < 0.1 or kind == "hdr_exr"
    first, final = found.clip.frames[0], found.clip.frames[-1]
    assert (found.polytope.first_frame, found.polytope.last_frame) == (first, final)
    for frame in np.linspace(first, final, 41):
        assert np.isfinite(found.palette(frame)).all()


def test_losses_hold_for_the_files_pixels(analysed):
    """The stated loss of a frame is that of the pixels read anew, by eq. 2 to 4 directly.

    The palette is convex, and colours outside lie before a face, so that planes measure them.
    """
    found = analysed("clean")
    pixels = found.clip.read(5)[..., :3].reshape(-1, 3).astype(float)
    palette = found.palette(5)
    hull = ConvexHull(palette)
    inside = (pixels @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
    share = float((inside > 1e-6).mean())
    assert found.fit(5).outside == pytest.approx(share, abs=0.01)
    nearest = [
        pixels[np.argsort(np.linalg.norm(pixels - v, axis=1))[:50]].mean(axis=0) for v in palette
    ]
    closeness = float(np.mean(np.linalg.norm(palette - np.array(nearest), axis=1)))
    distances = 50 * float((np.maximum(inside, 0) ** 2).mean())
    assert abs(found.fit(5).L - closeness - distances) < 0.005


def test_a_flash_changes_its_own_frame_alone(analysed):
    found, clean = analysed("flash"), analysed("clean")
    assert found.palette(5).min() > 0.85
    for beside in (4, 6):
        assert found.fit(beside).L < clean.fit(beside).L + 0.02
        assert found.palette(beside).min() < 0.25
    assert found.fit(5).L < 0.1


def test_a_fade_ends_near_black_and_keeps_the_picture(analysed):
    found = analysed("fade")
    for frame in (1, 14):
        assert found.palette(frame).max() < 0.25
    assert found.palette(7).max() > 0.8
    last, static = found.document["quality"]["stages"][-1], found.rows["static_hull"]
    assert last["L_prime"] < 0.4 * static["L_prime"]


def test_a_title_has_a_white_while_it_stands(analysed):
    found = analysed("title")

    def from_white(frame: int) -> float:
        return float(np.linalg.norm(found.palette(frame) - 0.97, axis=1).min())

    assert max(from_white(frame) for frame in (4, 5, 6, 7)) < 0.05
    assert min(from_white(frame) for frame in (1, 2, 9, 10)) > 0.3
    assert "not convex" not in " ".join(found.analysis.notes)


def test_letterbox_bars_are_a_black_in_every_frame(analysed):
    found = analysed("letterbox")
    for frame in found.clip.frames:
        assert np.linalg.norm(found.palette(frame), axis=1).min() < 0.01


def test_grain_does_not_blow_up_the_palette(analysed):
    found = analysed("grain")
    pixels = [image.reshape(-1, 3) for _, image in found.clip]
    outermost = float(np.mean([ConvexHull(p).volume for p in pixels]))
    assert found.volume() < 0.92 * outermost
    assert found.volume() < 2.5 * analysed("clean").volume()


def test_hot_pixels_do_not_blow_up_the_palette(analysed):
    found, clean = analysed("hot_pixels"), analysed("clean")
    assert found.volume() < 1.3 * clean.volume()
    assert found.document["quality"]["stages"][-1]["L"] < 0.04
    # They are left outside.
    assert found.document["quality"]["stages"][-1]["max_distance"] > 0.3


def test_a_small_red_light_is_not_lost(analysed):
    found = analysed("rare_light")
    stored = np.rint(any_clips.RED_LIGHT * 255) / 255
    for frame in found.clip.frames:
        assert np.linalg.norm(found.palette(frame) - stored, axis=1).min() < 0.1


@pytest.mark.parametrize("kind", ["straight_alpha", "premultiplied_alpha"])
def test_transparent_pixels_do_not_count(kind, analysed):
    found = analysed(kind)
    assert found.clip.has_alpha
    assert found.clip.premultiplied == (kind == "premultiplied_alpha")
    for frame in found.clip.frames:
        palette = found.palette(frame)
        assert np.linalg.norm(palette - [1, 0, 1], axis=1).min() > 0.5  # what is hidden
        assert np.linalg.norm(palette, axis=1).min() > 0.1  # premultiplied nothing


def test_straight_and_premultiplied_files_give_one_palette(analysed):
    volumes = [analysed(kind).volume() for kind in ("straight_alpha", "premultiplied_alpha")]
    assert volumes[0] == pytest.approx(volumes[1], rel=0.1)


def test_monochrome_is_a_line_from_dark_to_light(analysed):
    found = analysed("monochrome")
    for frame, image in found.clip:
        palette = found.palette(frame)
        assert palette.shape == (2, 3)
        np.testing.assert_allclose(palette - palette[:, :1], 0, atol=1e-6)
        spread = [palette.min(), palette.max()]
        np.testing.assert_allclose(spread, [image.min(), image.max()], atol=0.02)


@pytest.mark.parametrize("kind", ["log_dpx", "log_movie"])
def test_log_footage_keeps_its_ten_bits(kind, analysed):
    found = analysed(kind)
    assert found.clip.depth == "uint10"
    # Colours stay log codes: 90 % white is code 685, black 95.
    palettes = np.concatenate([found.palette(frame) for frame in found.clip.frames])
    assert 0.093 < palettes.min() < 0.3
    assert 0.6 < palettes.max() < 0.72


def test_light_above_one_and_below_zero(analysed):
    found = analysed("hdr_exr")
    palettes = np.concatenate([found.palette(frame) for frame in found.clip.frames])
    assert palettes.max() > 30
    assert found.polytope.vertices[:, :3].max() <= 50.1
    # Beside a sun of 50 the picture's own colours weigh little, and the user is told so.
    (text,) = found.analysis.notes
    assert "colour space" in text


def test_pq_is_named_and_fits_as_display_colours_do(analysed):
    found = analysed("pq_movie")
    assert (found.clip.encoding, found.clip.depth) == ("Rec.2100 PQ", "uint10")
    assert found.document["clip"]["encoding"] == "Rec.2100 PQ"
    palettes = np.concatenate([found.palette(frame) for frame in found.clip.frames])
    assert 0.75 < palettes.max() < 0.85  # 1,500 cd/m2 is at 0.795


def test_fields_are_read_as_they_are_woven(analysed):
    found = analysed("interlaced")
    assert len(found.clip.frames) == any_clips.FRAMES
    # Both fields are in the frame: neighbouring rows differ beside the moving sun.
    row = found.clip.read(5).sum(axis=2)
    combed = np.abs(row[10:40:2] - row[11:41:2]).max()
    assert combed > 0.4


def test_the_command_refuses_cuts(tmp_path, capsys):
    spec, starts = any_clips.cut_of_two(tmp_path / "clip"), [5, 8]
    out = tmp_path / "out.p4d.json"
    assert main.main(["analyze", spec, "-o", str(out), "--quiet"]) == 1
    message = capsys.readouterr().err
    assert not out.exists()
    for start in starts:
        assert str(start) in message
    words = [word.rstrip("),;") for word in message.split()]
    ranges = [word for word in words if word[:1].isdigit() and "-" in word]
    assert len(ranges) == len(starts) + 1
    for part in ranges:  # what the message names can be analysed
        arguments = ["analyze", spec, "-o", str(out), "--quiet", "--frames", part]
        assert main.main([*arguments, "--method", "static"]) == 0


def test_the_command_spans_a_cut_when_told_to(tmp_path, capsys):
    spec = any_clips.cut(tmp_path / "clip")
    out = tmp_path / "out.p4d.json"
    words = ["analyze", spec, "-o", str(out), "--json", "--allow-cuts", "--method", "static"]
    assert main.main(words) == 0
    printed = capsys.readouterr()
    assert "the palette spans 1 sudden cut, at frame 7" in printed.err
    assert any("the palette spans" in note for note in json.loads(printed.out)["notes"])


def test_through_the_command(tmp_path, capsys):
    folder = tmp_path / "clip"
    folder.mkdir()
    spec = any_clips.interlaced(folder)
    out = tmp_path / "out.p4d.json"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert main.main(["analyze", spec, "-o", str(out), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["stages"][-1]["L"] <= KINDS["interlaced"][0]
    assert len(report["frames"]) == any_clips.FRAMES
    read = _core.read_sidecar(str(out))
    assert len(read.polytope.vertices) == report["stages"][-1]["vertices"]
