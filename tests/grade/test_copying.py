"""Copied grades: the look of one palette for another, and for a new analysis of the same clip."""

import copy
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from palette4d.colour.encoding_conversion import between
from palette4d.common.errors import Palette4dError
from palette4d.grade import copying, reanalysis, sidecar
from palette4d.grade.clip_of_picks import ClipOfPicks
from palette4d.grade.copying import Fit
from palette4d.grade.document import Document
from palette4d.grade.picks import Area, PathKey, Pick, Window, WindowKey
from palette4d.media.array_clip import ArrayClip

GOLDEN = Path(__file__).parents[1] / "golden" / "sidecars"


def members(name: str) -> dict[str, Any]:
    return sidecar.load(GOLDEN / f"v1_{name}.p4d.json")


def stretched(fields: dict[str, Any], factor: int, shift: int) -> dict[str, Any]:
    """The same palette over another range of frames."""
    fields = copy.deepcopy(fields)
    clip, polytope = fields["clip"], fields["polytope"]
    for name in ("first", "last"):
        clip["frames"][name] = clip["frames"][name] * factor + shift
    for vertex in polytope["vertices"]:
        vertex["frame"] = vertex["frame"] * factor + shift
    for block in polytope["blocks"]:
        for name in ("first", "last"):
            block[name] = block[name] * factor + shift
    fields["edits"] = {"vertices": [], "stops": []}
    return fields


def graded() -> Document:
    document = Document(members("split"))
    document.adjust("v1", track=True, by=(0.2, 0.1, 0))
    document.adjust("v4", track=True, rgb=(0.6, 0.1, 0.8), start=0, until=6, fade=3)
    return document


def worst(one: Document, other: Document, times: list[tuple[float, float]]) -> float:
    return max(
        float(np.abs(one.grade.palette(t).edited - other.grade.palette(u).edited).max())
        for t, u in times
    )


def test_the_same_palette_gets_the_same_grade() -> None:
    source, target = graded(), Document(members("split"))
    fit = target.copy_from(source)
    assert worst(target, source, [(t, t) for t in range(21)]) < 4 / 255
    assert fit.fits
    assert fit.change > 0.02
    assert fit.mean < 1 / 255
    assert fit.largest < 4 / 255
    assert fit.foreign == 0
    assert len(target.grade.settings) < 25


def test_another_length_has_corresponding_times() -> None:
    source = graded()
    target = Document(stretched(members("split"), 3, 1000))
    target.copy_from(source)
    assert worst(target, source, [(1000 + 3 * t, t) for t in range(21)]) < 5 / 255


def test_a_target_of_very_many_frames_is_refused() -> None:
    target = Document(stretched(members("split"), 50_000_000, 0))
    with pytest.raises(Palette4dError, match="more than 1000000 frames"):
        target.copy_from(graded())
    assert not target.grade.settings


def test_one_frame_gives_its_look_to_all_frames() -> None:
    source, target = graded(), Document(members("split"))
    target.copy_from(source, time=2)
    there = source.grade.palette(2)
    for frame in (0, 7, 15, 20):
        palette = target.grade.palette(frame)
        image = palette.rgb[None].astype(np.float32)
        expected = source.recolour(image, 2, space="palette")[0]
        assert palette.edited == pytest.approx(expected, abs=4 / 255)
    assert there.edited != pytest.approx(there.rgb)


def test_a_copy_is_one_step_and_loses_no_edits() -> None:
    source, target = graded(), Document(members("edited"))
    before = target.fields()["edits"]
    target.copy_from(source)
    assert target.grade.versions == ("before copy",)
    assert target.version("before copy").fields()["edits"] == before
    assert len(target.history.done) == 1
    target.undo()
    assert target.fields()["edits"] == before


def test_colours_of_another_encoding_are_converted() -> None:
    source = graded()
    fields = stretched(members("split"), 1, 0)
    convert = between("sRGB", "ACEScct")
    assert convert is not None
    fields["clip"]["encoding"] = "ACEScct"
    for vertex in fields["polytope"]["vertices"]:
        vertex["rgb"] = convert(vertex["rgb"]).tolist()
    target = Document(fields)
    target.copy_from(source)
    back = between("ACEScct", "sRGB")
    assert back is not None
    for id_ in ("v1", "v12", "v4"):
        assert back(target.grade.colour(id_)) == pytest.approx(source.grade.colour(id_), abs=0.01)
    for id_ in ("v2", "v3"):
        assert id_ not in target.grade.settings


def test_encodings_that_cannot_be_converted_are_refused() -> None:
    fields = stretched(members("split"), 1, 0)
    fields["clip"]["encoding"] = "nobody's"
    target = Document(fields)
    before = target.fields()
    with pytest.raises(Palette4dError, match=r"nobody's.*sRGB|sRGB.*nobody's"):
        target.copy_from(graded())
    assert target.fields() == before


def test_an_unknown_encoding_is_taken_for_srgb() -> None:
    """As in bakes: many movies state none."""
    fields = stretched(members("split"), 1, 0)
    fields["clip"]["encoding"] = "unknown"
    assert Document(fields).copy_from(graded()).fits


@pytest.mark.parametrize("time", [-1, 21, "absolute", float("nan")])
def test_wrong_times_are_refused(time: Any) -> None:
    target = Document(members("split"))
    before = target.fields()
    with pytest.raises(Palette4dError):
        target.copy_from(graded(), time=time)
    plain = GOLDEN / "v1_split.p4d.json"
    with pytest.raises(Palette4dError, match=re.escape(f"{plain} has no edits")):
        target.copy_from(Document.load(plain))
    assert target.fields() == before


def test_colours_that_the_source_lacks_are_reported() -> None:
    target = Document(members("split"))
    fields = members("split")
    for vertex in fields["polytope"]["vertices"]:
        vertex["rgb"] = [value * 0.3 for value in vertex["rgb"]]
    source = Document(fields)
    source.adjust(by=(0.1, 0, 0))
    fit = target.copy_from(source)
    assert fit.foreign > 0.5
    assert not fit.fits
    assert "does not fit" in str(fit)
    assert "not in" in str(fit)


def test_a_copy_that_transfers_next_to_nothing_does_not_fit() -> None:
    change = 0.8 / 255
    assert not Fit(change, change, 2 * change, 0).fits
    assert Fit(change, change / 4, change, 0).fits
    assert Fit(0, 1e-6, 1e-5, 0).fits  # nothing to transfer
    large = 20 / 255
    assert Fit(large, 0.25 * large, large, 0).fits
    assert not Fit(large, 0.4 * large, large, 0).fits


def test_a_new_analysis_with_another_palette_gets_the_grade(tmp_path: Path) -> None:
    path = tmp_path / "clip.p4d.json"
    document = graded()
    document.save_version("purple")
    document.adjust(by=(0, 0.1, 0))
    own = Document(members("split"))
    own.save_version("neutral")
    document = Document(
        {**document.fields(), "versions": own.fields()["versions"] + document.fields()["versions"]}
    )
    document.save(path)
    read = path.read_bytes()
    fields = members("merge")
    fields["edits"] = {"vertices": [], "stops": []}
    (tmp_path / "clip.former.p4d.json").mkdir()  # a name that is taken
    for on_edits in ("refuse", "keep"):
        new = Document(fields)
        if on_edits == "refuse":
            with pytest.raises(Palette4dError):
                new.save(path)
            assert path.read_bytes() == read
        else:
            new.save(path, on_edits="keep")
    assert (tmp_path / "clip.former2.p4d.json").read_bytes() == read
    assert any("clip.former2.p4d.json" in note for note in new.notes)
    found = Document.load(path)
    assert found.fields()["polytope"] == fields["polytope"]
    assert found.grade.versions == ("neutral", "purple")
    assert not found.version("neutral").grade.edited
    assert found.grade.settings
    assert found.version("purple").grade.settings != found.grade.settings
    assert len(found.history.done) == 1
    again = Document(members("split"))
    again.save(path, on_edits="keep")
    assert (tmp_path / "clip.former3.p4d.json").exists()
    path.write_bytes(read)  # as a run leaves it that was killed after it had kept the old file
    Document(fields).save(path, on_edits="keep")
    assert not (tmp_path / "clip.former4.p4d.json").exists()


def test_a_new_analysis_does_not_replace_what_another_program_writes_meanwhile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "clip.p4d.json"
    graded().save(path)
    copied = reanalysis.copied

    def slowly(*given: Any, **how: Any) -> Any:
        path.write_bytes(path.read_bytes() + b"\n")  # without the lock
        return copied(*given, **how)

    monkeypatch.setattr(reanalysis, "copied", slowly)
    fields = members("merge")
    fields["edits"] = {"vertices": [], "stops": []}
    with pytest.raises(Palette4dError, match="another program"):
        Document(fields).save(path, on_edits="keep")
    assert path.read_bytes().endswith(b"\n\n")


@pytest.mark.parametrize("later", [0, 5, 1000])
def test_edits_stay_with_the_same_handles(tmp_path: Path, later: int) -> None:
    path = tmp_path / "clip.p4d.json"
    document = Document(members("split"))
    seen = document.grade.palette(8).rgb.mean(axis=0).tolist()
    document.pick(frame=8, colour=seen, by=(0.2, 0, 0))
    document.save_version("picked")
    document.set("v1", rgb=(1, 0, 0))
    document.stop("e1", frame=3, rgb=(0, 1, 0))
    document.lock("v1")
    document.save(path)
    moved = stretched(members("split"), 1, later)
    moved["edits"] = {"vertices": [], "stops": []}
    moved["quality"] = {"stages": [], "options": {"method": "like"}, "versions": {}}
    for vertex in moved["polytope"]["vertices"]:
        vertex["rgb"] = [0.9 * value for value in vertex["rgb"]]
    new = Document(moved)
    new.save(path, on_edits="keep")
    assert not new.notes
    found = Document.load(path)
    assert found.fields()["polytope"] == moved["polytope"]
    stop = found.grade.settings["s1"]
    assert (stop.edge, stop.frame) == ("e1", 3 + later)
    kept = {**found.grade.settings, "s1": replace(stop, frame=3)}
    assert kept == document.grade.settings
    assert found.grade.locks == ("v1",)
    assert [step.label for step in found.history.done] == [s.label for s in document.history.done]
    assert found.grade.picks == (document.grade.pick("p1").shifted(later),)
    image = np.array(seen, dtype=np.float32)[None, None]
    for one in (found, found.version("picked")):
        assert one.recolour(image, 8 + later)[0, 0] == pytest.approx(
            np.add(seen, (0.2, 0, 0)), abs=0.02
        )
    assert not (tmp_path / "clip.former.p4d.json").exists()
    for _ in document.history.done:
        found.undo()
    assert not found.grade.edited


def test_ids_of_a_palette_that_was_found_anew_say_nothing(tmp_path: Path) -> None:
    path = tmp_path / "clip.p4d.json"
    graded().save(path)
    found = members("split")  # the same ids and edges, and v1 and v2 have changed places
    found["edits"] = {"vertices": [], "stops": []}
    one, two = found["polytope"]["vertices"][:2]
    one["rgb"], two["rgb"] = two["rgb"], one["rgb"]
    new = Document(found)
    new.save(path, on_edits="keep")
    assert any("the grade was copied" in note for note in new.notes)


def test_99_of_100_colours_stay_below_the_largest_difference() -> None:
    colours = np.random.default_rng(3).uniform(0.1, 0.9, (100, 3))
    fields = members("split")
    fields["colours"] = [{"frame": 0, "rgbw": [[*rgb, 0.01] for rgb in colours.tolist()]}]
    source = Document(members("split"))
    source.set("v1", rgb=(0.6, 0.1, 0.2))
    fit = copying.fit(Document(fields).grade, source.grade)
    moved = source.recolour(colours.astype(np.float32)[None], 0, space="palette")[0]
    off = np.sort(np.abs(moved - colours).max(axis=1))
    assert off[98] > 1.5 * off[50]
    assert (fit.largest, fit.mean) == pytest.approx((off[98], off.mean()), abs=1e-6)


@pytest.mark.parametrize("moves", [True, False])
def test_the_grade_is_copied_beyond_a_stop_and_to_another_encoding(
    tmp_path: Path, moves: bool
) -> None:
    path = tmp_path / "clip.p4d.json"
    document = Document(members("edge_through_boundary"))
    document.stop("e2", frame=4, rgb=(1, 0, 0))
    document.save(path)
    moved = members("edge_through_boundary")
    moved["edits"] = {"vertices": [], "stops": []}
    moved["quality"] = {"stages": [], "options": {"method": "like"}, "versions": {}}
    if moves:
        (middle,) = (v for v in moved["polytope"]["vertices"] if v["id"] == "v5")
        middle["frame"] = 3
    else:
        moved["polytope"]["vertices"][0]["rgb"] = [0.2, 0.1, 0.1]
        moved["clip"]["encoding"] = "unknown"
    new = Document(moved)
    new.save(path, on_edits="keep")
    assert any("the grade was copied" in note for note in new.notes)
    assert (tmp_path / "clip.former.p4d.json").exists()


@pytest.mark.parametrize("ramp", [None, "smooth", "step"])
def test_edits_between_analysed_frames_are_copied(ramp: str | None) -> None:
    """A palette of each fifth frame gets what a palette of every frame has in between."""
    source = Document(members("split"))
    if ramp:
        source.set_ramp(ramp)
    source.adjust("v1", track=True, by=(0.3, 0.2, 0), start=6, until=8, fade=4)
    when = {"start": 6, "until": 8, "follow": False}
    source.pick(frame=7, colour=(0.5, 0.5, 0.5), by=(0.2, 0, 0), **when)
    sparse = members("split")
    sparse["clip"]["frames"]["step"] = 5
    for time in ("same", "relative"):
        target = Document(copy.deepcopy(sparse))
        target.copy_from(source, time=time)
        (pick,) = target.grade.picks
        assert (pick.start, pick.until) == (6, 8)
        assert worst(target, source, [(t, t) for t in range(21)]) < 4 / 255


def test_marks_and_windows_go_along_with_frame_numbers(tmp_path: Path) -> None:
    """The same pictures under other numbers are a new version of the clip."""
    path = tmp_path / "clip.p4d.json"
    former = Document(members("split"))
    seen = former.grade.palette(8).rgb.mean(axis=0).tolist()
    marked = {"areas": (Area(12, ((3, 4),), 2),), "window": (1, 2, 9, 8)}
    former.pick(8, colour=seen, by=(0.2, 0, 0), follow=False, **marked)
    former.set_window("p1", 15, (2, 2, 10, 8), follow=False)
    former.save(path)
    fields = stretched(members("split"), 1, 1000)
    fields["polytope"]["vertices"][0]["rgb"][0] += 0.01
    reanalysis.save(fields, path, on_edits="keep")
    (pick,) = Document.load(path).grade.picks
    assert (pick.frame, [area.frame for area in pick.areas]) == (1008, [1012])
    assert pick.window is not None
    assert [key.frame for key in pick.window.keys] == [1008, 1015]


@pytest.mark.parametrize(
    ("first", "last", "time"),
    [(0, 20, "same"), (5, 25, "same"), (21, 41, "relative"), (1000, 1020, "relative")],
)
def test_clips_with_frame_numbers_in_common_keep_edits_at_them(
    first: int, last: int, time: str
) -> None:
    former = Document(members("split"))
    fields = stretched(members("split"), 1, first)
    assert former.grade.frames[:2] == (0, 20)
    assert fields["clip"]["frames"]["last"] == last
    assert reanalysis._time(Document(fields).grade, former.grade) == time


def with_colours(fields: dict[str, Any]) -> dict[str, Any]:
    """As an analysis keeps them: they tell whether clips have the same pictures."""
    frames = fields["clip"]["frames"]
    rows = [[0.1, 0.2, 0.3, 0.75], [0.5, 0.4, 0.3, 0.25]]
    colours = [{"frame": frames[end], "rgbw": rows} for end in ("first", "last")]
    return {**fields, "colours": colours}


@pytest.mark.parametrize("numbers", [0, 7, 1000])
@pytest.mark.parametrize("by", ["keep", "copy", "copy to another"])
def test_picks_of_the_same_pictures_stay_as_they_are(tmp_path: Path, by: str, numbers: int) -> None:
    """Also with other frame numbers, some of which both have: 7 to 27 after 0 to 20."""
    path = tmp_path / "clip.p4d.json"
    fields = with_colours(members("split"))
    keys = (PathKey(4, (0.3, 0.3, 0.4)), PathKey(9, (0.4, 0.4, 0.5), True), PathKey(15, (0, 0, 0)))
    window = Window(3, (WindowKey(8, (1, 2, 9, 8), True), WindowKey(14, (4, 2, 12, 8))), True)
    picked = Pick(
        *("p1", "pick", 8, (0.4, 0.4, 0.5), (0.9, 0.1, 0.1)),
        **{"start": 3, "until": 12.5, "fade": 2, "fade_out": 1, "path": keys, "window": window},
        **{"pixel": (5, 6), "box": 3, "areas": (Area(12, ((3, 4),), 2),), "reach": 1},
    )
    others = (Pick("p2", "hold", 0, (0.1, 0.2, 0.3)), replace(picked, id="p3", enabled=False))
    picks = {("pick", pick.id): pick for pick in (picked, *others)}
    grade = Document(fields).grade.having(picks)
    former = Document(grade.fields())
    former.save_version("kept")
    former.save(path)
    new = Document(with_colours(stretched(members("split"), 1, numbers)))
    new.grade.members["polytope"]["vertices"][0]["rgb"][0] += 0.01
    new = Document(new.grade.members)
    if by == "keep":
        new.save(path, on_edits="keep")
        assert not [note for note in new.notes if "p1" in note]
        versions = Document.load(path).version("kept").grade.picks
        assert versions == Document.load(path).grade.picks
    else:
        new.grade.members["clip"]["name"] += "_mirrored" * (by == "copy to another")
        fit = new.copy_from(Document.load(path))
        new.save(path, on_edits="drop")
        if by == "copy to another":
            assert fit.lost.everywhere == ("p1", "p3")
            return
    kept = Document.load(path).grade.picks
    assert kept == tuple(pick.shifted(numbers) for pick in former.grade.picks)
    assert kept[0].window is not None
    assert (kept[0].start, kept[0].path[1].frame) == (3 + numbers, 9 + numbers)
    assert (kept[0].window.keys[1].frame, kept[0].areas[0].frame) == (14 + numbers, 12 + numbers)


def test_the_same_frames_need_frames_in_common() -> None:
    target = Document(stretched(members("split"), 1, 100))
    with pytest.raises(Palette4dError, match=r"100 to 120 here and 0 to 20 in .*in common"):
        target.copy_from(graded(), time="same")


def test_picks_are_copied() -> None:
    source = Document(members("split"))
    seen = source.grade.palette(8).rgb.mean(axis=0).tolist()
    when = {"start": 4, "until": 10, "fade": 2, "fade_out": 3}
    source.pick(frame=8, colour=seen, by=(0.2, 0, 0), follow=False, **when)
    target = Document(stretched(members("split"), 2, 100))
    fit = target.copy_from(source)
    (pick,) = target.grade.picks
    assert (pick.frame, pick.start, pick.until, pick.fades) == (116, 108, 120, (4, 6))
    assert not target.grade.settings
    image = np.array(seen, dtype=np.float32)[None, None]
    changed = target.recolour(image, 116)[0, 0] - image[0, 0]
    assert changed == pytest.approx([0.2, 0, 0], abs=0.02)
    assert target.recolour(image, 130).tobytes() == image.tobytes()
    back = Document(members("split"))
    target.change_pick(pick.id, frame=115, start=107)
    back.copy_from(target)
    (copied,) = back.grade.picks
    assert (copied.frame, copied.start, copied.until) == (8, 4, 10)  # frames of the clip
    assert fit.mean < 0.02
    target.unpick(pick.id)
    assert not target.grade.edited
    still = Document(members("split"))
    still.copy_from(source, time=15)
    assert not still.grade.picks
    still.copy_from(source, time=8)
    (pick,) = still.grade.picks
    assert (pick.start, pick.until) == (None, None)
    still.copy_from(source, time=3)  # in the middle of a ramp
    (pick,) = still.grade.picks
    assert np.subtract(pick.to, pick.rgb) == pytest.approx([0.1, 0, 0])


@pytest.mark.parametrize(
    ("height", "width", "there"), [(3, 3, False), (4, 4, True), (2, 50, False), (3, 50, True)]
)
def test_a_few_pixels_of_a_colour_or_a_rim_are_no_thing(
    monkeypatch: pytest.MonkeyPatch, height: int, width: int, there: bool
) -> None:
    """Of a frame of 200 x 100 pixels, a connected region of ten is needed, wider than a rim."""
    frames = np.full((2, 100, 200, 3), 0.5, np.float32)
    frames[:, 40 : 40 + height, 60 : 60 + width] = (0.8, 0.2, 0.1)
    monkeypatch.setattr("palette4d.grade.clip_of_picks.find_clip", lambda *_: ArrayClip(frames))
    fields = {"size": (200, 100), "frames": {"first": 0, "last": 1, "step": 1}}
    pick = Pick("p1", "pick", 9, (0.8, 0.2, 0.1), to=(0.1, 0.2, 0.8))
    found = ClipOfPicks(fields, None, None).at_home(pick, None)
    assert (found is not None) == there
    if found is not None:
        assert (found.frame, found.rgb) == (1, pytest.approx(pick.rgb, abs=1e-6))


def test_what_is_nowhere_in_a_clip_changes_nothing_there(monkeypatch: pytest.MonkeyPatch) -> None:
    source = Document(members("split"))
    source.pick(frame=8, colour=(0.9, 0.1, 0.8), by=(0.2, 0, 0), follow=False)
    target = graded()
    first, last, step = target.grade.frames
    width, height = target.grade.members["clip"]["size"]
    grey = np.full((last - first + 1, height, width, 3), 0.4, np.float32)
    assert (first, step) == (0, 1)
    monkeypatch.setattr("palette4d.grade.clip_of_picks.find_clip", lambda *_: ArrayClip(grey))
    before, steps = target.grade.state, target.history
    assert re.search(r"not copied, since .*p1 .*; the edits stay", str(target.copy_from(source)))
    assert (target.grade.state, target.history) == (before, steps)


@pytest.mark.parametrize("corrected", [True, False])
def test_corrections_of_paths_that_are_left_out_are_told(
    monkeypatch: pytest.MonkeyPatch, corrected: bool
) -> None:
    """They are places in the other clip."""
    source = Document(members("split"))
    source.pick(8, colour=(0.4, 0.4, 0.4), by=(0.2, 0, 0), follow=False)
    keys = (PathKey(8, (0.4, 0.4, 0.4), True), PathKey(12, (0.3, 0.4, 0.4), corrected))
    followed = replace(source.grade.pick("p1"), path=keys)
    target = Document(members("merge"))
    (first, last, _), (width, height) = target.grade.frames, target.grade.members["clip"]["size"]
    grey = np.full((last - first + 1, height, width, 3), 0.4, np.float32)
    monkeypatch.setattr("palette4d.grade.clip_of_picks.find_clip", lambda *_: ArrayClip(grey))
    fit = target.copy_from(Document(source.grade.put("pick", "p1", followed).fields()))
    assert fit.lost.uncorrected == ("p1",) * corrected
    assert target.grade.pick("p1").pixel is not None


def test_a_window_stays_with_its_clip() -> None:
    source = Document(members("split"))
    seen = source.grade.palette(8).rgb.mean(axis=0).tolist()
    how = {"colour": seen, "by": (0.2, 0, 0), "follow": False}
    source.pick(frame=8, **how, window=(10, 20, 30, 50))
    source.pick(frame=9, **how)
    target = Document(stretched(members("split"), 2, 100))
    fit = target.copy_from(source)
    assert [pick.window for pick in target.grade.picks] == [None, None]
    assert fit.lost.everywhere == ("p1",)
    assert str(fit).endswith("without a window, since that is a place in the other clip: p1")


def test_places_are_scaled_where_a_larger_clip_has_the_same_palette(tmp_path: Path) -> None:
    path = tmp_path / "clip.p4d.json"
    former = Document(members("split"))
    where = {"window": (1, 2, 9, 8), "areas": (Area(12, ((3, 4),), 2),)}
    former.pick(8, colour=(0.4, 0.4, 0.4), by=(0.2, 0, 0), follow=False, **where)
    former.save(path)
    fields = members("split")
    width, height = fields["clip"]["size"]
    fields["clip"]["size"] = [2 * width, 2 * height]
    _, notes = reanalysis.save(fields, path, on_edits="keep")
    assert any("scaled" in note for note in notes)
    assert Document.load(path).grade.picks == (former.grade.pick("p1").scaled(2, 2),)


def test_undone_edits_are_kept_in_the_former_file(tmp_path: Path) -> None:
    path = tmp_path / "clip.p4d.json"
    document = Document(members("split"))
    document.set("v1", rgb=(0.2, 0.3, 0.4))
    document.undo()
    document.save(path)
    before = path.read_bytes()
    new = Document({**members("merge"), "edits": {"vertices": [], "stops": []}})
    new.save(path, on_edits="keep")
    assert (tmp_path / "clip.former.p4d.json").read_bytes() == before
    assert any("clip.former.p4d.json" in note for note in new.notes)


@pytest.mark.parametrize("same", [True, False])
def test_a_new_analysis_keeps_windows(tmp_path: Path, same: bool) -> None:
    """A sidecar that is made again is of the same shot, whatever its clip is called now."""
    path = tmp_path / "clip.p4d.json"
    document = graded()
    seen = document.grade.palette(8).rgb.mean(axis=0).tolist()
    window = document.pick(
        8, colour=seen, by=(0.2, 0, 0), follow=False, window=(10, 20, 30, 50)
    ).window
    document.save_version("windowed")
    document.lock("v1")
    document.set_ramp("step")
    document.save(path)
    fields = members("merge")
    fields["edits"] = {"vertices": [], "stops": []}
    fields["clip"] = {**document.fields()["clip"], "encoding": fields["clip"]["encoding"]}
    if not same:
        fields["clip"]["source"] = "other.mov"
    new = Document(fields)
    new.save(path, on_edits="keep")
    assert any("the grade was copied" in note for note in new.notes)
    assert any("1 lock of former handles left out: v1" in note for note in new.notes)
    assert "the ramp between edits is linear; it was step" in new.notes
    found = Document.load(path)
    assert found.grade.pick("p1").window == window
    assert found.version("windowed").grade.pick("p1").window == window
