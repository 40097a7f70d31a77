"""Every figure of the analysis against an independent evaluator that counts every pixel.

`evaluate.py` of the shared material shares no code with palette4d. Statistics keep every colour
here; the two must agree to 1e-6, frame by frame.
"""

from __future__ import annotations

import dataclasses
import importlib.util
import itertools
import json
import shutil
import subprocess
import sys

import numpy as np
import pytest
from palette4d.analysis import colour_statistics, pipeline
from palette4d.analysis.losses import LOST, loss_weights, smoothness, summarise
from palette4d.analysis.options import AnalysisOptions
from scipy.spatial import ConvexHull

from palette4d import _core
from palette4d.media.clip import open_clip

EXACT = AnalysisOptions(colours=10**6)
AGREE = 1e-6


@pytest.fixture(scope="module")
def judge(shared, tmp_path_factory):
    """Run the evaluator's program on frames and a palette; its result, a row a frame."""
    program = shared / "tools" / "evaluate.py"
    if not program.is_file():
        pytest.skip(f"the evaluator is absent: no file {program}")

    def run(frames, palette):
        folder = tmp_path_factory.mktemp("evaluator")
        (folder / "palette.json").write_text(json.dumps(palette))
        command = [sys.executable, program, frames, folder / "palette.json", "--out"]
        subprocess.run([*command, folder / "result.json"], check=True, capture_output=True)
        return json.loads((folder / "result.json").read_text())

    return run


@pytest.fixture(scope="module")
def measured(repo_root):
    """The module that the benchmarks measure with."""
    spec = importlib.util.spec_from_file_location(
        "benchmark_evaluator", repo_root / "benchmarks" / "evaluator.py"
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


def exact_colours(clip, measured):
    """Frame numbers, and the colours of each, no two of them in one bin.

    Pixels are read as float32; at the distance where eq. 3 stops, pixels that tie in 8 bits would
    not tie any more, hence `unrounded`.
    """
    numbers, trees = [], []
    for number, image in open_clip(str(clip)).iter_colours():
        frame = colour_statistics.gather(number, image, EXACT)
        distinct = len(np.unique(np.rint(image * 255).astype(np.uint8).reshape(-1, 3), axis=0))
        assert len(frame.colours) == distinct
        numbers.append(number)
        rgb = measured.unrounded(frame.colours.rgb)
        np.testing.assert_allclose(rgb, frame.colours.rgb, rtol=0, atol=1e-7)
        trees.append(_core.ColourTree(rgb, frame.colours.counts))
    return numbers, trees


def compare(rows, k, result):
    """The core's rows R, C, shape, outside, farthest, and K, against the evaluator's result."""
    for row, expected in zip(rows, result["frames"], strict=True):
        loss = EXACT.lambda_ * row[0] + row[1]
        figures = [row[0], row[1], loss, row[3], row[4]]
        wanted = [expected[name] for name in ("R", "C", "L", "outside", "max_dist")]
        np.testing.assert_allclose(figures, wanted, rtol=0, atol=AGREE)
    mean, losses = result["mean"], summarise(rows, k, EXACT)
    found = [losses.R, losses.C, losses.L, losses.K, losses.L_prime, losses.outside]
    names = ["R", "C", "L", "K", "L_prime", "outside", "max_dist"]
    wanted = [mean[name] for name in names]
    np.testing.assert_allclose([*found, losses.max_distance], wanted, rtol=0, atol=AGREE)


def evaluate(blocks, vertices, frames, colours):
    loss = _core.PolytopeLoss(blocks, np.array(frames, float), colours)
    which = list(range(len(frames)))
    return loss.evaluate(vertices, which, loss_weights(EXACT), 0, False)[0]


def some_frames(clip, folder):
    """Every seventh frame, the first and the last of 50 among them."""
    out = folder / "some"
    out.mkdir()
    for source in sorted(clip.iterdir())[:50:7]:
        shutil.copy(source, out)
    return out


def evaluators_form(palette):
    """A palette as the evaluator reads it: time from 0 to 1."""
    first = min(palette.cuts)
    vertices = palette.vertices - [0, 0, 0, first]
    vertices[:, 3] /= palette.length
    return {
        "frames": [
            {
                "t": (n - first) / palette.length,
                "vertices": cut.rgb.tolist(),
                "faces": cut.faces.tolist(),
            }
            for n, cut in palette.cuts.items()
        ],
        "vertices4d": vertices.tolist(),
        "edges": palette.edges.tolist(),
        "blocks": [list(block) for block in palette.blocks],
    }


def test_the_default_result_of_seasons(seasons, judge, measured, tmp_path):
    path = tmp_path / "seasons.p4d.json"
    command = [sys.executable, "-m", "palette4d", "analyze", str(seasons), "-o", str(path)]
    subprocess.run([*command, "--quiet"], check=True)
    clip = some_frames(seasons, tmp_path)
    numbers, colours = exact_colours(clip, measured)
    palette = measured.TimedPalette.of_sidecar(path)
    palette = dataclasses.replace(palette, cuts={n: palette.cuts[n] for n in numbers})
    result = judge(clip, evaluators_form(palette))
    polytope = _core.read_sidecar(str(path)).polytope
    blocks = [
        (s["first"], s["last"], s["tracks"], s["faces"])
        for s in polytope.sections
        if not s["transition"]
    ]
    rows = evaluate(blocks, polytope.vertices, numbers, colours)
    k, _ = smoothness(polytope.vertices, polytope.edges, 49.0)
    compare(rows, k, result)

    # The paper's authors' program: 23 vertices, L' 0.146, 4.8 % outside.
    mean = result["mean"]
    assert len(polytope.vertices) <= 20
    stated = json.loads(path.read_text())["quality"]["stages"][-1]
    assert stated["L_prime"] <= 0.09
    assert stated["outside_1_255"] <= 0.025
    assert stated["max_distance"] <= LOST  # no pixel is lost
    # What the sidecar and the benchmarks state is the same.
    assert stated["K"] == pytest.approx(mean["K"], abs=AGREE)
    figures = measured.measure(str(clip), {"default": palette})["default"]
    names = ["L", "K", "L_prime", "max_dist"]
    found = [figures.L, figures.K, figures.L_prime, figures.farthest]
    np.testing.assert_allclose(found, [mean[name] for name in names], rtol=0, atol=AGREE)
    assert (figures.vertices, figures.blocks) == (mean["vertices4d"], mean["blocks"])
    assert figures.colours == pytest.approx(mean["vertices"])


@pytest.mark.parametrize(("method", "most"), [("paper", 0.1), ("static", 0.102)])
def test_what_the_default_is_compared_with_stays_good(seasons, method, most):
    """Hulls are simplified edge by edge: their colours in another order gave the paper's rules L'
    0.154. Static palettes hardly depend on it."""
    found = pipeline.analyze(open_clip(str(seasons)), AnalysisOptions(method=method))
    assert found.stages[-1].losses.L_prime <= most


def bad_palette(first, last):
    """Tracks (n, 2, 4) of a palette in two moments: far too small for most pixels, its upper
    corner pushed into the middle of the box, and three colours of it the same."""
    box = np.array(list(itertools.product([0.35, 0.55], repeat=3)))
    box[7] = 0.42, 0.43, 0.44
    box[3] = box[1]
    box[5] = box[1]
    triangles = "013 032 045 051 237 276 026 064 157 173 467 475"
    faces = np.array([[int(i) for i in t] for t in triangles.split()], np.int32)
    later = box * 0.8 + 0.15 * box[:, ::-1]
    early = np.column_stack([box, np.full(8, float(first))])
    return np.vstack([early, np.column_stack([later, np.full(8, float(last))])]), faces


@pytest.mark.slow
def test_a_bad_palette(seasons, judge, measured, tmp_path):
    clip = some_frames(seasons, tmp_path)
    numbers, colours = exact_colours(clip, measured)
    assert numbers == list(range(0, 50, 7))
    vertices, faces = bad_palette(0, 49)
    tracks = [[i, 8 + i] for i in range(8)]
    edges = np.array(tracks, np.int32)

    share = np.array(numbers)[:, None, None] / 49
    slices = vertices[None, :8, :3] * (1 - share) + vertices[None, 8:, :3] * share
    document = {
        "frames": [
            {"t": n / 49, "vertices": rgb.tolist()} for n, rgb in zip(numbers, slices, strict=True)
        ],
        "vertices4d": np.column_stack([vertices[:, :3], vertices[:, 3] / 49]).tolist(),
        "edges": edges.tolist(),
    }
    result = judge(clip, document)
    # Bad it is: nearly everything far outside, not convex, and colours on top of each other.
    assert result["mean"]["outside"] > 0.8
    assert result["mean"]["max_dist"] > 0.5
    assert len(np.unique(slices[0], axis=0)) == 6
    assert len(ConvexHull(slices[0]).vertices) < 6

    rows = evaluate([(0.0, 49.0, tracks, faces)], vertices, numbers, colours)
    k, _ = smoothness(vertices, edges, 49.0)
    compare(rows, k, result)


def test_the_evaluator_checks_itself(shared):
    """Its hand-worked cases hold here, so that the comparisons above compare with something."""
    program = shared / "tools" / "evaluate.py"
    if not program.is_file():
        pytest.skip(f"the evaluator is absent: no file {program}")
    done = subprocess.run([sys.executable, program, "--selftest"], check=True, capture_output=True)
    assert b"selftest ok" in done.stdout
