"""Moves of handles, tracks and palettes, over all time and within a range; ramps."""

import itertools
import re
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palette4d.colour.encoding_conversion import between
from palette4d.colour.oklch import Adjustment, adjuster
from palette4d.common.errors import Palette4dError
from palette4d.grade import sidecar
from palette4d.grade.document import Document
from palette4d.grade.edits import RAMP
from palette4d.grade.handles import Handles
from palette4d.grade.tracks import tracks_of, way_of

GOLDEN = Path(__file__).parents[1] / "golden" / "sidecars"
NAMES = ("split", "merge", "edited", "scene_linear")


def document(name: str) -> Document:
    return Document.load(next(GOLDEN.glob(f"v1_{name}.p4d.json")))


def difference(before: Document, after: Document, frame: float) -> dict[str, Any]:
    """The displacement of each palette colour."""
    one, two = before.grade.palette(frame), after.grade.palette(frame)
    return dict(zip(one.ids, two.edited - one.edited, strict=True))


def luma(colour: Any) -> float:
    return float(np.dot([0.2126, 0.7152, 0.0722], colour))


# ------------------------------------------------------------------------------ hue and the like


def test_hue_chroma_and_lightness_are_those_of_oklch() -> None:
    from coloraide import Color

    before = (0.8, 0.3, 0.2)
    light, chroma, hue = Color("srgb", before).convert("oklch").coords()
    after = adjuster("sRGB", Adjustment(hue=40, chroma=0.5, lightness=0.9))(before)
    found = Color("srgb", after).convert("oklch").coords()
    assert found == pytest.approx([light * 0.9, chroma * 0.5, hue + 40], abs=1e-9)


@pytest.mark.parametrize("encoding", ["sRGB", "ACEScct", "lin_rec709", "unknown"])
def test_grey_and_black_have_no_hue(encoding: str) -> None:
    turn = adjuster(encoding, Adjustment(hue=77, chroma=3))
    for grey in (0.0, 0.2, 0.9):
        assert turn((grey, grey, grey)) == pytest.approx([grey] * 3, abs=1e-5)


@pytest.mark.parametrize("encoding", ["sRGB", "ACEScct", "ACEScg", "g24_rec709", "strange"])
def test_opposite_changes_cancel_out(encoding: str) -> None:
    there = adjuster(encoding, Adjustment(50, 0.5, 2))
    back = adjuster(encoding, Adjustment(-50, 2, 0.5))
    for colour in ((0.5, 0.4, 0.1), (0.3, 0.5, 0.6)):
        assert back(there(colour)) == pytest.approx(colour, abs=2e-5)


def test_the_encoding_counts() -> None:
    """Twice the lightness and chroma is eight times the light."""
    graded, light = document("scene_linear"), between("ACEScct", "ACEScg")
    assert light is not None
    before = light(graded.grade.colour("v9"))
    graded.adjust("v9", chroma=2, lightness=2)
    assert light(graded.grade.colour("v9")) == pytest.approx(8 * before, rel=1e-3)
    double = Adjustment(chroma=2, lightness=2)
    linear = adjuster("lin_rec709", double)((0.01, 0.02, 0.03))
    assert linear == pytest.approx([0.08, 0.16, 0.24], rel=1e-4)
    assert adjuster("sRGB", double)((0.01, 0.02, 0.03)) != pytest.approx(linear)


@pytest.mark.parametrize(
    "change", [Adjustment(hue=float("nan")), Adjustment(chroma=-1), Adjustment(lightness=1e400)]
)
def test_wrong_numbers_are_refused(change: Adjustment) -> None:
    with pytest.raises(Palette4dError):
        adjuster("sRGB", change)


# ------------------------------------------------------------------------------- whole time ranges


def test_a_track_follows_splits() -> None:
    one, two = document("split"), document("split")
    changed = two.adjust("v4", track=True, by=(0.1, 0, 0))
    assert set(changed) == {"v4", "v8", "v12", "v13", "v17", "v18"}
    for frame in (0, 4.5, 9, 9.5, 10, 20):
        moved = [delta.tolist() for delta in difference(one, two, frame).values() if delta.any()]
        assert moved == [pytest.approx([0.1, 0, 0])] * (1 if frame < 9.5 else 2)


def test_a_track_follows_merges_backwards() -> None:
    merge = document("merge")
    ends = {edge["to"] for edge in merge.fields()["polytope"]["edges"]}
    joined = [v for v in ends if sum(e["to"] == v for e in merge.fields()["polytope"]["edges"]) > 1]
    assert joined
    changed = merge.adjust(joined[0], track=True, by=(0.1, 0, 0))
    before = [e["from"] for e in merge.fields()["polytope"]["edges"] if e["to"] == joined[0]]
    assert len(before) > 1
    assert set(before) < set(changed)


def test_a_track_gets_a_colour() -> None:
    doc = document("split")
    old = {id_: doc.grade.colour(id_) for id_ in ("v4", "v8", "v12")}
    doc.adjust("v8", track=True, rgb="#3366cc")
    new = doc.grade.colour("v8")
    assert new == (0.2, 0.4, 0.8)
    for id_, before in old.items():
        shift = np.subtract(doc.grade.colour(id_), before)
        share = min(1, luma(before) / luma(old["v8"]))
        assert shift == pytest.approx(share * np.subtract(new, old["v8"]), abs=1e-12)
    black = document("split")
    black.set("v8", rgb="#000000")
    black.adjust("v8", track=True, rgb=new)  # all others are lighter
    assert black.grade.colour("v12") == pytest.approx(np.add(old["v12"], new))
    edge = document("split")
    edge.adjust("e4", track=True, frame=4.5, rgb=(0.5, 0.5, 0.5))
    assert edge.grade.colour("e4", frame=4.5) == pytest.approx((0.5, 0.5, 0.5))


def test_what_is_beside_a_locked_handle_moves() -> None:
    doc = document("split")
    stop = doc.stop("e4", frame=4.5, rgb=(0.5, 0.4, 0.3))
    locked = doc.grade.colour("v4")
    doc.lock("v4")
    assert set(doc.adjust("v8", track=True, by=(0.1, 0, 0))) >= {"v8", "v12", stop}
    doc.adjust(by=(0.1, 0, 0))
    doc.adjust("e4", track=True, frame=2, rgb=(0.6, 0.6, 0.6))  # gets a stop there
    assert doc.grade.colour("v4") == locked
    assert doc.grade.colour("e4", frame=2) == pytest.approx((0.6, 0.6, 0.6))
    doc.adjust("v4", track=True, by=(0.1, 0, 0))  # named, it moves
    assert doc.grade.colour("v4") == pytest.approx(np.add(locked, (0.1, 0, 0)))


@pytest.mark.parametrize("name", NAMES)
def test_the_palette_moves_as_a_whole(name: str) -> None:
    one, two = document(name), document(name)
    two.adjust(by=(0.1, -0.05, 0))
    for frame in np.linspace(*one.grade.frames[:2], 9).tolist():
        for delta in difference(one, two, frame).values():
            assert delta == pytest.approx([0.1, -0.05, 0], abs=1e-9)
    assert len(two.history.done) == 1
    two.undo()
    assert two.grade.settings == one.grade.settings


def test_one_handle_and_an_edge() -> None:
    doc = document("edited")
    doc.adjust("v1", by=(0.1, 0, 0))
    assert doc.grade.colour("v1") == pytest.approx((0.2, 0.1, 0.1))
    doc.adjust("s1", chroma=0)
    assert np.ptp(doc.grade.colour("s1")) < 1e-6
    (stop,) = doc.adjust("e1", frame=4.5, rgb=(0.3, 0.4, 0.5), ramp="hold")
    assert (doc.grade.colour(stop), doc.grade.settings[stop].ramp) == ((0.3, 0.4, 0.5), "hold")
    assert doc.adjust("e1", frame=4.5, rgb=(0.1, 0.4, 0.5)) == (stop,)


@pytest.mark.parametrize(
    ("id_", "how"),
    [
        ("v1", {}),
        ("v1", {"rgb": (1, 1, 1), "by": (1, 1, 1)}),
        ("v1", {"rgb": (1, 1, 1), "hue": 3}),
        (None, {"rgb": (1, 1, 1)}),
        ("e1", {"rgb": (1, 1, 1), "track": True}),
        ("e1", {"by": (1, 1, 1)}),
        ("e1", {"frame": 99, "by": (1, 1, 1)}),
        ("v1", {"frame": 1, "by": (1, 1, 1)}),
        ("v99", {"by": (1, 1, 1)}),
        ("v99", {"by": (1, 1, 1), "track": True}),
        ("v99", {"by": (1, 1, 1), "start": 3}),
        ("v1", {"by": (1, 1, 1), "fade": 3}),
        ("v1", {"by": (1, 1, 1), "start": 5, "until": 3}),
        ("v1", {"by": (1, 1, 1), "start": 50}),
        ("v1", {"by": (1, 1, 1), "until": -5}),
        ("v1", {"by": (1, 1, 1), "start": 3, "fade": -1}),
        ("v1", {"by": (1, 1, 1), "start": float("nan")}),
        ("v1", {"by": (1, 1, 1), "start": 3, "fade": float("nan")}),
        ("v1", {"rgb": (1, 1, 1), "start": 5, "until": 8}),
        ("v1", {"by": (1, 1, 1), "ramp": "round"}),
        ("v1", {"chroma": -1}),
        ("v1", {"rgb": (255, 128, 0)}),
        ("v1", {"by": (10, -20, 30)}),
    ],
)
def test_refusals_change_nothing(id_: str | None, how: dict[str, Any]) -> None:
    doc = document("edited")
    before = doc.fields()
    with pytest.raises(Palette4dError):
        doc.adjust(id_, **how)
    assert doc.fields() == before


# ------------------------------------------------------------------------------------------ ranges


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_nothing_changes_outside_of_a_range(data: st.DataObject) -> None:
    one = document(data.draw(st.sampled_from(("split", "merge"))))
    first, last, _ = one.grade.frames
    two = Document(one.fields())
    start = data.draw(st.integers(first, last))
    until = data.draw(st.integers(start, last))
    fade, fade_out = data.draw(st.integers(0, 6)), data.draw(st.none() | st.integers(0, 6))
    handles = sorted(v["id"] for v in one.fields()["polytope"]["vertices"])
    id_ = data.draw(st.sampled_from([None, *handles]))
    ramp = data.draw(st.sampled_from([None, "smooth", "hold", "linear"]))
    two.set_ramp(data.draw(st.sampled_from(["smooth", "hold", "linear"])))
    two.adjust(id_, track=id_ is not None, by=(0.1, 0, 0), start=start, until=until, fade=fade,
               fade_out=fade_out, ramp=ramp)  # fmt: skip
    fade_out = max(fade if fade_out is None else fade_out, 1)
    fade = max(fade, 1)
    for frame in range(first, last + 1):
        deltas = difference(one, two, frame).values()
        if frame <= start - fade or frame >= until + fade_out:
            assert not any(delta.any() for delta in deltas), frame
        elif start <= frame <= until and id_ is None:
            assert all(delta == pytest.approx([0.1, 0, 0], abs=1e-9) for delta in deltas)
        else:
            assert all(-1e-9 <= delta[0] <= 0.1 + 1e-9 for delta in deltas)
    pixels = np.random.default_rng(3).random((4, 4, 3), dtype=np.float32)
    for frame in range(first, last + 1):
        if frame <= start - fade or frame >= until + fade_out:
            assert two.recolour(pixels, frame).tobytes() == pixels.tobytes()


def test_a_colour_that_merges_during_a_gap_stays_outside_of_a_range() -> None:
    """The other colour's way to the common one takes four frames, of which three do not change."""
    fields = document("merge").fields()
    polytope = fields["polytope"]
    polytope["blocks"][1]["first"] = 13
    for vertex in polytope["vertices"]:
        vertex["frame"] = 13 if vertex["frame"] == 10 else vertex["frame"]
    one, two = Document(fields), Document(fields)
    two.adjust("v4", track=True, by=(0.1, 0, 0), start=13, until=20)
    for frame in (10, 11, 12):
        assert not any(delta.any() for delta in difference(one, two, frame).values())
    assert difference(one, two, 13)["v14"] == pytest.approx([0.1, 0, 0])


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_earlier_edits_stay_outside_of_a_range(data: st.DataObject) -> None:
    one = document("edited")
    one.set_ramp(data.draw(st.sampled_from(["linear", "hold"])))
    one.set_ramp("hold", "s1")
    two = Document(one.fields())
    start = data.draw(st.integers(0, 20))
    until = data.draw(st.integers(start, 20))
    two.adjust(by=(0.1, 0, -0.1), start=start, until=until, fade=2)
    for frame in range(21):
        for delta in difference(one, two, frame).values():
            if start <= frame <= until:
                assert delta == pytest.approx([0.1, 0, -0.1], abs=1e-9)
            elif frame <= start - 2 or frame >= until + 2:
                assert delta == pytest.approx([0, 0, 0], abs=1e-9)


def test_a_range_fades_linearly_or_smoothly() -> None:
    linear, smooth = [0, 0.25, 0.5, 0.75, 1], [0, 5 / 32, 0.5, 27 / 32, 1]
    for clip_ramp, ramp, expected in (
        ("linear", None, linear),
        ("linear", "smooth", smooth),
        ("smooth", None, smooth),
        ("hold", None, linear),  # a step would be no fade
    ):
        for (start, until), times in (((5, 7), (1, 2, 3, 4, 5)), ((2, 4), (8, 7, 6, 5, 4))):
            one, two = document("split"), document("split")
            two.set_ramp(clip_ramp)
            offset = {"by": [0.5, 0, 0], "start": start, "until": until, "fade": 4, "ramp": ramp}
            two.adjust("e1", track=True, **offset)
            found = [
                (two.grade.colour("e1", frame=t)[0] - one.grade.colour("e1", frame=t)[0]) / 0.5
                for t in times
            ]
            assert found == pytest.approx(expected, abs=1e-9)


def test_near_within_a_range() -> None:
    one, two = document("split"), document("split")
    seen = one.grade.palette(4).rgb[1]
    near = two.set_near(seen, frame=4, rgb=(0.5, 0.5, 0.5), start=3, until=6, fade=2)
    assert near.handle is None
    assert two.grade.palette(4).edited[1] == pytest.approx((0.5, 0.5, 0.5))
    (step,) = two.history.done
    assert re.search(r"3 .*6", step.label)  # the step names its range
    for frame in (0, 1, 8, 9, 12):
        assert not any(delta.any() for delta in difference(one, two, frame).values())
    assert two.set_near(seen, frame=0, by=(0.1, 0, 0)).handle == "v2"


# ------------------------------------------------------------------------------------------- ramps


def test_ramps_between_handles() -> None:
    doc = document("split")
    a = doc.stop("e1", frame=2, rgb=(0.5, 0.1, 0.1))
    doc.stop("e1", frame=4, rgb=(1, 0.1, 0.1))
    base = document("split")

    def red(frame: float) -> float:
        return doc.grade.colour("e1", frame=frame)[0] - base.grade.colour("e1", frame=frame)[0]

    low, high = red(2), red(4)
    assert red(3) == pytest.approx((low + high) / 2)
    doc.set_ramp("hold", a)
    assert (red(3), red(3.99), red(4)) == pytest.approx((low, low, high))
    doc.set_ramp("smooth", a)
    assert low < red(2.5) < red(3) < red(3.5) < high
    doc.undo()
    doc.undo()
    doc.set_ramp("hold")
    assert doc.grade.state[RAMP] == "hold"
    assert red(3) == pytest.approx(low)
    doc.set_ramp("linear", a)
    assert red(3) == pytest.approx((low + high) / 2)
    assert red(1.9) == 0
    with pytest.raises(Palette4dError):
        doc.set_ramp("round")
    with pytest.raises(Palette4dError):
        doc.set_ramp("hold", "e1")


def test_ramps_are_saved(tmp_path: Path) -> None:
    doc = document("split")
    doc.set_ramp("smooth")
    doc.set_ramp("hold", "v1")
    doc.set("v1", rgb=(0.5, 0.5, 0.5))
    doc.save(tmp_path / "clip.p4d.json")
    edits = sidecar.load(tmp_path / "clip.p4d.json")["edits"]
    assert edits == {
        "ramp": "smooth",
        "vertices": [{"vertex": "v1", "rgb": [0.5, 0.5, 0.5], "ramp": "hold"}],
        "stops": [],
    }
    found = Document.load(tmp_path / "clip.p4d.json")
    assert (found.grade.ramp, found.grade.settings) == ("smooth", doc.grade.settings)


def test_every_vertex_and_edge_is_on_one_track() -> None:
    for name in NAMES:
        doc = document(name)
        polytope = doc.fields()["polytope"]
        vertices = [id_ for track in doc.grade.tracks for id_ in track.vertices]
        edges = [id_ for track in doc.grade.tracks for id_ in track.edges]
        assert sorted(vertices) == sorted(v["id"] for v in polytope["vertices"])
        assert sorted(edges) == sorted(e["id"] for e in polytope["edges"])
        names = [track.name for track in doc.grade.tracks]
        assert len(set(names)) == len(names)


def test_the_time_of_a_long_track_grows_with_its_vertices() -> None:
    count = 10_000
    ids = [f"v{i}" for i in range(count)]
    vertices = [{"id": id_, "frame": i, "rgb": [0.1, 0.2, 0.3]} for i, id_ in enumerate(ids)]
    edges = [
        {"id": f"e{i}", "from": a, "to": b} for i, (a, b) in enumerate(itertools.pairwise(ids))
    ]
    handles = Handles({"vertices": vertices, "edges": edges})
    start = time.process_time()
    [track] = tracks_of(handles, dict.fromkeys(ids, "blue"))
    assert track.vertices == tuple(ids)
    assert len(way_of(handles, "v7")[1]) == count - 1
    assert time.process_time() - start < 4
