"""Palettes of earlier versions: the structure stays, the colours follow the clip."""

from __future__ import annotations

import json

import any_clips
import numpy as np
import pytest
from analysis_frames import constant, grey, noise
from palette4d.analysis import earlier_palette, pipeline
from palette4d.analysis.options import LIKE, METHODS, AnalysisOptions

import palette4d
from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.grade import sidecar
from palette4d.media.array_clip import ArrayClip

CLIPS = {
    "one frame": [noise(1)],
    "one colour": [constant([0.3, 0.4, 0.5])] * 5,
    "grey": [grey(i) for i in range(5)],
    "grey to colour": [grey(i) for i in range(3)] + [noise(i) for i in range(3)],
    "a flash": [noise(i, 0.5) for i in range(3)] + [constant([1, 1, 1])] + [noise(4, 0.5)],
    "harbour": any_clips.frames(8),
}


def plain(fields):
    """The polytope without the names of its handles."""
    vertices = [{n: v for n, v in one.items() if n != "name"} for one in fields["vertices"]]
    return {**fields, "vertices": vertices}


def structure(document):
    fields = document.fields()["polytope"]
    edges = [(edge["from"], edge["to"]) for edge in fields["edges"]]
    return len(fields["vertices"]), edges, [block["faces"] for block in fields["blocks"]]


def colours(document, frame):
    return _core.slice_at(sidecar.validate(document.fields()).polytope, frame).rgb


@pytest.mark.parametrize(
    ("name", "method"), [*((name, "skew") for name in CLIPS), *(("a flash", m) for m in METHODS)]
)
def test_a_palette_is_read_as_it_was_written(name, method):
    clip = ArrayClip(CLIPS[name])
    document = pipeline.analyze(clip, AnalysisOptions(method=method), allow_cuts=True).document
    read = earlier_palette.read(document, clip)
    assert earlier_palette.fields_of(read, document) == plain(document["polytope"])


@pytest.mark.parametrize("name", CLIPS)
def test_noise_moves_a_palette_little_and_keeps_its_structure(name, tmp_path):
    frames = np.array(CLIPS[name])
    rng = np.random.default_rng(0)
    old = palette4d.analyze(frames, allow_cuts=True)
    noisy = (frames + rng.uniform(-1, 1, frames.shape) / 255).clip(0)
    new = palette4d.analyze(noisy, like=old, allow_cuts=True)
    assert structure(new) == structure(old)
    new.save(tmp_path / "new.p4d.json")
    for frame in range(len(frames)):
        assert np.abs(colours(new, frame) - colours(old, frame)).max() < 0.08


def test_the_palette_follows_a_darker_version_at_other_frame_numbers():
    frames = any_clips.frames(8)
    old = pipeline.analyze(ArrayClip(frames))
    darker = ArrayClip([0.8 * frame for frame in frames], first=1001)
    options = AnalysisOptions(method=LIKE)
    new = pipeline.analyze(darker, options, like=old.document)
    assert [b.first for b in new.polytope.blocks] == [b.first + 1001 for b in old.polytope.blocks]
    before, after = (stage.losses.L for stage in new.stages)
    assert after < 0.8 * before
    assert after < 1.5 * old.stages[-1].losses.L
    assert new.document["quality"]["options"]["method"] == LIKE


def test_ids_and_their_order_stay():
    frames = np.array(any_clips.frames(8))
    old = palette4d.analyze(frames).fields()
    text = sidecar.dumps(old).replace('"v3"', '"red"').replace('"e3"', '"long"')
    renamed = json.loads(text)
    for part in ("vertices", "edges"):
        renamed["polytope"][part].reverse()
    new = palette4d.analyze(frames, like=palette4d.Document(renamed)).fields()["polytope"]
    for part in ("vertices", "edges"):
        assert [one["id"] for one in new[part]] == [one["id"] for one in renamed["polytope"][part]]
    at = {v["id"]: v["rgb"] for v in new["vertices"]}
    before = {v["id"]: v["rgb"] for v in renamed["polytope"]["vertices"]}
    assert all(np.allclose(at[id_], before[id_], atol=0.05) for id_ in before)


def test_a_palette_that_fits_worse_is_reported():
    old = palette4d.analyze(np.array(any_clips.frames(8)))
    other = np.array([noise(i) for i in range(8)])
    notes = palette4d.analyze(other, like=old, allow_cuts=True).notes
    assert any("fits this version worse" in note for note in notes)
    assert not any("fits this version worse" in note for note in old.notes)


def test_what_does_not_fit_is_refused():
    frames = np.array(any_clips.frames(6))
    old = palette4d.analyze(frames, method="static")
    with pytest.raises(Palette4dError, match="covers the frames 0-5, and the clip has 0-3"):
        palette4d.analyze(frames[:4], like=old)
    with pytest.raises(Palette4dError, match="give one of them"):
        palette4d.analyze(frames, like=old, method="static")
    with pytest.raises(Palette4dError, match="vertices has no effect"):
        palette4d.analyze(frames, like=old, vertices=12)
    with pytest.raises(Palette4dError, match="found dict, expected a sidecar"):
        palette4d.analyze(frames, like=old.fields())
    with pytest.raises(Palette4dError, match="needs the palette of an earlier version"):
        palette4d.analyze(frames, method=LIKE)
    clip = ArrayClip(frames)
    document = old.fields()
    clip.encoding, document["clip"]["encoding"] = "ACEScct", "sRGB"
    with pytest.raises(Palette4dError, match="is in sRGB, and this one would be in ACEScct"):
        earlier_palette.read(document, clip)
