"""Colour statistics: exact for few colours, bounded memory, and their error on a real clip."""

from __future__ import annotations

import dataclasses
import threading

import numpy as np
import pytest
from analysis_frames import mixture, noise
from clip_files import grey_levels, write_image
from palette4d.analysis import colour_statistics, frame_hulls, pipeline
from palette4d.analysis.colour_statistics import budget, chosen_frames, gather, gather_clip
from palette4d.analysis.frame_statistics import Gamut, pooled
from palette4d.analysis.losses import palette_loss
from palette4d.analysis.options import AnalysisOptions

from palette4d import _core
from palette4d.media.array_clip import ArrayClip
from palette4d.media.clip import FrameError, open_clip
from palette4d.media.colour_histogram import histogram
from palette4d.media.cuts import difference


def same(a: _core.ColourTree, b: _core.ColourTree) -> bool:
    return np.array_equal(a.rgb, b.rgb) and np.array_equal(a.counts, b.counts)


def test_gamut_grows_only_for_colours_outside():
    inside = gather(0, noise(5), AnalysisOptions())
    outside = gather(1, noise(6, 3, -1), AnalysisOptions())
    gamut = Gamut.of([inside])
    assert (gamut.low.tolist(), gamut.high.tolist(), gamut.scale) == ([0] * 3, [1] * 3, 1)
    gamut = Gamut.of([inside, outside])
    assert gamut.low.max() < -0.9
    assert gamut.high.min() > 1.9
    assert 2.9 < gamut.scale < 3


def with_outliers(pixels: int, colour=(-10, 0.5, 0.5), seed: int = 5):
    image = noise(seed, size=(80, 100))
    image[0, :pixels] = colour
    return image


@pytest.mark.parametrize(
    ("pixels", "k", "kept"), [(1, 50, False), (4, 50, False), (5, 50, True), (4, 4, True)]
)
def test_only_enough_pixels_set_the_box(pixels, k, kept):
    images = [noise(4, size=(80, 100)), with_outliers(pixels), noise(6, size=(80, 100))]
    found = gather_clip(ArrayClip(images, first=10), AnalysisOptions(k=k))
    frames = list(found.frames.values())
    gamut = Gamut.of(frames)
    np.testing.assert_allclose(gamut.low, [-10 if kept else 0, 0, 0])
    np.testing.assert_array_equal(gamut.high, 1)
    least = frames[1].colours.rgb.min()
    assert frames[1].low[0] == least == frames[1].coarse.rgb.min() == gamut.low[0]
    assert frames[1].colours.total == frames[1].coarse.total == frames[1].pixels == 8000
    for image, frame in zip(images[::2], frames[::2], strict=True):
        assert same(frame.colours, gather(0, image, AnalysisOptions()).colours)
    if kept:
        assert found.notes == ()
    else:
        (note,) = found.notes
        assert note.startswith(f"{pixels} pixel")
        assert "by up to 10 (frame 11)" in note


def test_a_hot_pixel_of_every_frame_is_an_outlier():
    images = [with_outliers(1, (0.5, 0.5, 40), seed) for seed in range(12)]
    found = gather_clip(ArrayClip(images, first=0), AnalysisOptions())
    np.testing.assert_array_equal(Gamut.of(list(found.frames.values())).high, 1)
    assert "12 pixels" in found.notes[0]
    assert "frames 0-11" in found.notes[0]


def test_a_highlight_that_begins_small_is_no_outlier():
    images = [with_outliers(pixels, (3, 2, 1)) for pixels in (1, 90)]
    found = gather_clip(ArrayClip(images, first=0), AnalysisOptions())
    for frame in found.frames.values():
        np.testing.assert_allclose(frame.high, [3, 2, 1], rtol=1e-6)
    assert found.notes == ()


def test_outliers_are_taken_at_the_border_of_what_others_reach():
    image = with_outliers(99, (4, 2, 1))
    image[1, 0] = (60, 0.5, -0.05)
    found = gather_clip(ArrayClip([image], first=0), AnalysisOptions())
    np.testing.assert_allclose(found.frames[0].high, [4, 2, 1], rtol=1e-6)
    assert found.frames[0].low[2] == pytest.approx(-0.05)  # near enough to stay
    assert "by up to 56 " in found.notes[0]


def test_an_outlier_hardly_changes_the_palette():
    corners = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.1], [0.2, 0.8, 0.3], [0.1, 0.2, 0.9]])
    palettes = {}
    for name, pixels in (("none", 0), ("one", 1), ("many", 60)):
        images = [mixture(corners + 0.01 * i, i, 9000) for i in range(4)]
        images[2].reshape(-1, 3)[-pixels or 9000 :] = (0.5, -10, 0.5)
        done = pipeline.analyze(ArrayClip(images), AnalysisOptions(method="static"))
        palettes[name] = done.polytope.vertices, done.stages[-1].losses.L
    (clean, loss), (one, loss_of_one) = palettes["none"], palettes["one"]
    np.testing.assert_allclose(one[:, :3].min(axis=0), clean[:, :3].min(axis=0), atol=0.05)
    np.testing.assert_allclose(one[:, :3].max(axis=0), clean[:, :3].max(axis=0), atol=0.05)
    assert loss_of_one < loss + 0.01
    assert palettes["many"][0][:, 1].min() < -5


def test_trees_are_pooled():
    options = AnalysisOptions()
    images = [noise(seed, size=(60, 60)) for seed in range(3)]
    trees = [gather(0, image, options).colours for image in images]
    whole = pooled(trees, 10**6)
    assert whole.total == 3 * 3600
    np.testing.assert_allclose(
        whole.counts @ whole.rgb, np.sum(images, axis=(0, 1, 2), dtype=float), rtol=1e-6
    )
    few = pooled(trees, 1000)
    assert 800 < len(few) <= 1000
    assert few.total == 3 * 3600


@pytest.mark.parametrize("rows", [1, 3])
def test_threads_do_not_change_the_statistics(tmp_path, monkeypatch, rows):
    monkeypatch.setattr("palette4d.media.clip_base.COUNTED_PIXELS", 90 * 120 // rows)
    generator = np.random.default_rng(8)
    for frame in range(12):
        write_image(tmp_path / f"a.{frame}.png", generator.integers(0, 256, (90, 120, 3), np.uint8))
    options = AnalysisOptions(colours=900, coarse_colours=300)
    done = []
    runs = [
        gather_clip(
            open_clip(str(tmp_path)),
            dataclasses.replace(options, threads=threads),
            lambda *at: done.append(at),
        )
        for threads in (1, 2, 7)
    ]
    assert done == [(n, 12) for n in range(1, 13)] * 3
    for run in runs:
        assert list(run.frames) == list(range(12))
        assert run.notes == ()
        for number, found in run.frames.items():
            first = runs[0].frames[number]
            assert same(found.colours, first.colours)
            assert same(found.coarse, first.coarse)
            assert found.frame == number
            assert found.pixels == 90 * 120
            assert found.colours.total == pytest.approx(90 * 120)


@pytest.mark.parametrize("threads", [1, 3])
def test_bad_frames_are_skipped_or_end_the_reading(tmp_path, threads):
    folder = grey_levels(tmp_path, range(1, 9))
    (folder / "clip.0004.png").unlink()
    path = folder / "clip.0006.png"
    path.write_bytes(path.read_bytes()[:60])
    options = AnalysisOptions(threads=threads)
    clip = open_clip(str(folder), skip_bad_frames=True)
    found = gather_clip(clip, options)
    assert list(found.frames) == [1, 2, 3, 5, 7, 8]
    assert clip.skipped == [4, 6]
    with pytest.raises(FrameError, match="frame 6 cannot be read") as kept:
        gather_clip(open_clip(str(folder), frames="5-8"), options)
    # Its threads have ended, although the error is kept, and with it all that it passed through.
    assert kept.tb is not None
    assert not [t for t in threading.enumerate() if t.name.startswith("palette4d-read")]
    for frame in folder.iterdir():
        if frame.name != "clip.0001.png":
            frame.write_bytes(b"no picture")
    with pytest.raises(FrameError, match="none readable of frames 2-8"):
        gather_clip(open_clip(str(folder), frames="2-8", skip_bad_frames=True), options)


def test_frames_without_a_colour_are_none():
    blank = np.full((20, 30, 3), np.nan, np.float32)
    found = gather_clip(ArrayClip([noise(1), blank, noise(2)], first=5), AnalysisOptions())
    assert [number for number, one in found.frames.items() if one is None] == [6]


def test_every_nth_frame_of_very_many():
    assert chosen_frames([7]) == [7]
    assert chosen_frames(range(10, 3010)) == list(range(10, 3010))
    for count in (3001, 4444, 100_001):
        frames = range(5, 5 + 2 * count, 2)
        chosen = chosen_frames(frames)
        assert len(chosen) <= colour_statistics.MOST_FRAMES
        assert (chosen[0], chosen[-1]) == (frames[0], frames[-1])
        gaps = set(np.diff(chosen[:-1]))
        assert len(gaps) == 1
        assert 0 < chosen[-1] - chosen[-2] <= gaps.pop()


def test_leaving_frames_out_is_said(monkeypatch):
    monkeypatch.setattr(colour_statistics, "MOST_FRAMES", 4)
    found = gather_clip(ArrayClip([noise(i) for i in range(9)], first=0), AnalysisOptions())
    assert list(found.frames) == [0, 3, 6, 8]
    assert len(found.notes) == 1
    assert "9 frames: one in 3 and the last are analysed, 4 in all" in found.notes[0]


def test_colours_kept_of_a_clip_are_bounded(monkeypatch):
    options = AnalysisOptions(colours=16384, coarse_colours=4096)
    assert budget(50, options) == (16384, 4096)
    for frames in (400, 1600, 3000):
        colours, coarse = budget(frames, options)
        assert colours >= colour_statistics.FEWEST_COLOURS
        assert coarse >= colour_statistics.FEWEST_COARSE
        fewest = frames * (colour_statistics.FEWEST_COLOURS + colour_statistics.FEWEST_COARSE)
        assert frames * (colours + coarse) < max(
            1.2 * colour_statistics.MOST_COLOURS, 1.001 * fewest
        )
        assert frames * (colours + coarse) < 5_000_000
    assert budget(3000, AnalysisOptions(colours=100, coarse_colours=64)) == (100, 64)
    monkeypatch.setattr(colour_statistics, "MOST_COLOURS", 4000)
    monkeypatch.setattr(colour_statistics, "FEWEST_COLOURS", 64)
    found = gather_clip(ArrayClip([noise(i, size=(90, 90)) for i in range(4)]), options)
    assert all(700 < len(one.colours) <= 800 for one in found.frames.values())


def test_cuts_are_found_by_enough_colours_of_however_long_a_clip(monkeypatch):
    pictures = [noise(i, size=(90, 90)) for i in range(3)]
    whole = gather_clip(ArrayClip(pictures), AnalysisOptions()).frames
    monkeypatch.setattr(colour_statistics, "MOST_COLOURS", 600)
    monkeypatch.setattr(colour_statistics, "FEWEST_COLOURS", 128)
    monkeypatch.setattr(colour_statistics, "FEWEST_COARSE", 64)
    few = gather_clip(ArrayClip(pictures), AnalysisOptions()).frames
    for i, frame in few.items():
        assert len(frame.colours) <= 200
        assert frame.colours.total == whole[i].colours.total
        sampled = histogram(frame.colours.rgb, frame.colours.counts)
        error = difference(frame.histogram, whole[i].histogram)
        assert error < 0.5 * difference(sampled, whole[i].histogram)
        assert error < 0.1


@pytest.mark.parametrize("coarse", [512, 4096])
def test_cuts_are_found_by_all_colours_that_are_kept(coarse):
    found = gather(0, noise(1, size=(90, 90)), AnalysisOptions(colours=6000, coarse_colours=coarse))
    assert len(found.colours) > 5000
    kept = histogram(found.colours.rgb, found.colours.counts)
    np.testing.assert_array_equal(found.histogram, kept)


@pytest.fixture(scope="module")
def palettes(seasons):
    """Refined hulls of some frames, with all colours of these."""
    options = AnalysisOptions()
    clip, out = open_clip(str(seasons)), []
    for number, fill in clip.fills(clip.frames[::7]):
        binner = _core.ColourBinner()
        fill(binner)
        everything, coarse, *_ = binner.take(10**9, 4096)
        palette = frame_hulls.frame_palette(coarse, Gamut(np.zeros(3), np.ones(3)), options)
        out.append((number, palette.rgb, everything))
    return clip, out


@pytest.mark.parametrize(
    ("colours", "mean", "most"),
    [(AnalysisOptions().colours, 0.0005, 0.002), (16384, 0.001, 0.003), (4096, 0.003, 0.008)],
)
def test_the_sample_is_as_good_as_all_pixels(palettes, colours, mean, most):
    """The loss L of a palette on the sample against that on all pixels, SEASONS being 0.1."""
    options = AnalysisOptions()
    clip, frames = palettes
    errors = []
    for number, rgb, everything in frames:
        binner = _core.ColourBinner()
        ((_, fill),) = clip.fills([number])
        fill(binner)
        sample = binner.take(colours, 64)[0]
        assert len(sample) <= colours < len(everything)
        assert sample.total == everything.total == 696 * 380
        errors.append(palette_loss(sample, rgb, options) - palette_loss(everything, rgb, options))
    assert abs(np.mean(errors)) < mean
    assert np.abs(errors).max() < most
