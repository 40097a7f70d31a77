"""The timeline's layout, as `plot` and the window draw it."""

from pathlib import Path

import numpy as np
import pytest

from palette4d import _core
from palette4d.plotting.layout import (
    Disc,
    Scale,
    Timeline,
    disc_names,
    half_bands,
    meet,
    names_around,
)
from palette4d.plotting.rows import PlottedPalette, arrange

GOLDEN = Path(__file__).resolve().parent.parent / "golden" / "sidecars"


def timeline(name: str, width: float = 800.0, row_height: float = 40.0) -> Timeline:
    palette = PlottedPalette.of(_core.read_sidecar(str(GOLDEN / f"{name}.p4d.json")))
    rows = arrange(palette.frames, palette.rgb, palette.edges)
    return Timeline(palette, rows, Scale(palette.first, palette.last, 0.0, width), row_height)


def test_frames_and_places_are_inverse() -> None:
    scale = Scale(10, 50, -200.0, 600.0)
    frames = np.array([10.0, 17.5, 50.0])
    np.testing.assert_allclose(scale.frame(scale.x(frames)), frames)
    assert scale.per_frame == 20
    assert float(scale.frame(-1e4)) == 10  # outside of the clip: its end
    assert float(Scale(3, 3, 0.0, 100.0).x(3)) == 50


@pytest.mark.parametrize("name", ["v1_split", "v1_merge", "v1_edited"])
def test_a_band_joins_the_vertices_of_its_edge(name: str) -> None:
    layout = timeline(name)
    for edge, (times, points) in layout.paths.items():
        ends = list(layout.palette.edges[edge])
        np.testing.assert_allclose(points[[0, -1], 0], layout.scale.x(layout.palette.frames[ends]))
        np.testing.assert_allclose(points[[0, -1], 1], layout.vertex_y[ends], atol=1e-6)
        assert (np.diff(times) > 0).all()
        assert (np.diff(points[:, 0]) >= 0).all()
        np.testing.assert_allclose(points[:, 0], layout.scale.x(times), atol=0.5)
        upper, lower = half_bands(points, 5.0)
        np.testing.assert_allclose(np.linalg.norm(upper - lower, axis=1), 10.0)
        assert (upper[:, 1] <= lower[:, 1]).all()


def test_a_point_on_a_band_finds_its_edge() -> None:
    layout = timeline("v1_split")
    for edge, (times, points) in layout.paths.items():
        middle = len(times) // 2
        assert layout.edge_near(*points[middle].tolist(), 6.0) == edge
    assert layout.edge_near(400.0, -30.0, 6.0) is None


def test_of_stops_that_nobody_can_tell_apart_some_are_drawn() -> None:
    layout = timeline("v1_edited")
    _, edge, frame, colour = layout.palette.stops[0]
    first, last = layout.palette.frames[list(layout.palette.edges[edge])]
    frames = np.linspace(first, last, 20_000)[1:-1].tolist()
    layout.palette.stops[:] = [(f"t{k}", edge, at, colour) for k, at in enumerate(frames)]
    discs = layout.discs(0.0, 800.0)
    assert 100 < sum(disc.kind == "stop" for disc in discs) <= 801
    assert 1 < len(disc_names(discs, 8.0, lambda text: 20.0, 1000.0)) < 200
    layout.palette.stops[:] = [("a", edge, frame, colour), ("b", edge, frame + 1e-6, colour)]
    assert sum(disc.kind == "stop" for disc in layout.discs(0.0, 800.0)) == 2


@pytest.mark.parametrize("width", [800.0, 60.0])
def test_discs_of_a_row_do_not_overlap(width: float) -> None:
    layout = timeline("v1_edited", width)
    discs = layout.discs(-50.0, width + 50.0)
    assert [d.id for d in discs if d.kind == "stop"] == [s[0] for s in layout.palette.stops]
    for one in discs:
        for other in discs:
            if one is not other and one.y == other.y and one.x <= other.x:
                assert other.x - one.x >= one.radius + other.radius


def test_names_do_not_cover_discs_or_each_other() -> None:
    layout = timeline("v1_edited", 300.0, 44.0)
    discs = layout.discs(-20.0, 320.0)
    names = disc_names(discs, 9.0, lambda text: 7.0 * len(text), layout.height)
    assert {name.text for name in names if name.bright} == {
        disc.id for disc in discs if disc.kind != "plain"
    }
    for k, one in enumerate(names):
        for other in names[:k]:
            apart = abs(one.x - other.x) >= 3.5 * (len(one.text) + len(other.text))
            assert apart or abs(one.y - other.y) >= 8.5


def test_names_of_the_first_and_last_frame_are_beside_their_discs_where_they_fit() -> None:
    layout = timeline("v1_edited", 300.0, 24.0)
    discs = layout.discs(-20.0, 320.0)
    ends = layout.scale.left, layout.scale.right
    outer = {disc.id: disc for disc in discs if disc.home in ends}
    assert outer
    for space in (60.0, 12.0):
        names = disc_names(
            discs, 9.0, lambda text: 7.0 * len(text), layout.height, beside=(*ends, space)
        )
        seen = {name.text for name in names if name.x < ends[0] or name.x > ends[1]}
        assert seen == (set(outer) if space > 30 else set())


def test_names_around_discs_cover_nothing() -> None:
    grey = np.full(3, 0.5)
    random = np.random.default_rng(2)
    places = np.vstack([random.normal(0, 4, (5, 2)), random.normal(60, 4, (3, 2))])
    discs = [
        Disc(f"v{k}", "plain", 0.0, -1, x, y, 5.0, x, grey, grey)
        for k, (x, y) in enumerate(places.tolist())
    ]
    corner = (66.0, 50.0, 78.0, 70.0)
    names = names_around(discs, 7.0, lambda text: 5.0 * len(text), [corner])
    assert {name.text for name, _ in names} == {disc.id for disc in discs}
    boxes = [(n.x - 5, n.y - 3.3, n.x + 5, n.y + 3.3) for n, _ in names]
    boxes += [corner, *((d.x - 5, d.y - 5, d.x + 5, d.y + 5) for d in discs)]
    for k, one in enumerate(boxes[: len(names)]):
        assert not any(meet(one, other) for other in boxes[k + 1 :])


def test_ticks_are_round_and_have_room() -> None:
    layout = timeline("v1_split", 800.0)
    first, last = layout.palette.first, layout.palette.last
    ticks = layout.scale.ticks(0.0, 800.0)
    assert ticks[0] == first
    assert ticks[-1] == last
    assert np.diff(layout.scale.x(ticks)).min() >= 35
    # Between two frames there is nothing to name.
    assert Scale(first, last, -4e5, 4e5).ticks(0.0, 300.0) == [10.0]


def test_colours_between_handles_are_the_cores() -> None:
    layout = timeline("v1_edited")
    palette = layout.palette
    # Also at a stop, in a transition and where nothing but vertices is.
    times = np.r_[np.linspace(palette.first, palette.last, 37), 4.5, 9, 9.25, 9.6]
    before, after = palette.sampled(times)
    for k, time in enumerate(times):
        cut = _core.slice_at(palette.sidecar.polytope, time)
        edited = _core.edited_colours(palette.sidecar.polytope, palette.sidecar.edits, cut)
        for index, edge in enumerate(cut.edges):
            if edge >= 0:
                assert (before[edge, k] == cut.rgb[index]).all()
                assert (after[edge, k] == edited[index]).all()
            else:
                vertex = cut.ends[index, 0]
                assert (palette.edited[vertex] == edited[index]).all()
                touching = [e for e, ends in enumerate(palette.edges) if vertex in ends]
                assert (before[touching, k] == cut.rgb[index]).all()
                assert (after[touching, k] == edited[index]).all()
