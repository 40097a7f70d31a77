"""Values that all verbs parse alike: frames, negative numbers, values that are never valid."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from analysis_frames import mixture
from clip_files import grey_levels, write_image

from palette4d.cli import main
from palette4d.common.arguments import times
from palette4d.common.text import counted

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"
EDITED = str(GOLDEN / "v1_edited.p4d.json")
BEYOND = str(GOLDEN / "v1_beyond_unit.p4d.json")  # its clip begins before frame 0
CORNERS = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])

# The words of each verb that reads a frame range, but for the range.
RANGE_VERBS = (
    ("analyze", "clip", "-o", "a.p4d.json"),
    ("slice", EDITED),
    ("render", EDITED, "clip", "-o", "o.####.png"),
    ("plot", EDITED, "-o", "a.png"),
)


@pytest.mark.parametrize("text", ["", "x", "5-1", "-4--5", "1-5x0", "1,,2", "1-", "1-2000000"])
@pytest.mark.parametrize("words", RANGE_VERBS, ids=lambda words: words[0])
def test_ranges_that_make_no_sense(capsys, monkeypatch, tmp_path, words, text):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stop:
        main.main([*words, "--frames", text])
    assert stop.value.code == 2
    assert "--frames: frame range" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "words",
    [
        ("render", EDITED, "clip", "-o", "o.####.png", "--strength", "nan"),
        ("render", EDITED, "clip", "-o", "o.####.png", "--strength", "2"),
        ("render", EDITED, "clip", "-o", "o.####.png", "--threads", "-1"),
        ("bake", EDITED, "-o", "a.cube", "--frame", "-inf"),
        ("bake", EDITED, "--frame", "1", "-o", "a.cube", "--strength", "-0.1"),
        ("bake", EDITED, "--frame", "1", "-o", "a.cube", "--strength", "nan"),
        ("bake", EDITED, "--frame", "1", "-o", "a.cube", "--size", "1"),
        ("bake", EDITED, "--frame", "1", "-o", "a.cube", "--size", "-3"),
        ("plot", EDITED, "-o", "a.png", "--width", "-5"),
        ("plot", EDITED, "-o", "a.png", "--width", "wide"),
        ("plot", EDITED, "-o", "a.png", "--frames", "nan"),
        ("sample-clip", "-o", "o.##.png", "--frames", "-1"),
        ("sample-clip", "-o", "o.##.png", "--frames", "0"),
        ("sample-clip", "-o", "o.##.png", "--size", "320"),
        ("sample-clip", "-o", "o.##.png", "--size", "0x9"),
        ("sample-clip", "-o", "o.##.png", "--size", "99999x99999"),
        ("analyze", "clip", "-o", "a.p4d.json", "--set", "lambda=nan"),
        ("analyze", "clip", "-o", "a.p4d.json", "--set", "eta1=0.2"),
        ("analyze", "clip", "-o", "a.p4d.json", "--set", "palette_size=-1"),
        ("analyze", "clip", "-o", "a.p4d.json", "--set", "palette_size=6.5"),
        ("analyze", "clip", "-o", "a.p4d.json", "--rate", "-24"),
        ("slice", EDITED, "--frame", "-inf"),
    ],
    ids=lambda words: "_".join([words[0], *words[-2:]]),
)
def test_values_that_no_file_makes_right_are_wrong_usage(capsys, monkeypatch, tmp_path, words):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stop:
        main.main(list(words))
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert f"argument {words[-2]}" in error or f"/{words[-2]}" in error
    assert words[-1].rpartition("=")[2] in error
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "verb", "wrong"),
    [
        (("paint",), "palette4d VERB", "'paint'"),
        (("analyze",), "palette4d analyze", "CLIP, -o/--output"),
        (("analyze", "c", "-o", "a", "--verts", "3"), "palette4d analyze", "--verts"),
        (("render", EDITED), "palette4d render", "CLIP"),
        (("edit", EDITED, "reset", "v1", "--no"), "palette4d edit SIDECAR reset", "--no"),
    ],
)
def test_wrong_usage_is_two_lines(capsys, words, verb, wrong):
    with pytest.raises(SystemExit) as stop:
        main.main(list(words))
    assert stop.value.code == 2
    first, second = capsys.readouterr().err.splitlines()
    assert first == f"usage: {verb} … ({verb.removesuffix(' VERB')} --help)"
    assert wrong in second


def test_negative_frames_of_every_verb(tmp_path, capsys):
    folder = tmp_path / "clip"
    for frame in range(-5, -2):
        write_image(folder / f"c.{frame:04d}.png", mixture(CORNERS, frame + 9))
    out = tmp_path / "a.p4d.json"
    analyze = ["analyze", str(folder), "-o", str(out), "--quiet"]
    assert main.main([*analyze, "--frames", "-5--4"]) == 0
    frames = json.loads(out.read_text())["clip"]["frames"]
    assert (frames["first"], frames["last"]) == (-5, -4)

    graded = tmp_path / "graded"
    render = ["render", str(out), str(folder), "-o", str(graded / "o.####.png")]
    assert main.main([*render, "--frames", "-5--4"]) == 0
    assert sorted(path.name for path in graded.iterdir()) == ["o.-004.png", "o.-005.png"]

    picture, table = tmp_path / "a.png", tmp_path / "a.cube"
    plot = ["plot", str(out), "-o", str(picture), "--width", "400"]
    assert main.main([*plot, "--frames", "-5,-4"]) == 0
    assert picture.stat().st_size > 0
    bake = ["bake", BEYOND, "-o", str(table), "--size", "2", "--json"]
    capsys.readouterr()
    assert main.main([*bake, "--frame", "-3"]) == 0
    assert json.loads(capsys.readouterr().out)["frame"] == -3


def test_one_frame_is_not_1_frames(tmp_path, capsys):
    folder = grey_levels(tmp_path / "in", range(5, 6))
    sample = tmp_path / "sample"
    words = ["sample-clip", "-o", str(sample / "o.##.png"), "--size", "32x32"]
    assert main.main([*words, "--frames", "1"]) == 0
    assert "wrote 1 frame, " in capsys.readouterr().out
    assert main.main(["analyze", str(sample), "-o", str(tmp_path / "a.p4d.json")]) == 0
    assert "sample: 1 frame, 32x32" in capsys.readouterr().out
    assert main.main(["info", str(tmp_path / "a.p4d.json")]) == 0
    printed = capsys.readouterr().out
    assert "blocks " not in printed
    assert "0 vertices, 0 stops" in printed
    render = ["render", EDITED, str(folder), "-o", str(tmp_path / "o.png")]
    assert main.main(render) == 0
    assert "1 frames" not in capsys.readouterr().out


def test_counts():
    assert [counted(n, "stop") for n in (0, 1, 2)] == ["0 stops", "1 stop", "2 stops"]
    assert counted(1, "vertex", "vertices") == "1 vertex"
    assert counted(4, "vertex", "vertices") == "4 vertices"


def test_times_are_ranges_with_fractions():
    assert times("12.5,0-4x2,2") == [0, 2, 4, 12.5]
    assert times("-1.5,-3--2") == [-3, -2, -1.5]
