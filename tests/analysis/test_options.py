"""Options and methods: a refused option has no effect on its method, an accepted one has one."""

from __future__ import annotations

import numpy as np
import pytest
from analysis_frames import mixture, noise, stats
from palette4d.analysis.options import (
    METHODS,
    OPTIONS,
    AnalysisOptions,
    check_methods,
    parse_setting,
)
from palette4d.analysis.pipeline import find_polytope

from palette4d.common.errors import Palette4dError

CORNERS = np.array(
    [[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9], [0.9, 0.8, 0.7]]
)
# Far from the defaults.
OTHERS = {
    "handle_cost": 0.5,
    "vertices": 9,
    "blocks": 1,
    "alpha": 0.1,
    "beta": 0.0,
    "eta1": 1.0,
    "eta2": 1.0,
    "gamma": 1.0,
    "removal_candidates": 1,
    "refinement_cycles": 0,
    "refinement_box": 0.001,
    "palette_size": 4,
    "merge_distance": 0.5,
    "hull_box": 0.0,
    "convexity": 0.0,
    "separation": 0.9,
    "reach": 0.01,
}


def result(frames, **options):
    palette = find_polytope(frames, AnalysisOptions(**options))
    return palette.polytope.vertices.tolist(), [stage.row() for stage in palette.stages]


# Frames whose hulls have five corners, and frames whose hulls have too many for a palette.
FRAMES = stats([mixture(CORNERS * (0.6 + 0.4 * np.sin(i)) + 0.02 * i, i, 300) for i in range(4)])
MANY = stats([noise(i) for i in range(4)])


@pytest.mark.parametrize("method", METHODS)
def test_an_option_without_effect_is_refused_and_has_none(method):
    ignored = {name: OTHERS[name] for name in OTHERS if method not in OPTIONS[name].methods}
    for name, value in ignored.items():
        with pytest.raises(Palette4dError, match=f"{name} has no effect"):
            check_methods(method, {name: value})
    check_methods(method, {name: OTHERS[name] for name in OTHERS.keys() - ignored.keys()})
    assert result(FRAMES, method=method, **ignored) == result(FRAMES, method=method)


@pytest.mark.parametrize(
    ("method", "option"),
    [(m, o) for o in OTHERS for m in ("static", "rgbt") if m in OPTIONS[o].methods],
)
def test_an_option_of_a_method_has_an_effect(method, option):
    found, usual = (result(MANY, method=method, **one) for one in ({option: OTHERS[option]}, {}))
    assert found != usual


@pytest.mark.parametrize("name", OPTIONS)
def test_values_beyond_their_limits_are_refused(name):
    option = OPTIONS[name]
    for value in (option.low, option.high):
        AnalysisOptions(**{option.field: value})
    for value in (option.low - 0.5, 2 * option.high, float("nan")):
        with pytest.raises(Palette4dError, match=f"option {name}: found"):
            AnalysisOptions(**{option.field: value})


def test_an_unknown_method_is_refused():
    with pytest.raises(Palette4dError, match="magic"):
        AnalysisOptions(method="magic")


def test_settings_are_read_by_the_names_that_sidecars_record():
    recorded = AnalysisOptions(lambda_=7.0, blocks=2).recorded()
    method = recorded.pop("method")
    given = dict(parse_setting(f"{name}={value}") for name, value in recorded.items())
    assert AnalysisOptions(method=method, **given) == AnalysisOptions(lambda_=7.0, blocks=2)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("handel_cost=1", "handle_cost"),
        ("handle-cost=1", "handle_cost"),
        ("reach", "NAME=VALUE"),
        ("blocks=2.5", "whole number"),
        ("blocks=0", "from 1"),
        ("gamma=nan", "from 0"),
    ],
)
def test_a_setting_that_cannot_be_read_says_what_is_expected(text, named):
    with pytest.raises(Palette4dError, match=named):
        parse_setting(text)
