"""The document: edits by id and by what is seen, undo, two writers at once, recolouring."""

import json
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from palette4d import _core
from palette4d.common import locking
from palette4d.common.errors import Palette4dError, SidecarError
from palette4d.grade import sidecar
from palette4d.grade.document import Document

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"
FILES = sorted(GOLDEN.glob("v*_*.p4d.json"))
WHITE = (1.0, 1.0, 1.0)


def copy_of(name: str, folder: Path) -> Path:
    path = folder / "clip.p4d.json"
    path.write_bytes((GOLDEN / f"v1_{name}.p4d.json").read_bytes())
    return path


@pytest.fixture
def plain(tmp_path: Path) -> Path:
    """e1 runs from v1 (frame 0) to v5 (frame 9); v8 splits into v12 and v13."""
    return copy_of("split", tmp_path)


@pytest.fixture
def edited(tmp_path: Path) -> Path:
    """v4 and v17 edited; stops s1 (4.5) and s3 (7) on e3, s2 (9.25) on e13."""
    return copy_of("edited", tmp_path)


def edits_of(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = sidecar.load(path)["edits"]
    return found


def image(*shape: int, seed: int = 0) -> Any:
    return np.random.default_rng(seed).random(shape, dtype=np.float32)


# ---------------------------------------------------------------------------------------- palettes


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_the_palette_is_the_cores(path: Path) -> None:
    document = Document.load(path)
    core = _core.read_sidecar(path)
    first, last, _ = document.grade.frames
    for frame in np.linspace(first, last, 7).tolist():
        cut = _core.slice_at(core.polytope, frame)
        palette = document.grade.palette(frame)
        assert palette.rgb.tolist() == cut.rgb.tolist()
        assert palette.edited.tolist() == (
            _core.edited_colours(core.polytope, core.edits, cut).tolist()
        )
        assert palette.faces.tolist() == cut.faces.tolist()
        assert len(palette.ids) == len(palette.rgb)


def test_ids_name_what_to_edit(edited: Path) -> None:
    document = Document.load(edited)
    assert document.grade.palette(0).ids == ("v1", "v2", "v3", "v4")
    assert document.grade.palette(3).ids == ("e1", "e2", "e3", "e4")
    for frame in (0, 3):
        ids = document.grade.palette(frame).ids
        for i, id_ in enumerate(ids):
            if id_.startswith("v"):
                document.set(id_, rgb=(i / 8, 0, 0))
            else:
                document.stop(id_, frame=frame, rgb=(i / 8, 0, 0))
        assert document.grade.palette(frame).edited.tolist() == [
            [i / 8, 0, 0] for i in range(len(ids))
        ]


@pytest.mark.parametrize(
    "path", [path for path in FILES if "picks" not in path.name], ids=lambda path: path.name
)
def test_edited_colours_are_linear_between_handles(path: Path) -> None:
    document = Document.load(path)
    fields = document.fields()
    frame_of = {vertex["id"]: vertex["frame"] for vertex in fields["polytope"]["vertices"]}
    for edge in fields["polytope"]["edges"]:
        handles = [(frame_of[edge[end]], edge[end]) for end in ("from", "to")]
        handles += [
            (s.frame, id_) for id_, s in document.grade.settings.items() if s.edge == edge["id"]
        ]
        frames, colours = zip(
            *((frame, document.grade.colour(id_)) for frame, id_ in sorted(handles)), strict=True
        )
        for frame in np.linspace(frames[0], frames[-1], 7)[1:-1].tolist():
            expected = [np.interp(frame, frames, channel) for channel in zip(*colours, strict=True)]
            found = document.grade.colour(edge["id"], frame=frame)
            assert found == pytest.approx(expected, abs=1e-12), (edge["id"], frame)


# ------------------------------------------------------------------------------------------- edits


def test_what_is_edited_is_seen_at_once(plain: Path) -> None:
    document = Document.load(plain)
    document.grade.palette(0)
    document.set("v1", rgb=WHITE)
    assert document.grade.palette(0).edited[0].tolist() == [1, 1, 1]
    document.undo()
    assert document.grade.palette(0).edited.tolist() == document.grade.palette(0).rgb.tolist()


@pytest.mark.parametrize(
    "act",
    [
        lambda d: d.set("v99", rgb=WHITE),
        lambda d: d.set("e1", rgb=WHITE),
        lambda d: d.set("v1", rgb=(1, 1)),
        lambda d: d.set("v1", rgb=(1, 1, float("nan"))),
        lambda d: d.stop("e99", frame=3, rgb=WHITE),
        lambda d: d.stop("v1", frame=3, rgb=WHITE),
        lambda d: d.stop("e1", frame=9, rgb=WHITE),
        lambda d: d.stop("e1", frame=21, rgb=WHITE),
        lambda d: d.stop("e1", frame=float("nan"), rgb=WHITE),
        lambda d: d.move("v1", frame=3),
        lambda d: d.move("s1", frame=7),
        lambda d: d.move("s9", frame=3),
        lambda d: d.adjust("v4", by=(1e6, 0, 0)),
        lambda d: d.reset("v99"),
        lambda d: d.reset("e1"),
        lambda d: d.grade.near((0, 0, 0), frame=21),
        lambda d: d.set_near((1, 1, 1), frame=3, rgb=WHITE),
        lambda d: d.set_near((1, 1, 1), frame=3, id="e99", rgb=WHITE),
        lambda d: d.grade.palette(float("inf")),
        lambda d: d.save("missing/folder/clip.p4d.json"),
    ],
)
def test_refusals_change_nothing(edited: Path, act: Any) -> None:
    document = Document.load(edited)
    before = document.fields()
    with pytest.raises(Palette4dError):
        act(document)
    assert document.fields() == before
    assert document.history.done == ()


# -------------------------------------------------------------------------------- what is seen


def test_a_stop_takes_its_lock_along(edited: Path) -> None:
    document = Document.load(edited)
    document.lock("s1", "v4")
    document.reset("s1")
    assert document.grade.locks == ("v4",)
    document.reset("v4")  # its colour; it still does not move
    assert document.grade.locks == ("v4",)


def test_the_edited_palette_is_matched(plain: Path) -> None:
    document = Document.load(plain)
    document.set("v2", rgb=(0.1, 0.9, 0.9))  # was red
    near = document.grade.near((0.1, 0.85, 0.9), frame=0)
    assert (near.id, near.handle) == ("v2", "v2")
    assert near.rgb == (0.1, 0.9, 0.9)
    assert near.distance == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("frame", "handle"),
    [(9, "v8"), (9.5, "v8"), (8.6, "v8"), (0.5, "v4"), (4, None), (8.1, "v8"), (8, None)],
)
def test_a_vertex_less_than_a_frame_away_is_the_handle(
    plain: Path, frame: float, handle: str | None
) -> None:
    near = Document.load(plain).grade.near((0.1, 0.1, 0.95), frame=frame)
    assert near.handle == handle


def test_a_frame_step_is_that_of_the_clip(tmp_path: Path) -> None:
    document = Document.load(copy_of("step_two", tmp_path))
    first, _, step = document.grade.frames
    assert step == 2
    wanted = document.grade.palette(first).rgb[0]
    assert (
        document.grade.near(wanted, frame=first + 1.9).handle
        == document.grade.palette(first).ids[0]
    )
    assert document.grade.near(wanted, frame=first + 2).handle is None


@pytest.mark.parametrize("frame", [0, 3, 4.5, 9, 9.25, 14.6, 15])
@pytest.mark.parametrize("name", ["split", "edited"])
@pytest.mark.parametrize("ramp", ["linear", "smooth", "step"])
def test_the_new_colour_is_hit_exactly(tmp_path: Path, name: str, frame: float, ramp: str) -> None:
    document = Document.load(copy_of(name, tmp_path))
    document.set_ramp(ramp)
    for i in range(len(document.grade.palette(frame).ids)):
        seen = document.grade.palette(frame).edited[i]
        found = document.set_near(seen, frame=frame, rgb=(-2.0 - i, 0.25, 0.5))
        assert found.distance == 0
        now = document.grade.palette(frame).edited
        assert np.abs(now - [-2.0 - i, 0.25, 0.5]).max(axis=1).min() < 1e-12
        assert found.handle in document.grade.settings


def test_a_stop_beside_the_frame_does_not_spoil_the_hit(plain: Path) -> None:
    document = Document.load(plain)
    seen = document.grade.palette(0.25).edited[document.grade.palette(0.25).ids.index("e1")]
    document.stop("e1", frame=0.3, rgb=seen)
    near = document.set_near(seen, frame=0.25, rgb=(0.1, 0.9, 0.4), anyway=True)
    assert near.handle == "s2"  # the vertex would go six times as far
    found = np.abs(document.grade.palette(0.25).edited - [0.1, 0.9, 0.4]).max(axis=1)
    assert found.min() < 1e-12


def test_a_colour_far_from_all_others_is_refused_with_what_it_is_made_of(plain: Path) -> None:
    document = Document.load(plain)
    middle = document.grade.palette(3).rgb[:2].mean(axis=0)
    with pytest.raises(Palette4dError) as caught:
        document.set_near(middle, frame=3, rgb=WHITE)
    assert "50% e1" in str(caught.value)
    assert "50% e2" in str(caught.value)
    shares = document.grade.near(middle, frame=3).shares
    assert dict(shares) == pytest.approx({"e1": 0.5, "e2": 0.5, "e3": 0, "e4": 0}, abs=1e-9)
    assert [share for _, share in shares] == sorted(dict(shares).values(), reverse=True)
    assert document.set_near(middle, frame=3, rgb=WHITE, anyway=True).handle == "s1"


@pytest.mark.parametrize(
    ("rgb", "refused"),
    [
        ((255, 128, 0), True),
        ((0, 0, 2), True),
        ((1023, 512, 4), True),
        ((127.5, 64, 0), True),
        ((1, 1, 0), False),
        ((1.5, 1, 0), False),
        ((-1, 0, 0), False),
    ],
)
def test_integers_are_no_code_values(plain: Path, rgb: Any, refused: bool) -> None:
    document = Document.load(plain)
    fields = document.fields()
    fields["clip"]["encoding"] = "lin_rec709"
    Document(fields).grade.checked(rgb)
    if refused:
        with pytest.raises(Palette4dError):
            document.grade.checked(rgb)
    else:
        document.grade.checked(rgb)


@pytest.mark.parametrize(
    ("name", "linear"),
    [
        ("Linear", True),
        ("lin_ap1_scene", True),
        ("Utility - Linear - sRGB", True),
        ("ACEScg", True),
        ("ACES - ACES2065-1", True),
        ("ACEScct", False),
        ("sRGB", False),
        ("Gamma 2.4 Rec.709 - Texture", False),
        ("unknown", False),
    ],
)
def test_linear_encodings_are_known_by_name(plain: Path, name: str, linear: bool) -> None:
    fields = Document.load(plain).fields()
    fields["clip"]["encoding"] = name
    assert Document(fields).grade.scene_linear == linear


# ------------------------------------------------------------------------------------------ saving


def test_saving_changes_the_edits_only(plain: Path) -> None:
    before = sidecar.load(plain)
    document = Document.load(plain)
    document.set("v9", rgb=WHITE)
    document.set("v2", rgb=WHITE)
    assert document.changed
    document.save()
    assert not document.changed
    after = sidecar.load(plain)
    assert [entry["vertex"] for entry in after["edits"]["vertices"]] == ["v2", "v9"]
    assert {**after, "edits": None, "history": None} == {**before, "edits": None, "history": None}
    document.reset()
    document.forget_history()
    document.save()
    assert sidecar.load(plain) == before


def test_another_writers_edits_are_kept(edited: Path) -> None:
    mine, theirs = Document.load(edited), Document.load(edited)
    theirs.set("v1", rgb=(0, 0, 0))
    theirs.reset("s1")
    theirs.stop("e1", frame=3, rgb=(0, 0, 0))  # s4 is new in both
    theirs.save()
    mine.set("v2", rgb=WHITE)
    mine.stop("e2", frame=3, rgb=WHITE)
    mine.save()
    found = edits_of(edited)
    assert [entry["vertex"] for entry in found["vertices"]] == ["v1", "v2", "v4", "v17"]
    assert {(s["id"], s["edge"], s["frame"]) for s in found["stops"]} == {
        ("s2", "e13", 9.25), ("s3", "e3", 7), ("s4", "e1", 3), ("s5", "e2", 3)
    }  # fmt: skip
    assert mine.fields()["edits"] == found
    assert mine.grade.palette(3).edited[1].tolist() == [1, 1, 1]
    mine.undo()  # of the stop that has another id now
    mine.save()
    assert {stop["id"] for stop in edits_of(edited)["stops"]} == {"s2", "s3", "s4"}


def test_a_conflict_is_refused_and_both_keep_what_they_have(edited: Path) -> None:
    mine, theirs = Document.load(edited), Document.load(edited)
    theirs.set("v1", rgb=(0, 0, 0))
    theirs.save()
    mine.set("v1", rgb=WHITE)
    before = edited.read_bytes()
    with pytest.raises(Palette4dError, match="v1"):
        mine.save()
    assert edited.read_bytes() == before
    assert mine.grade.colour("v1") == WHITE
    mine.save(edited.with_name("mine.p4d.json"))
    assert Document.load(edited.with_name("mine.p4d.json")).grade.colour("v1") == WHITE


def test_two_writers_share_one_history(edited: Path) -> None:
    before = edits_of(edited)
    mine = Document.load(edited)
    mine.set("v1", rgb=WHITE)
    mine.save()
    theirs = Document.load(edited)
    theirs.set("v1", rgb=(0, 0, 0))
    theirs.save()
    mine.set("v2", rgb=WHITE)
    mine.save()
    assert mine.grade.colour("v1") == (0, 0, 0)
    assert len(mine.history.done) == 3
    mine.undo()
    mine.undo()
    assert mine.grade.colour("v1") == WHITE
    mine.undo()
    mine.save()
    assert edits_of(edited) == {**before, "stops": sorted(before["stops"], key=str)}


def test_another_palette_is_not_overwritten(plain: Path) -> None:
    document = Document.load(plain)
    document.set("v1", rgb=WHITE)
    sidecar.save(sidecar.load(GOLDEN / "v1_merge.p4d.json"), plain)
    before = plain.read_bytes()
    with pytest.raises(Palette4dError):
        document.save()
    assert plain.read_bytes() == before


def test_a_file_that_went_away_is_not_made_again_unasked(plain: Path) -> None:
    document = Document.load(plain)
    document.set("v1", rgb=WHITE)
    plain.unlink()
    with pytest.raises(SidecarError):
        document.save()
    assert not plain.exists()


def test_a_writer_without_locks_is_noticed(edited: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another program replaces the file between our look at it and our rename."""
    document = Document.load(edited)
    document.set("v1", rgb=WHITE)
    other = (GOLDEN / "v1_split.p4d.json").read_bytes()
    real = os.fsync

    def meanwhile(handle: int) -> None:
        real(handle)
        edited.write_bytes(other)

    monkeypatch.setattr(os, "fsync", meanwhile)
    with pytest.raises(Palette4dError):
        document.save()
    assert edited.read_bytes() == other
    assert [entry.name for entry in edited.parent.iterdir()] == [edited.name]


def test_editors_at_the_same_time_lose_nothing(edited: Path) -> None:
    """Eight threads and a second process add a stop each."""
    code = (
        "import sys\n"
        "from palette4d.grade.document import Document\n"
        "document = Document.load(sys.argv[1])\n"
        "document.stop('e1', frame=8.5, rgb=(0, 0, 0))\n"
        "document.save()\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code, str(edited)])
    problems: list[BaseException] = []

    def work(i: int) -> None:
        try:
            document = Document.load(edited)
            document.stop("e1", frame=0.5 + i / 2, rgb=(0, 0, 0))
            document.save()
        except BaseException as error:
            problems.append(error)

    threads = [threading.Thread(target=work, args=(i,)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert process.wait(60) == 0
    assert problems == []
    found = {stop["frame"] for stop in edits_of(edited)["stops"]}
    assert found == {4.5, 7, 9.25, 8.5, *(0.5 + i / 2 for i in range(8))}


def test_a_lock_that_stays_is_reported(edited: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(locking, "LOCK_SECONDS", 0.2)
    document = Document.load(edited)
    document.set("v1", rgb=WHITE)
    with locking.locked(edited), pytest.raises(Palette4dError):
        document.save()
    document.save()


def test_a_new_document_is_saved_beside_its_clip(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "grades").mkdir()
    fields = sidecar.load(GOLDEN / "v1_split.p4d.json")
    fields["clip"]["source"] = "plates/shot.####.exr"
    document = Document(fields)
    with pytest.raises(Palette4dError, match="no file yet"):
        document.save()
    document.save("grades/clip.p4d.json")
    saved = sidecar.load("grades/clip.p4d.json")
    assert saved["clip"]["source"] == "../plates/shot.####.exr"
    document.set("v1", rgb=WHITE)
    document.save()
    assert len(edits_of(Path("grades/clip.p4d.json"))["vertices"]) == 1


def test_a_document_that_is_saved_elsewhere_keeps_its_clip(tmp_path: Path) -> None:
    (tmp_path / "shots").mkdir()
    (tmp_path / "a" / "b").mkdir(parents=True)
    fields = sidecar.load(GOLDEN / "v1_split.p4d.json")
    whole = (tmp_path / "plates" / "shot.mov").as_posix()
    for source, expected in (
        ("shot.####.exr", "../../shots/shot.####.exr"),
        ("../lost/shot.####.exr", "../lost/shot.####.exr"),  # was nowhere
        (whole, whole),
    ):
        fields["clip"]["source"] = source
        sidecar.save(fields, tmp_path / "shots/s.p4d.json", on_edits="drop")
        Document.load(tmp_path / "shots/s.p4d.json").save(tmp_path / "a/b/s.p4d.json")
        assert sidecar.load(tmp_path / "a/b/s.p4d.json")["clip"]["source"] == expected
        (tmp_path / "a/b/s.p4d.json").unlink()


def test_edits_of_another_file_are_not_lost_unasked(plain: Path, tmp_path: Path) -> None:
    target = tmp_path / "target.p4d.json"
    target.write_bytes((GOLDEN / "v1_edited.p4d.json").read_bytes())
    document = Document.load(plain)
    with pytest.raises(Palette4dError):
        document.save(target)
    document.save(target, on_edits="keep")
    assert Document.load(target).grade.settings == document.grade.settings
    assert len(document.grade.settings) == 5
    assert document.path == target


def test_an_unusable_document_is_refused(plain: Path) -> None:
    fields = json.loads(plain.read_text(encoding="utf-8"))
    fields["polytope"]["edges"].pop()
    with pytest.raises(SidecarError):
        Document(fields)


# ---------------------------------------------------------------------------------------- applying


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("premultiplied", [False, True])
def test_a_recolouring_has_the_cores_bits(edited: Path, channels: int, premultiplied: bool) -> None:
    pixels = image(40, 50, channels)
    core = _core.read_sidecar(edited)
    cut = _core.slice_at(core.polytope, 4.5)
    colours = _core.edited_colours(core.polytope, core.edits, cut)
    expected = _core.Recolourer(cut.rgb, colours, cut.faces).apply(
        pixels, precision="single", premultiplied=premultiplied and channels == 4
    )
    document = Document.load(edited)
    found = document.recolour(pixels, 4.5, premultiplied=premultiplied)
    assert found.tobytes() == expected.tobytes()
    assert document.recolour(pixels[::-1, ::2], 4.5, premultiplied=premultiplied).tobytes() == (
        np.ascontiguousarray(expected[::-1, ::2]).tobytes()
    )
    assert document.recolour(pixels, 4.5, strength=0).tobytes() == pixels.tobytes()


def test_without_edits_every_bit_stays(plain: Path) -> None:
    pixels = image(20, 20, 4) * 3 - 1
    pixels[0, 0] = np.nan
    assert Document.load(plain).recolour(pixels, 3).tobytes() == pixels.tobytes()


def test_a_clip_in_another_space_is_converted() -> None:
    document = Document.load(next(GOLDEN.glob("v*_scene_linear.p4d.json")))
    conversion = document.grade.core.conversion
    assert conversion is not None
    frame = document.grade.frames[0]
    document.set(document.grade.palette(frame).ids[0], rgb=(0.5, 0.3, 0.3))
    pixels = image(8, 8, 3)
    there = conversion.steps.to_palette(pixels).astype(np.float32)
    expected = conversion.steps.to_clip(document.recolour(there, frame, space="palette"))
    np.testing.assert_allclose(document.recolour(pixels, frame), expected, atol=2e-5)
    np.testing.assert_allclose(
        document.weights(pixels, frame), document.weights(there, frame, space="palette"), atol=1e-4
    )


def test_weights_reproduce_the_pixels(edited: Path) -> None:
    document = Document.load(edited)
    palette = document.grade.palette(3)
    shares = np.random.default_rng(1).dirichlet(np.ones(len(palette.ids)), (6, 7))
    pixels = (shares @ palette.rgb).astype(np.float32)
    weights = document.weights(pixels, 3)
    assert weights.shape == (6, 7, 4)
    assert weights.dtype == np.float32
    np.testing.assert_allclose(weights.sum(axis=-1), 1, atol=1e-6)
    np.testing.assert_allclose(weights @ palette.rgb, pixels, atol=1e-6)
    beyond = document.weights(image(2, 2, 4) + 5, 3)
    np.testing.assert_allclose(beyond.sum(axis=-1), 1, atol=1e-6)
    recoloured = pixels + weights @ (palette.edited - palette.rgb)
    np.testing.assert_allclose(document.recolour(pixels, 3), recoloured, atol=1e-4)


@pytest.mark.parametrize(
    ("wrong", "remedy"),
    [
        (np.zeros((2, 2, 3), np.uint8), "255"),
        (np.zeros((2, 2, 3), np.uint16), "65535"),
        (np.zeros((2, 2, 3)), "astype"),
        (np.zeros((2, 2, 3), np.float16), "astype"),
        (np.zeros((2, 2), np.float32), "height"),
        (np.zeros((2, 2, 5), np.float32), "height"),
        (np.zeros((3, 2, 2, 3), np.float32), "height"),
    ],
)
def test_images_of_other_kinds_get_a_remedy(plain: Path, wrong: Any, remedy: str) -> None:
    document = Document.load(plain)
    for apply in (document.recolour, document.weights):
        with pytest.raises(Palette4dError, match=remedy):
            apply(wrong, 3)


def test_options_outside_their_range_are_refused(plain: Path) -> None:
    document = Document.load(plain)
    for options in ({"strength": 1.5}, {"strength": float("nan")}, {"space": "sRGB"}):
        with pytest.raises(Palette4dError):
            document.recolour(image(2, 2, 3), 3, **options)
