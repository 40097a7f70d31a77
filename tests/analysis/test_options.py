"""Which method looks at which option: what is refused has no effect, what is taken has one."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from analysis_frames import mixture, stats
from palette4d.analysis import methods
from palette4d.analysis.options import LIMITS, METHODS, METHODS_OF, AnalysisOptions

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


def result(**options):
    palette = methods.analyze(FRAMES, AnalysisOptions(**options))
    return palette.polytope.vertices.tolist(), [stage.row() for stage in palette.stages]


FRAMES = stats([mixture(CORNERS * (0.6 + 0.4 * np.sin(i)) + 0.02 * i, i, 300) for i in range(4)])


@pytest.mark.parametrize("method", METHODS)
def test_what_a_method_refuses_would_change_nothing(method):
    ignored = {name: OTHERS[name] for name, of in METHODS_OF.items() if method not in of}
    assert ignored
    assert result(method=method, **ignored) == result(method=method)


@pytest.mark.parametrize(
    ("method", "option"),
    [(m, o) for o, of in METHODS_OF.items() for m in ("static", "rgbt") if m in of],
)
def test_what_a_method_takes_counts(method, option):
    assert result(method=method, **{option: OTHERS[option]}) != result(method=method)


def test_only_options_are_named():
    names = {field.name for field in dataclasses.fields(AnalysisOptions)}
    assert set(METHODS_OF) <= names
    assert {method for of in METHODS_OF.values() for method in of} == set(METHODS)
    assert set(LIMITS) == names - {"method"}


@pytest.mark.parametrize("option", LIMITS)
def test_values_beyond_their_limits_are_refused(option):
    low, high = LIMITS[option]
    for value in (low, high):
        AnalysisOptions(**{option: value})
    for value in (low - 0.5, 2 * high, float("nan")):
        with pytest.raises(Palette4dError, match=f"{option.rstrip('_').replace('_', '-')}: found"):
            AnalysisOptions(**{option: value})
