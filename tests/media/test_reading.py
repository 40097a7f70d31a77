"""Layers and views of EXR, and matrices of untagged movies, in every program that reads a clip."""

from __future__ import annotations

import sys

import numpy as np
import OpenEXR
import pytest
from clip_files import grey_levels, write_image
from deliveries import PLAIN, movie, render, tiles

from palette4d import analyze
from palette4d.common.errors import Palette4dError
from palette4d.grade import rendering
from palette4d.grade.document import Document
from palette4d.media.clip import ClipError, open_clip
from palette4d.media.reading import read_as
from palette4d.media.source_clip import find_clip, frame_colours


def layers(path):
    """A file of one part: a main layer, another one, and two views of both; one value each."""
    names = ["R", "G", "B", "right.R", "right.G", "right.B"]
    names += ["diffuse.left.R", "diffuse.left.G", "diffuse.left.B"]
    names += [
        *("diffuse.right.red", "diffuse.right.green", "diffuse.right.blue"),
        "depth.Z",
    ]
    values = {name: np.float32(0.05 * (index + 1)) for index, name in enumerate(names)}
    header = {"multiView": ["left", "right"], "compression": OpenEXR.ZIP_COMPRESSION}
    channels = {name: np.full((4, 6), value, np.float32) for name, value in values.items()}
    OpenEXR.File(header, channels).write(str(path))
    return values


@pytest.mark.parametrize(
    ("asked", "names"),
    [
        ({}, ("R", "G", "B")),
        ({"view": "left"}, ("R", "G", "B")),
        ({"view": "right"}, ("right.R", "right.G", "right.B")),
        ({"layer": "diffuse"}, ("diffuse.left.R", "diffuse.left.G", "diffuse.left.B")),
        (
            {"layer": "diffuse", "view": "right"},
            ("diffuse.right.red", "diffuse.right.green", "diffuse.right.blue"),
        ),
    ],
)
def test_a_layer_and_a_view_are_read_and_written(tmp_path, asked, names):
    values = layers(tmp_path / "c.0003.exr")
    spec = read_as(str(tmp_path / "c.0003.exr"), **asked)
    clip = open_clip(spec)
    assert clip.source == spec
    np.testing.assert_allclose(clip.read(3)[0, 0], [values[name] for name in names])
    done = rendering.render(PLAIN, spec, tmp_path / "o.exr", show="recoloured", strength=1)
    assert done.frames == [3]
    written = OpenEXR.File(str(tmp_path / "o.exr"), separate_channels=True).parts[0].channels
    assert {name: float(channel.pixels[0, 0]) for name, channel in written.items()} == values


def test_parts_are_layers_and_views(tmp_path):
    def part(name, view, value):
        header = {
            "name": name,
            "type": OpenEXR.scanlineimage,
            "compression": OpenEXR.ZIP_COMPRESSION,
        }
        header |= {"view": view} if view else {}
        return OpenEXR.Part(header, {one: np.full((4, 6), value, np.float32) for one in "RGB"})

    path = tmp_path / "c.exr"
    OpenEXR.File(
        [part("beauty", "left", 0.1), part("beauty.r", "right", 0.2), part("spec", "left", 0.3)]
    ).write(str(path))
    for asked, value in (
        ({}, 0.1),
        ({"view": "right"}, 0.2),
        ({"layer": "spec"}, 0.3),
        ({"layer": "beauty"}, 0.1),
    ):
        np.testing.assert_allclose(open_clip(read_as(str(path), **asked)).read(0), value)
    render(read_as(str(path), layer="spec"), tmp_path / "o.exr")
    kept = [one.channels["R"].pixels[0, 0] for one in parts_of(tmp_path / "o.exr")]
    np.testing.assert_allclose(kept, [0.1, 0.2, 0.3])


def parts_of(path):
    return OpenEXR.File(str(path), separate_channels=True).parts


def test_what_is_not_there_is_refused_with_what_is(tmp_path):
    layers(tmp_path / "c.exr")
    for asked in ({"layer": "specular"}, {"view": "middle"}):
        with pytest.raises(ClipError, match=r"diffuse \(view right\)"):
            open_clip(read_as(str(tmp_path / "c.exr"), **asked))
    source = movie(tmp_path / "s.mp4", list(tiles(1, (32, 64))))
    with pytest.raises(ClipError, match="expected it for EXR"):
        open_clip(f"{source}?layer=a")
    with pytest.raises(ClipError, match="for movies alone"):
        open_clip(f"{tmp_path / 'c.exr'}?matrix=709")
    with pytest.raises(Palette4dError, match="601, 709, 2020"):
        open_clip(f"{source}?matrix=240")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such names")
def test_a_file_of_that_name_is_a_file(tmp_path):
    path = write_image(tmp_path / "a.png", np.zeros((2, 2, 3), np.uint8))
    odd = path.rename(tmp_path / "a?view=left.png")
    assert open_clip(str(odd)).frames == [0]


def test_the_matrix_of_an_untagged_movie(tmp_path):
    untagged = movie(tmp_path / "s.mp4", list(tiles()), tags=(2, 2, 2))
    usual = open_clip(str(untagged)).read(0)
    asked = open_clip(f"{untagged}?matrix=709").read(0)
    assert np.abs(usual - asked).max() > 0.02
    np.testing.assert_array_equal(open_clip(f"{untagged}?matrix=601").read(0), usual)
    tagged = movie(tmp_path / "t.mp4", list(tiles()), tags=(1, 1, 1))
    clip = open_clip(f"{tagged}?matrix=601")
    np.testing.assert_array_equal(clip.read(0), open_clip(str(tagged)).read(0))
    assert any("matrix=601 is not used" in note for note in clip.notes)


def test_a_proxy_need_not_be_read_as_the_clip_is(tmp_path):
    """A layer's proxy may be a movie, or an EXR with that layer alone."""
    layers(tmp_path / "c.0003.exr")
    sidecar = tmp_path / "c.p4d.json"
    analyze(read_as(str(tmp_path / "c.0003.exr"), layer="diffuse"), method="static").save(sidecar)
    write_image(tmp_path / "p.0003.exr", np.full((4, 6, 3), 0.2, np.float32))
    write_image(tmp_path / "p.0003.png", np.full((4, 6, 3), 50, np.uint8))
    for name in ("p.0003.png", "p.0003.exr?layer="):
        done = rendering.render(sidecar, tmp_path / name, tmp_path / "o.png", force=True)
        assert done.frames == [3]
    with pytest.raises(ClipError, match=r"no layer 'diffuse'.*\?layer= is the main layer"):
        rendering.render(sidecar, tmp_path / "p.0003.exr", tmp_path / "o.png", force=True)


def test_a_sidecar_remembers_how_its_clip_is_read(tmp_path):
    source = movie(tmp_path / "s.mp4", list(tiles(3, (64, 64))))
    document = analyze(f"{source}?matrix=709", allow_cuts=True, vertices=8)
    document.save(tmp_path / "s.p4d.json")
    kept = Document.load(tmp_path / "s.p4d.json")
    assert kept.grade.core.clip["source"].endswith("s.mp4?matrix=709")
    expected = open_clip(f"{source}?matrix=709").read(1)
    for given in (None, str(source)):  # found again, and named by the user
        found = find_clip(tmp_path / "s.p4d.json", kept.grade.core.clip, given)
        np.testing.assert_array_equal(found.read(1), expected)
    rendering.render(kept, source, tmp_path / "o.#.exr")
    np.testing.assert_array_equal(open_clip(str(tmp_path / "o.1.exr")).read(1), expected)


def test_colours_come_from_frames_of_the_palettes_numbers(tmp_path):
    own = {"name": "c", "source": "gone.####.png", "first": 1001, "last": 1005}
    sidecar = tmp_path / "c.p4d.json"
    near = str(grey_levels(tmp_path / "near", range(1003, 1010)) / "clip.####.png")
    assert frame_colours(sidecar, own, 1001, near)[1] == 1003  # the nearest of those that it has
    other = str(grey_levels(tmp_path / "other", range(1, 6)) / "clip.####.png")
    with pytest.raises(Palette4dError, match=r"1-5.* 1001 to 1005"):
        frame_colours(sidecar, own, 1001, other)
    assert frame_colours(sidecar, own, 1001, other.replace("####", "0002"))[1] == 2  # a still
    assert frame_colours(sidecar, own, 1001, None) == (None, None)
