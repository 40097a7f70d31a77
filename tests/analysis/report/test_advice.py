"""Warnings: what is said of a palette that does not fit, and that what is advised helps."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from analysis_frames import mixture
from palette4d.analysis import pipeline
from palette4d.analysis.options import METHODS, OPTIONS, AnalysisOptions, parse_setting
from palette4d.analysis.report.advice import warnings
from palette4d.analysis.report.quality import FrameFit, Report

from palette4d.media.array_clip import ArrayClip

DARK = np.array([[0.02, 0.02, 0.05], [0.3, 0.1, 0.05], [0.1, 0.3, 0.1], [0.1, 0.1, 0.3]])
LIGHT = 1 - 0.5 * DARK
FLASH = {"gamma": 0.0003, "handle_cost": 0.001, "blocks": 9}


def report(**changes) -> Report:
    """A good palette's report, but for `changes`."""
    good = {
        "fits": tuple(FrameFit(i, 0.05, 0.02, 0.01, 0.1) for i in range(9)),
        "closest": (0.2, 3, "v1", "v2"),
        "least_used": ("v3", 0.05),
        "concavity": (0.0, 0),
        "crossed": (0.0, 0),
        "splits": 0,
        "merges": 0,
        "colours": 6.0,
    }
    return Report(**(good | changes))


LOOSE = tuple(FrameFit(i, 0.4, 0.1, 0.1, 0.1) for i in range(9))
ONE_BAD = (*report().fits[:4], FrameFit(4, 0.7, 0.3, 0.3, 0.1), *report().fits[5:])
TROUBLES = {
    "loose": {"fits": LOOSE},
    "one bad frame": {"fits": ONE_BAD},
    "look-alikes": {"closest": (0.03, 3, "v1", "v2")},
    "concavity": {"concavity": (0.2, 5)},
    "unused": {"least_used": ("v3", 0.0001)},
}


def said(changes, method="skew", farthest=None, brightest=1.0, linear="", **options):
    return warnings(
        report(**changes),
        AnalysisOptions(method=method, **options),
        farthest or {},
        brightest=brightest,
        linear=linear,
    )


@pytest.mark.parametrize("method", METHODS)
def test_a_good_palette_is_left_alone(method):
    assert said({}, method) == ()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("trouble", TROUBLES)
def test_only_options_of_the_method_are_advised(trouble, method):
    if method == "rgbt" and trouble == "concavity":
        return  # its slices are those of a convex hull
    (text,) = said(TROUBLES[trouble], method)
    for name, option in OPTIONS.items():
        if method not in option.methods:
            assert not re.search(rf"\b{name}\b", text)


def test_the_limit_that_binds_is_named():
    (text,) = said({"fits": LOOSE}, vertices=16)
    assert "raise vertices=…" in text
    assert "handle_cost" not in text


def test_scene_linear_light_needs_its_space_first():
    for how in ({"brightest": 50.0}, {"linear": "lin_ap1_scene"}):
        (text,) = said({"fits": LOOSE, "closest": (0.01, 3, "v1", "v2")}, **how)
        assert "input_space=…" in text
        assert "handle_cost" not in text


def test_colours_that_simpler_palettes_hold_are_named():
    lost = FrameFit(7, 0.05, 0.02, 0.01, 0.32, 0.0004)
    far = {"fits": (*report().fits[:7], lost, report().fits[8])}
    (text,) = said(far, farthest={"static_hull": 0.22, "frame_hulls": 0.3})
    for part in ("frame 7", "0.04%", "0.32", "0.22", "reach=0.05", "lambda_=500", "50 pixels"):
        assert part in text
    assert 'method="static"' in text
    (text,) = said(far, farthest={"static_hull": 0.22}, reach=0.0)
    assert "reach=0.1" in text
    (text,) = said(far, "paper", farthest={"frame_hulls": 0.2})
    assert "single frames' hulls leave 0.20" in text
    assert 'method="static"' not in text
    assert said(far, farthest={"static_hull": 0.31, "frame_hulls": 0.3}) == ()
    assert said(far, "static", farthest={"static_hull": 0.32}) == ()
    few = {"fits": (*report().fits[:8], dataclasses.replace(lost, lost=0.00005))}
    assert said(few, farthest={"static_hull": 0.02, "frame_hulls": 0.02}) == ()


def test_the_settings_for_a_flash_are_advised_until_they_are_given():
    (text,) = said({"fits": ONE_BAD})
    given = dict(map(parse_setting, re.findall(r"(\w+=[\d.]+)", text)))
    assert given == FLASH
    (text,) = said({"fits": ONE_BAD}, **given)
    assert "gamma" not in text
    assert "frames=…" in text


def flashing(frames: int = 9) -> ArrayClip:
    """Dark frames, the middle one bright."""
    return ArrayClip([mixture(LIGHT if i == frames // 2 else DARK, i) for i in range(frames)])


@pytest.mark.parametrize(
    ("frames", "options", "advised", "better"),
    [
        (9, {"method": "static"}, 'method="skew"', {}),
        (9, {"vertices": 9}, "vertices=…", {"vertices": 24}),
        pytest.param(15, {"gamma": 0.1}, "gamma=0.0003", FLASH, marks=pytest.mark.slow),
    ],
    ids=["static", "vertices", "a flash"],
)
def test_what_is_advised_helps(frames, options, advised, better):
    clip = flashing(frames)
    found = pipeline.analyze(clip, AnalysisOptions(**options), allow_cuts=True)
    (text,) = [note for note in found.notes if "fit" in note]
    assert advised in text
    mended = pipeline.analyze(clip, AnalysisOptions(**better), allow_cuts=True)
    assert not [note for note in mended.notes if "fit" in note]


def test_a_palette_that_crosses_itself_says_so():
    (text,) = said({"concavity": (0.2, 5), "crossed": (0.08, 6)})
    assert "frame 6 the palette crosses itself" in text
    assert "8.0%" in text
    assert "convexity=" in text
