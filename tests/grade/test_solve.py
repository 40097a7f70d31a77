"""The solver of picks: met, guarded, local in time and colour, bounded, and the same every time."""

from __future__ import annotations

import copy
import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from palette4d.common.errors import Palette4dError
from palette4d.grade import effects, solve
from palette4d.grade.document import Document
from palette4d.grade.picks import MOST_PICKS, Pick, unmet
from palette4d.grade.sidecar import Fields

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"


@pytest.fixture
def fields() -> Fields:
    """v1_split: frames 0 to 18, four colours, of which one splits."""
    found: Fields = json.loads((GOLDEN / "v1_split.p4d.json").read_text())
    return found


def pick(id_: str, rgb: Any, to: Any = None, frame: float = 5, **more: Any) -> Fields:
    kind = "hold" if to is None else "pick"
    found = {"id": id_, "kind": kind, "frame": frame, "rgb": list(rgb), **more}
    return found if to is None else found | {"to": list(to)}


def solved(fields: Fields, *picks: Fields, **edits: Any) -> tuple[Document, dict[str, Fields]]:
    """Solve picks; return the document with their solution, and what was measured."""
    found = copy.deepcopy(fields)
    found["edits"] |= {"picks": list(picks), **edits}
    solution, measured = solve.solve(found)
    found["edits"]["solution"] = solution
    return Document(found), measured


def moved(document: Document, rgb: Any, frame: float) -> Any:
    colour = np.array(rgb, np.float32).reshape(1, 1, 3)
    return (document.recolour(colour, frame) - colour)[0, 0]


MIDDLE = (0.4, 0.4, 0.4)
OTHER = (0.3, 0.5, 0.35)


def test_a_pick_and_a_hold_are_met_at_all_frames(fields: Fields) -> None:
    document, measured = solved(
        fields, pick("p1", MIDDLE, (0.5, 0.35, 0.4)), pick("p2", (0.25, 0.4, 0.3))
    )
    first, last, _ = document.frames
    for frame in np.linspace(first, last, 13):
        np.testing.assert_allclose(moved(document, MIDDLE, frame), (0.1, -0.05, 0), atol=0.006)
        np.testing.assert_allclose(moved(document, (0.25, 0.4, 0.3), frame), 0, atol=0.006)
    assert measured["p1"]["residual"] < 0.006
    assert 0 <= measured["p1"]["global"] <= 1


def test_nothing_changes_outside_of_a_range(fields: Fields) -> None:
    document, _ = solved(
        fields, pick("p1", MIDDLE, (0.6, 0.3, 0.4), **{"from": 6, "until": 9, "fade": 2})
    )
    np.testing.assert_allclose(moved(document, MIDDLE, 7), (0.2, -0.1, 0), atol=0.006)
    np.testing.assert_allclose(moved(document, MIDDLE, 5), (0.1, -0.05, 0), atol=0.01)
    for frame in (0, 2.5, 4, 11, 11.5, 18):
        palette = document.palette(frame)
        np.testing.assert_array_equal(palette.edited, palette.rgb)
        assert (
            not document.core.bumps_at(frame).any() or (moved(document, MIDDLE, frame) == 0).all()
        )


def test_a_second_range_leaves_the_frames_of_the_first_alone(fields: Fields) -> None:
    early = pick("p1", MIDDLE, (0.6, 0.3, 0.4), **{"from": 1, "until": 4})
    late = pick("p2", OTHER, (0.2, 0.5, 0.6), frame=14, **{"from": 12, "until": 16})
    alone, _ = solved(fields, early)
    both, _ = solved(fields, early, late)
    for frame in (0, 1, 3, 5):
        np.testing.assert_allclose(
            moved(both, MIDDLE, frame), moved(alone, MIDDLE, frame), atol=1e-6
        )
    np.testing.assert_allclose(moved(both, OTHER, 14), (-0.1, 0, 0.25), atol=0.006)


def test_a_second_range_leaves_a_pick_of_the_whole_clip_alone(fields: Fields) -> None:
    whole = pick("p1", MIDDLE, (0.6, 0.3, 0.4))
    late = pick("p2", OTHER, (0.2, 0.5, 0.6), frame=12, **{"from": 11, "until": 13, "fade": 2})
    alone, _ = solved(fields, whole)
    both, _ = solved(fields, whole, late)
    for frame in (0, 5, 9, 15, 18):
        for colour in (MIDDLE, OTHER):
            np.testing.assert_allclose(
                moved(both, colour, frame), moved(alone, colour, frame), atol=solve.STRAIGHT
            )


def test_a_ramp_beside_a_pick_of_the_whole_clip_has_no_steps(fields: Fields) -> None:
    """Early in the ramp hardly anything differs, of no colour; half of it is half of all."""
    sky, wall = (0.3, 0.25, 0.5), (0.35, 0.5, 0.3)
    rows = [*cluster(MIDDLE, 0.1), *cluster(OTHER, 0.5), *cluster(sky, 0.2), *cluster(wall, 0.2)]
    found = {**fields, "colours": [{"frame": 0, "rgbw": rows}]}
    whole = pick("p1", MIDDLE, (0.65, 0.25, 0.4))
    late = pick("p2", OTHER, (0.5, 0.3, 0.5), frame=12, **{"from": 12, "until": 14, "fade": 8})
    key = pick("p3", (0.9, 0.9, 0.9), frame=5)  # far away; so that frame 5 is solved
    alone, both = solved(found, whole, key)[0], solved(found, whole, late, key)[0]
    for row in rows:
        colour = row[:3]
        start, full = moved(alone, colour, 4), moved(both, colour, 12)
        for frame in (5, 8):
            part = (frame - 4) / 8
            expected = (1 - part) * start + part * full
            np.testing.assert_allclose(moved(both, colour, frame), expected, atol=0.012)


def test_what_is_near_a_steady_pick_does_not_swing(fields: Fields) -> None:
    """The palette's colours drift and one splits; the same of them meet the pick at all frames."""
    sky, cloud, roof = (0.37, 0.13, 0.56), (0.44, 0.24, 0.61), (0.26, 0.44, 0.49)
    found = {
        **fields,
        "colours": [{"frame": 0, "rgbw": [[*sky, 0.4], [*cloud, 0.4], [*roof, 0.2]]}],
    }
    document, _ = solved(found, pick("p1", sky, (0.62, 0.06, 0.25)))
    for colour in (sky, cloud, roof):
        changes = np.array([moved(document, colour, frame) for frame in range(19)])
        assert np.ptp(changes, axis=0).max() < 0.05


def test_a_shift_stays_in_range_where_the_colour_is_dark(fields: Fields) -> None:
    path = [{"frame": 0, "rgb": [0.4, 0.3, 0.3]}, {"frame": 18, "rgb": [0.15, 0.2, 0.2]}]
    asked = pick("p1", (0.4, 0.3, 0.3), (0.1, 0.4, 0.4), frame=0, path=path)
    document, _ = solved(fields, asked)
    np.testing.assert_allclose(moved(document, (0.4, 0.3, 0.3), 0), (-0.3, 0.1, 0.1), atol=0.01)
    # 0.15 of the 0.3 of red that the whole change would take.
    np.testing.assert_allclose(
        moved(document, (0.15, 0.2, 0.2), 18), (-0.15, 0.05, 0.05), atol=0.01
    )


def test_what_else_changes_is_measured_as_the_picture_changes(fields: Fields) -> None:
    colours = [[*MIDDLE, 0.5], [0.2, 0.15, 0.3, 0.3], [0.15, 0.15, 0.6, 0.2]]
    found = {**fields, "colours": [{"frame": 5, "rgbw": colours}]}
    document, _ = solved(found, pick("p1", MIDDLE, (0.6, 0.3, 0.4)))
    changes = [np.abs(moved(document, colour[:3], 5)).max() for colour in colours]
    least = (changes[1] + changes[2]) / 2
    effect = document.side_effect(least=float(least))
    changes = [np.abs(moved(document, colour[:3], effect.frame)).max() for colour in colours]
    large = 1 if changes[1] > changes[2] else 2
    assert effect.others == pytest.approx(colours[large][3])
    assert effect.share == pytest.approx(0.5 + colours[large][3])
    sizes = [change * np.sqrt(colour[3]) for change, colour in zip(changes, colours, strict=True)]
    assert list(effect.most) == colours[1 if sizes[1] > sizes[2] else 2][:3]
    # The picked colour itself is none of the others, however much it changes.
    assert document.side_effect(least=0.0).others == pytest.approx(0.5)


def test_the_frame_where_most_else_changes_is_named(fields: Fields) -> None:
    street, wall = (0.35, 0.35, 0.4), (0.25, 0.52, 0.3)
    early = cluster(MIDDLE, 0.9) + cluster(street, 0.1)
    late = cluster(MIDDLE, 0.1) + cluster(wall, 0.9)
    found = {**fields, "colours": [{"frame": 0, "rgbw": early}, {"frame": 18, "rgbw": late}]}
    document, _ = solved(found, pick("p1", MIDDLE, (0.6, 0.2, 0.4), frame=2, radius=0.3))
    effect = document.side_effect()
    assert effect.frame >= 8  # not where it was picked: there the wall is not yet
    assert effect.others > 0


def test_shades_of_a_pick_change_and_are_none_of_the_others(fields: Fields) -> None:
    shade = [colour * 0.8 for colour in MIDDLE]
    rows = [[*MIDDLE, 0.5], [*shade, 0.5]]
    found = {**fields, "colours": [{"frame": 0, "rgbw": rows}]}
    document, _ = solved(found, pick("p1", MIDDLE, (0.7, 0.3, 0.4), radius=0.3))
    assert np.abs(moved(document, shade, 5)).max() > 10 / 255
    effect = document.side_effect()
    assert (effect.share, effect.others) == (pytest.approx(1), 0)


def test_tinted_greys_are_told_with_holds_that_cure_them(fields: Fields) -> None:
    """A street gets a tint of 7 of 255 beside a red car; what is no grey may change so much."""
    street, leaves, car = [0.35, 0.36, 0.34], [0.2, 0.36, 0.15], (0.5, 0.2, 0.2)
    rows = [[*street, 0.6], [*leaves, 0.35], [*car, 0.05]]
    found = {**fields, "colours": [{"frame": 5, "rgbw": rows}]}
    asked = pick("p1", car, (0.4, 0.3, 0.3))
    for picks in ([asked], [asked, pick("p2", street)]):
        document, _ = solved(found, *picks)
        edits = document.fields()["edits"]
        edits["solution"]["vertices"] = [
            {"vertex": vertex["id"], "by": [-7 / 255, 0, 7 / 255]}
            for vertex in found["polytope"]["vertices"]
        ]
        effect = effects.side_effect({**found, "edits": edits}, 10 / 255)
        assert effect.others == pytest.approx(0.6 if len(picks) == 1 else 0)
        if len(picks) == 1:
            assert effect.holds == (tuple(street),)
            assert effect.left == 0


def test_no_hold_is_proposed_that_takes_from_a_pick(fields: Fields) -> None:
    """A gradient goes on from the picked colour: a hold would tear it."""
    rows = [[*rgb, 1 / 12] for rgb in np.linspace(MIDDLE, (0.4, 0.4, 0.15), 12)]
    found = {**fields, "colours": [{"frame": 5, "rgbw": rows}]}
    asked = pick("p1", MIDDLE, (0.65, 0.25, 0.35), radius=0.3)
    effect = solved(found, asked)[0].side_effect()
    assert effect.others > 0
    held = solved(found, asked, pick("p2", effect.most))[0].around_picks()["p1"]
    assert held.taken["p2"] > effects.TAKEN
    assert effect.holds == ()


def test_no_hold_is_proposed_of_a_shadow_of_the_picked_thing(fields: Fields) -> None:
    """The palette takes a red car's shadow along; it is not near the car, but of its hue."""
    shadow, car, street = [0.2, 0.08, 0.09], (0.5, 0.2, 0.2), [0.3, 0.45, 0.5]
    rows = [[*car, 0.1], [*shadow, 0.2], [*street, 0.7]]
    found = {**fields, "colours": [{"frame": 5, "rgbw": rows}]}
    edits = solved(found, pick("p1", car, (0.3, 0.3, 0.3)))[0].fields()["edits"]
    edits["solution"]["vertices"] = [
        {"vertex": vertex["id"], "by": [-0.1, 0.05, 0.05]}
        for vertex in found["polytope"]["vertices"]
    ]
    effect = effects.side_effect({**found, "edits": edits}, 10 / 255)
    assert effect.others == pytest.approx(0.9)
    assert tuple(street) in effect.holds
    assert tuple(shadow) not in effect.holds


def test_the_holds_that_help_most_are_proposed(fields: Fields) -> None:
    """Two blues that one hold keeps are more than a green; a few pixels are worth no hold."""
    car, green, speck = (0.5, 0.2, 0.2), (0.2, 0.6, 0.2), (0.85, 0.85, 0.3)
    blues = [(0.2, 0.2, 0.6), (0.2, 0.23, 0.6)]
    shares = [(car, 0.047), (blues[0], 0.3), (blues[1], 0.3), (green, 0.35), (speck, 0.003)]
    rows = [[*rgb, share] for rgb, share in shares]
    found = {**fields, "colours": [{"frame": 5, "rgbw": rows}]}
    edits = solved(found, pick("p1", car, (0.3, 0.3, 0.3), radius=0.05))[0].fields()["edits"]
    edits["solution"]["vertices"] = [
        {"vertex": vertex["id"], "by": [-0.06, 0.06, 0.06]}
        for vertex in found["polytope"]["vertices"]
    ]
    effect = effects.side_effect({**found, "edits": edits}, 10 / 255)
    assert effect.others == pytest.approx(0.953)
    assert effect.holds[0] in blues
    assert effect.holds[1:] == (green,)
    assert effect.left == pytest.approx(0.003)


@pytest.mark.parametrize("seed", range(2))
def test_a_hold_never_adds_to_a_change(fields: Fields, seed: int) -> None:
    """Of no colour, in no frame: neither of the held one nor of any other."""
    rng = np.random.default_rng(seed)
    held = np.array(MIDDLE) + rng.uniform(-0.12, 0.12, 3)
    rows = [*cluster(MIDDLE, 0.3), *cluster(held, 0.1), *cluster((0.2, 0.2, 0.3), 0.6)]
    found = {**fields, "colours": [{"frame": 0, "rgbw": rows}]}
    asked = pick("p1", MIDDLE, (0.65, 0.25, 0.45), **{"from": 8, "until": 12, "fade": 4})
    alone, both = solved(found, asked)[0], solved(found, asked, pick("p2", held.tolist()))[0]
    colours = rng.uniform(-0.1, 1.1, (300, 1, 3)).astype(np.float32)
    for frame in (5, 6.5, 8, 10, 14):
        before, after = (np.abs(d.recolour(colours, frame) - colours) for d in (alone, both))
        assert (after <= before + 1e-6).all()
        np.testing.assert_allclose(moved(both, held, frame), 0, atol=0.002)


def test_a_hold_does_no_harm_where_it_meets_a_pick(fields: Fields) -> None:
    """A held sunset passes through the colour of the leaves that are picked."""
    path = [{"frame": 0, "rgb": [0.7, 0.4, 0.4]}, {"frame": 18, "rgb": [0.1, 0.4, 0.4]}]
    asked = pick("p1", MIDDLE, (0.6, 0.2, 0.5))
    sunset = pick("p2", (0.4, 0.4, 0.4), frame=9, path=path)
    alone, both = solved(fields, asked)[0], solved(fields, asked, sunset)[0]
    for frame in range(0, 19, 2):
        held = [0.7 - frame / 30, 0.4, 0.4]
        before, after = (np.abs(moved(d, held, frame)).max() for d in (alone, both))
        assert after <= before + 0.002
    np.testing.assert_allclose(moved(both, MIDDLE, 9), (0.2, -0.2, 0.1), atol=0.01)


def test_a_hold_leaves_a_ramp_as_it_is(fields: Fields) -> None:
    """Half of a ramp is half of the change, also beside a hold that is always there."""
    asked = pick("p1", MIDDLE, (0.6, 0.3, 0.4), **{"from": 8, "until": 12, "fade": 4})
    document, _ = solved(fields, asked, pick("p2", (0.2, 0.2, 0.5)))
    for frame, part in ((6, 0.5), (14, 0.5), (10, 1)):
        wanted = np.array((0.2, -0.1, 0)) * part
        np.testing.assert_allclose(moved(document, MIDDLE, frame), wanted, atol=0.01)


def test_a_colour_of_a_box_gives_way_where_it_is_another_things(fields: Fields) -> None:
    """The gaps between leaves have the sky's colour; later the sky is wide."""
    leaf, gap = np.array(MIDDLE), np.array((0.3, 0.45, 0.6))
    rows = [
        {"frame": t, "rgbw": [[*leaf, 0.3], [*gap, sky], [0.25, 0.2, 0.2, 0.7 - sky]]}
        for t, sky in ((0, 0.05), (9, 0.05), (18, 0.5))
    ]
    asked = pick("p1", leaf, (0.65, 0.25, 0.3), spread=[(gap - leaf).tolist()], radius=0.2)
    document, _ = solved({**fields, "colours": rows}, asked)
    assert np.abs(moved(document, gap, 5)).max() > 0.2
    assert np.abs(moved(document, gap, 18)).max() < 0.08
    np.testing.assert_allclose(moved(document, leaf, 18), (0.25, -0.15, -0.1), atol=0.02)


def test_a_channel_at_its_end_does_not_stop_a_change(fields: Fields) -> None:
    """Red is full and is to stay so; green changes all the same."""
    document, _ = solved(fields, pick("p1", (1.0, 0.5, 0.2), (1.0, 0.6, 0.2)))
    np.testing.assert_allclose(moved(document, (1.0, 0.5, 0.2), 5), (0, 0.1, 0), atol=0.006)


def test_what_holds_take_of_the_colours_near_a_pick(fields: Fields) -> None:
    beside = np.add(MIDDLE, (0.0, 0.1, -0.1))
    rows = [[*MIDDLE, 0.2], *cluster(np.add(MIDDLE, (0, 0.06, -0.06)), 0.4, 0.01), [0.2] * 4]
    found = {**fields, "colours": [{"frame": 0, "rgbw": rows}]}
    asked = pick("p1", MIDDLE, (0.6, 0.4, 0.4))
    alone = solved(found, asked)[0].around_picks()["p1"]
    held = solved(found, asked, pick("p2", beside.tolist()))[0].around_picks()["p1"]
    assert (alone.frame, alone.taken) == (5, {})
    assert held.taken["p2"] > effects.TAKEN
    assert held.share == pytest.approx(alone.share * (1 - held.taken["p2"]))


def test_how_much_the_shades_of_a_picked_colour_change(fields: Fields) -> None:
    """All of the hue are counted by their pixels; greys have none."""
    red, dark, green = (0.5, 0.2, 0.2), (0.15, 0.05, 0.06), (0.2, 0.45, 0.2)
    rows = [[*red, 0.1], [*dark, 0.3], [*green, 0.6]]
    found = {**fields, "colours": [{"frame": 0, "rgbw": rows}]}
    document = solved(found, pick("p1", red, (0.5, 0.3, 0.2), radius=0.06))[0]
    parts = [float(moved(document, c, 5)[1]) / 0.1 for c in (red, dark)]
    assert document.around_picks()["p1"].shades == pytest.approx(
        parts[0] / 4 + 3 * parts[1] / 4, abs=0.01
    )
    assert solved(found, pick("p1", MIDDLE, OTHER))[0].around_picks()["p1"].shades is None


def test_a_path_is_followed_by_shift_or_by_colour(fields: Fields) -> None:
    path = [{"frame": 0, "rgb": [0.3, 0.3, 0.3]}, {"frame": 18, "rgb": [0.5, 0.4, 0.4]}]
    asked = pick("p1", (0.3, 0.3, 0.3), (0.4, 0.3, 0.3), frame=0, path=path)
    shift, _ = solved(fields, asked)
    np.testing.assert_allclose(moved(shift, (0.5, 0.4, 0.4), 18), (0.1, 0, 0), atol=0.006)
    colour, _ = solved(fields, asked | {"toward": "colour"})
    np.testing.assert_allclose(moved(colour, (0.5, 0.4, 0.4), 18), (-0.1, -0.1, -0.1), atol=0.006)


def test_the_users_handles_are_counted_in(fields: Fields) -> None:
    vertex = {"vertex": "v4", "rgb": [0.9, 0.1, 0.1]}
    document, _ = solved(
        fields, pick("p1", MIDDLE, (0.5, 0.4, 0.4)), pick("p2", OTHER), vertices=[vertex]
    )
    np.testing.assert_allclose(moved(document, MIDDLE, 5), (0.1, 0, 0), atol=0.006)
    np.testing.assert_allclose(moved(document, OTHER, 5), 0, atol=0.006)


def cluster(rgb: Any, share: float, wide: float = 0.05) -> list[list[float]]:
    """Some colours around one, which share its part of the picture."""
    around = np.random.default_rng(1).normal(size=(8, 3)) * wide + rgb
    return [[*colour, share / 8] for colour in around.tolist()]


def test_a_rare_colour_changes_alone(fields: Fields) -> None:
    sign, hair, street = (0.7, 0.5, 0.2), (0.45, 0.4, 0.3), (0.35, 0.35, 0.4)
    rows = cluster(sign, 0.002, 0.01) + cluster(hair, 0.1) + cluster(street, 0.898)
    found = {**fields, "colours": [{"frame": 0, "rgbw": rows}]}
    document, measured = solved(found, pick("p1", sign, (0.2, 0.3, 0.8)))
    np.testing.assert_allclose(moved(document, sign, 5), (-0.5, -0.2, 0.6), atol=0.006)
    for other in (hair, street):
        assert np.abs(moved(document, other, 5)).max() < 3 / 255
    assert measured["p1"]["global"] < 0.1
    # The same change of what fills the picture moves the palette.
    document, measured = solved(found, pick("p1", street, (0.45, 0.3, 0.4)))
    assert measured["p1"]["global"] > 0.1


def test_a_wide_box_changes_as_a_whole(fields: Fields) -> None:
    ends = [[0.14, 0.0, -0.14], [-0.14, 0.0, 0.14]]
    narrow, _ = solved(fields, pick("p1", MIDDLE, (0.3, 0.4, 0.4), radius=0.15))
    wide, _ = solved(fields, pick("p1", MIDDLE, (0.3, 0.4, 0.4), radius=0.15, spread=ends))
    for end in ends:
        colour = np.add(MIDDLE, end)
        np.testing.assert_allclose(moved(wide, colour, 5), (-0.1, 0, 0), atol=0.006)
        assert moved(narrow, colour, 5)[0] > -0.09
    steps = [moved(wide, np.add(MIDDLE, np.multiply(ends[0], t)), 5)[0] for t in np.linspace(0, 1)]
    assert max(np.abs(np.diff(steps))) < 0.005  # no steps between them
    held, _ = solved(fields, pick("p1", OTHER, (0.5, 0.3, 0.3)), pick("p2", MIDDLE, spread=ends))
    for end in ends:
        np.testing.assert_allclose(moved(held, np.add(MIDDLE, end), 5), 0, atol=0.006)


def test_a_path_that_ends_ends_the_change(fields: Fields) -> None:
    path = [
        {"frame": 0, "rgb": list(MIDDLE)},
        {"frame": 8, "rgb": list(MIDDLE)},
        {"frame": 12, "rgb": list(MIDDLE), "there": 0},
        {"frame": 18, "rgb": list(MIDDLE), "there": 0},
    ]
    document, _ = solved(fields, pick("p1", MIDDLE, (0.6, 0.3, 0.4), path=path))
    np.testing.assert_allclose(moved(document, MIDDLE, 8), (0.2, -0.1, 0), atol=0.006)
    assert 0.04 < moved(document, MIDDLE, 10)[0] < 0.16
    for frame in (12, 15, 18):
        np.testing.assert_array_equal(moved(document, MIDDLE, frame), 0)


def test_the_frame_that_is_farthest_off_is_named(fields: Fields) -> None:
    path = [{"frame": f, "rgb": [0.3, 0.3, 0.3]} for f in (0, 18)]
    late = {"from": 10, "until": 18}
    _, measured = solved(
        fields,
        pick("p1", (0.3, 0.3, 0.3), (0.4, 0.3, 0.3), frame=2, path=path),
        pick("p2", (0.3, 0.305, 0.3), (0.2, 0.4, 0.3), frame=14, **late),
    )
    assert measured["p1"]["residual"] < 0.01
    assert measured["p1"]["worst"] > 0.05
    assert measured["p1"]["worst_frame"] >= 10


def test_many_picks_are_solved_once(fields: Fields, monkeypatch: pytest.MonkeyPatch) -> None:
    count = 0
    solver = solve.solve

    def counting(found: Fields) -> Any:
        nonlocal count
        count += 1
        return solver(found)

    monkeypatch.setattr(solve, "solve", counting)
    document = Document(fields)
    for level in np.linspace(0.2, 0.5, 20):
        document.pick(5, colour=[level] * 3, by=(0.02, 0, 0), follow=False)
    document.hold(5, colour=OTHER, follow=False)
    document.change_pick("p3", by=(0, 0.02, 0))
    assert count == 0
    assert all(pick.residual is not None for pick in document.picks)
    assert count == 1


def test_a_locked_handle_does_not_move(fields: Fields) -> None:
    asked = pick("p1", MIDDLE, (0.6, 0.3, 0.4))
    free, _ = solved(fields, asked)
    by = {entry["vertex"]: entry["by"] for entry in free.fields()["edits"]["solution"]["vertices"]}
    most = max(by, key=lambda id_: max(map(abs, by[id_])))
    locked, measured = solved(fields, asked, locks=[most])
    assert most not in {v["vertex"] for v in locked.fields()["edits"]["solution"]["vertices"]}
    assert measured["p1"]["residual"] < 0.006


def test_a_global_pick_has_no_bump(fields: Fields) -> None:
    document, measured = solved(fields, pick("p1", MIDDLE, (0.6, 0.3, 0.4), global_only=True))
    assert document.fields()["edits"]["solution"]["bumps"] == []
    assert measured["p1"]["residual"] > 0


def test_guarded_colours_stay(fields: Fields) -> None:
    asked = pick("p1", MIDDLE, (0.55, 0.4, 0.4))
    lamp = [0.75, 0.7, 0.2]
    rows = [[0.4, 0.4, 0.4, 0.6], [0.3, 0.3, 0.6, 0.3997], [*lamp, 0.0003]]
    document, _ = solved({**fields, "colours": [{"frame": 0, "rgbw": rows}]}, asked)
    assert np.abs(moved(document, (0.3, 0.3, 0.6), 5)).max() < 0.025
    assert np.abs(moved(document, lamp, 5)).max() < 0.15


def test_a_larger_change_of_a_rare_colour_does_not_tint_a_street_more(fields: Fields) -> None:
    rng = np.random.default_rng(0)
    street = rng.uniform(0.3, 0.6, (40, 1)) + rng.normal(0, 0.05, (40, 3))
    car, way = np.array([0.6, 0.25, 0.2]), np.array([-0.5, 0.1, 0.7])
    rows = [[*car, 0.05], *([*colour, 0.02] for colour in street.tolist())]
    tints = []
    for part in (0.45, 0.9):
        asked = pick("p1", car, car + part * way)
        document, measured = solved({**fields, "colours": [{"frame": 0, "rgbw": rows}]}, asked)
        assert measured["p1"]["residual"] < 0.005
        changed = document.recolour(street[None].astype(np.float32), 5)[0]
        tints.append(float(np.abs(changed - street).mean()))
    assert tints[1] < 1.2 * tints[0]


def test_two_targets_of_one_colour_are_named_and_stay_bounded(fields: Fields) -> None:
    document, measured = solved(
        fields,
        pick("p1", MIDDLE, (0.7, 0.3, 0.4)),
        pick("p2", (0.405, 0.4, 0.4), (0.2, 0.6, 0.4)),
    )
    picks = [
        Pick.from_fields(entry | measured[entry["id"]])
        for entry in document.fields()["edits"]["picks"]
    ]
    [line] = unmet(picks, 1).values()  # the pair is told once
    assert "p1" in line
    assert "p2" in line
    for bump in document.fields()["edits"]["solution"]["bumps"]:
        assert np.abs([key["by"] for key in bump["keys"]]).max() < 2


def test_two_picks_of_one_colour_are_named_with_their_frames(fields: Fields) -> None:
    asked = [
        pick("p1", MIDDLE, (0.7, 0.3, 0.4), frame=3),
        pick("p2", MIDDLE, (0.2, 0.6, 0.4), frame=7),
    ]
    _, measured = solved(fields, *asked)
    [line] = unmet([Pick.from_fields(one | measured[one["id"]]) for one in asked], 1).values()
    assert "the same colour" in line
    assert "picked at frame 3" in line
    assert "picked at frame 7" in line


def test_a_pick_that_is_near_at_another_frame_is_not_blamed() -> None:
    path = [{"frame": 2, "rgb": MIDDLE}, {"frame": 5, "rgb": (0.8, 0.3, 0.2)}]
    met = {"residual": 0.0, "worst": 0.0, "worst_frame": 5, "global": 0.5}
    asked = Pick.from_fields(pick("p1", (0.8, 0.3, 0.2), (0.9, 0.3, 0.2), path=path) | met)
    rival = Pick.from_fields(pick("p2", MIDDLE, (0.2, 0.6, 0.4)) | met)
    assert list(unmet([replace(asked, residual=0.1), rival], 1)) == [{"p1"}]
    assert list(unmet([replace(asked, worst=0.1), rival], 1)) == [{"p1"}]
    assert list(unmet([replace(asked, worst=0.1, worst_frame=2), rival], 1)) == [{"p1", "p2"}]


def test_the_solution_is_the_same_every_time(fields: Fields) -> None:
    asked = [pick("p1", MIDDLE, (0.6, 0.3, 0.4)), pick("p2", OTHER)]
    first, second = (solved(fields, *asked)[0].fields() for _ in range(2))
    assert first == second


def test_a_thousand_picks_are_bounded_in_time(fields: Fields) -> None:
    rng = np.random.default_rng(4)
    many = [
        pick(f"p{i}", rng.random(3).tolist(), rng.random(3).tolist(), frame=int(rng.integers(18)))
        for i in range(1, 1001)
    ]
    start = time.process_time()
    document, measured = solved(fields, *many)
    assert time.process_time() - start < 30
    assert measured["p100"]["residual"] > 0
    assert measured.keys() == {f"p{i}" for i in range(1, MOST_PICKS + 1)}
    lines = unmet(document.picks, 1).values()
    assert sum("not solved" in line for line in lines) == 1000 - MOST_PICKS
    with pytest.raises(Palette4dError, match=str(MOST_PICKS)):
        document.pick(5, colour=MIDDLE, by=(0.1, 0, 0), follow=False)


@pytest.mark.parametrize("name", ["v1_one_colour", "v1_two_colours", "v1_flat", "v1_scene_linear"])
def test_palettes_of_few_colours(name: str) -> None:
    document = Document(json.loads((GOLDEN / f"{name}.p4d.json").read_text()))
    rgb = document.palette(document.frames[0]).rgb.mean(axis=0)
    document.pick(document.frames[0], colour=rgb, by=(0.1, 0, 0), follow=False, any_value=True)
    [found] = document.picks
    assert found.residual is not None
    assert found.residual < 0.02


def test_a_long_path_is_solved_in_linear_time() -> None:
    """The keys of a path are those of a file, which may have many."""

    def seconds(keys: int) -> float:
        fields = json.loads((GOLDEN / "v1_picks.p4d.json").read_text())
        path = [{"frame": 12 * i / keys, "rgb": [0.4, 0.3, 0.25]} for i in range(keys)]
        fields["edits"]["picks"] = [{**fields["edits"]["picks"][0], "path": path}]
        document = Document(fields)
        start = time.process_time()
        document.set("v4", rgb=(1, 0, 0))
        document.fields()
        return time.process_time() - start

    few = min(seconds(100) for _ in range(3))
    assert seconds(800) < 24 * few  # 8 times if linear, 64 times if not
