"""The session: edits as the verbs do them, saved by themselves, with other programs' edits."""

from __future__ import annotations

import itertools
import json
import os
import shutil
import time
from collections.abc import Generator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from clip_files import grey_levels

import palette4d
from palette4d.cli.main import main
from palette4d.grade.document import Document
from palette4d.studio import texts
from palette4d.studio.session import (
    SAVE_AFTER,
    SAVE_AT_MOST,
    TRY_AGAIN,
    Session,
    recovered,
    recovery_files,
)

GOLDEN = Path(__file__).resolve().parent.parent / "golden" / "sidecars"
LATER = 1e9


@pytest.fixture
def sidecar(tmp_path: Path) -> Path:
    return Path(shutil.copy(GOLDEN / "v1_tetrahedron.p4d.json", tmp_path / "a.p4d.json"))


@pytest.fixture
def session(sidecar: Path) -> Generator[Session]:
    made = Session()
    made.open_sidecar(sidecar)
    yield made
    made.close()


def vertex(sidecar: Path) -> str:
    return str(json.loads(sidecar.read_text())["polytope"]["vertices"][0]["id"])


def test_an_edit_leaves_the_bytes_of_the_verb(
    session: Session, sidecar: Path, tmp_path: Path
) -> None:
    twin = Path(shutil.copy(sidecar, tmp_path / "b.p4d.json"))
    id_ = vertex(sidecar)
    session.edit(lambda document: document.set(id_, rgb=(0.5, 0.25, 0.125)))
    session.tick(LATER)
    assert main(["edit", str(twin), "set", id_, "--rgb", "0.5", "0.25", "0.125"]) == 0
    assert sidecar.read_bytes() == twin.read_bytes()


@pytest.mark.parametrize(("shown", "then"), [("before", "after"), ("wipe", "wipe")])
def test_what_is_opened_next_is_seen_as_it_is_graded(
    session: Session, sidecar: Path, tmp_path: Path, shown: str, then: str
) -> None:
    session.look(compare=shown)
    session.open_sidecar(shutil.copy(sidecar, tmp_path / "b.p4d.json"))
    assert session.view.compare == then


def test_a_palette_of_very_many_frames_takes_little_memory(tmp_path: Path) -> None:
    """Its frames are counted, not listed: there are 10^9."""
    grey_levels(tmp_path, range(3, 6))
    fields = json.loads((GOLDEN / "v1_split.p4d.json").read_text())
    ranges = [fields["clip"]["frames"], *fields["polytope"]["blocks"]]
    for one in ranges:
        one.update({name: one[name] * 50_000_000 for name in ("first", "last")})
    for one in fields["polytope"]["vertices"]:
        one["frame"] *= 50_000_000
    fields["edits"] = {"vertices": [], "stops": []}
    (tmp_path / "a.p4d.json").write_text(json.dumps(fields))
    session = Session()
    session.open_sidecar(tmp_path / "a.p4d.json", str(tmp_path / "clip.####.png"))
    assert "lacks 999999998 frames of the palette, the first is 0" in session.status.text
    session.close()


def test_a_drag_writes_only_what_is_dropped(session: Session, sidecar: Path) -> None:
    before, id_ = sidecar.read_bytes(), vertex(sidecar)
    for k in range(5):
        session.drag(lambda document, k=k: document.set(id_, rgb=(k / 8, 0, 0)))
        assert session.document is not None
        assert session.document.grade.colour(id_) == (k / 8, 0, 0)
        session.tick(LATER)
    assert sidecar.read_bytes() == before
    session.drop()
    session.tick(LATER)
    loaded = palette4d.load(sidecar)
    assert loaded.grade.colour(id_) == (0.5, 0, 0)
    session.undo()
    session.tick(2 * LATER)
    assert palette4d.load(sidecar).grade.colour(id_) == palette4d.load(
        GOLDEN / "v1_tetrahedron.p4d.json"
    ).grade.colour(id_)


def test_edits_without_a_pause_are_saved_all_the_same(
    session: Session, sidecar: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    id_, clock, written = vertex(sidecar), 0.0, []
    monkeypatch.setattr("palette4d.studio.session.time", SimpleNamespace(monotonic=lambda: clock))
    for _ in range(60):
        clock += SAVE_AFTER / 2
        before = sidecar.read_bytes()
        session.edit(lambda document, x=clock: document.set(id_, rgb=(x / 10, 0.0, 0.0)))
        session.tick()
        written += [clock] if sidecar.read_bytes() != before else []
    assert len(written) >= 2
    assert max(np.diff([0.0, *written, clock])) <= SAVE_AT_MOST + SAVE_AFTER


def test_what_was_released_is_saved_while_the_next_drag_goes_on(
    session: Session, sidecar: Path
) -> None:
    id_ = vertex(sidecar)
    session.edit(lambda document: document.set(id_, rgb=(0.5, 0, 0)))
    session.drag(lambda document: document.set(id_, rgb=(0, 0.5, 0)))
    session.tick(LATER)
    assert palette4d.load(sidecar).grade.colour(id_) == (0.5, 0, 0)
    assert session.dragging
    assert session.document is not None
    assert session.document.grade.colour(id_) == (0, 0.5, 0)


def test_a_cancelled_drag_leaves_nothing(session: Session, sidecar: Path) -> None:
    before, id_ = sidecar.read_bytes(), vertex(sidecar)
    session.drag(lambda document: document.set(id_, rgb=(0, 0, 1)))
    session.cancel()
    session.drop()
    session.tick(LATER)
    assert sidecar.read_bytes() == before


def test_other_programs_edits_are_shown_and_merged(session: Session, sidecar: Path) -> None:
    ids = [each["id"] for each in json.loads(sidecar.read_text())["polytope"]["vertices"]]
    heard = []
    session.on("document", lambda: heard.append(session.revision))
    assert main(["edit", str(sidecar), "set", ids[1], "--rgb", "1", "0", "0"]) == 0
    session.tick(LATER)
    assert session.document is not None
    assert session.document.grade.colour(ids[1]) == (1, 0, 0)
    assert heard
    session.edit(lambda document: document.set(ids[0], rgb=(0, 1, 0)))
    assert main(["edit", str(sidecar), "set", ids[2], "--rgb", "0", "0", "1"]) == 0
    session.tick(2 * LATER)
    both = palette4d.load(sidecar)
    assert [both.grade.colour(id_) for id_ in ids[:3]] == [(0, 1, 0), (1, 0, 0), (0, 0, 1)]


def test_a_file_that_another_program_broke_is_not_overwritten(
    session: Session, sidecar: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    id_ = vertex(sidecar)
    sidecar.write_text('{"schema": ')
    session.tick(LATER)
    assert session.status.level == "error"
    session.edit(lambda document: document.set(id_, rgb=(0, 1, 0)))
    session.tick(LATER + TRY_AGAIN)
    assert sidecar.read_text() == '{"schema": '
    assert session.status.level == "error"
    assert palette4d.load(next(recovery_files(sidecar))).grade.colour(id_) == (0, 1, 0)
    assert session.save_as(tmp_path / "mine.p4d.json")
    assert palette4d.load(tmp_path / "mine.p4d.json").grade.colour(id_) == (0, 1, 0)


def test_the_copy_of_a_file_with_the_longest_name(
    sidecar: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    longest = sidecar.with_name("a" * 245 + ".p4d.json")
    sidecar.rename(longest)
    session = Session()
    session.open_sidecar(longest)
    id_ = vertex(longest)
    session.edit(lambda document: document.set(id_, rgb=(0, 1, 0)))
    longest.write_text("{")
    assert not session.save()
    assert palette4d.load(next(recovery_files(longest))).grade.colour(id_) == (0, 1, 0)


def test_what_an_earlier_session_could_not_save_stays(
    session: Session, sidecar: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    id_, whole = vertex(sidecar), sidecar.read_bytes()
    sidecar.write_text("{")
    session.edit(lambda document: document.set(id_, rgb=(1.0, 0.0, 0.0)))
    assert not session.save()
    sidecar.write_bytes(whole)
    copy = next(recovery_files(sidecar))
    later = Session()
    later.open_sidecar(sidecar)
    assert recovered(sidecar) == copy
    later.edit(lambda document: document.set(id_, rgb=(0.0, 1.0, 0.0)))
    assert later.save()
    assert palette4d.load(copy).grade.colour(id_) == (1.0, 0.0, 0.0)
    sidecar.write_text("{")
    later.edit(lambda document: document.set(id_, rgb=(0.0, 0.0, 1.0)))
    assert not later.save()
    assert palette4d.load(copy).grade.colour(id_) == (1.0, 0.0, 0.0)
    sidecar.write_bytes(whole)


def test_edits_are_offered_again_whatever_the_clocks_say(
    session: Session, sidecar: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The disks of both files have clocks and steps of their own, and others edit the sidecar."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    id_, whole = vertex(sidecar), sidecar.read_bytes()
    first, second = itertools.islice(recovery_files(sidecar), 2)
    sessions = session, Session()
    sessions[1].open_sidecar(sidecar)
    for red, each in enumerate(sessions):
        sidecar.write_text("{")
        each.edit(lambda document, red=red: document.set(id_, rgb=(float(red), 0.5, 0.0)))
        assert not each.save()
    sidecar.write_bytes(whole)
    os.utime(first, (1, 1))
    assert recovered(sidecar) == second
    first.unlink()
    first.symlink_to("gone")
    assert recovered(sidecar) == second
    first.unlink()
    for when in (1, time.time() + 600):
        os.utime(sidecar, (when, when))
        assert recovered(sidecar) == second
    assert sessions[1].save()
    assert recovered(sidecar) is None


def test_edits_are_offered_again_when_a_disk_that_went_comes_back(
    sidecar: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A link on it led to the sidecar; without it nobody knows where to."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    disk = tmp_path / "disk"
    (disk / "v012").mkdir(parents=True)
    shutil.copy(sidecar, disk / "v012" / "a.p4d.json")
    (disk / "current").symlink_to("v012")
    session = Session()
    session.open_sidecar(disk / "current" / "a.p4d.json")
    disk.rename(tmp_path / "away")
    session.edit(lambda document: document.set(vertex(sidecar), rgb=(1.0, 0.0, 0.0)))
    assert not session.save()
    (tmp_path / "away").rename(disk)
    copy = recovered(disk / "current" / "a.p4d.json")
    assert copy is not None
    assert recovered(disk / "v012" / "a.p4d.json") == copy
    # Saved as the very file that the message names, it stays.
    assert session.save_as(copy)
    assert palette4d.load(copy).grade.colour(vertex(sidecar)) == (1.0, 0.0, 0.0)


def test_whatever_a_save_fails_with_the_edits_are_kept(
    session: Session, sidecar: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    session.edit(lambda document: document.set(vertex(sidecar), rgb=(1.0, 0.0, 0.0)))
    save = Document.save

    def fails(document: Document, path: object = None, **how: object) -> None:
        if path is None:
            raise TypeError("a fault of the program")
        save(document, path, **how)

    monkeypatch.setattr(Document, "save", fails)
    assert not session.save()
    assert "a fault of the program" in session.status.text
    copy = recovered(sidecar)
    assert copy is not None
    assert str(copy) in session.status.text
    # Without a place for it the edits are in the window alone.
    shutil.rmtree(copy.parent)
    copy.parent.touch()
    assert not session.save()
    assert texts.KEPT_HERE in session.status.text


def test_saved_in_another_folder_the_sidecar_finds_its_clip(
    session: Session, sidecar: Path, tmp_path: Path
) -> None:
    fields = json.loads(sidecar.read_text())
    fields["clip"]["source"] = "plates/f.####.png"
    sidecar.write_text(json.dumps(fields))
    session.open_sidecar(sidecar)
    (tmp_path / "other").mkdir()
    assert session.save_as(tmp_path / "other" / "b.p4d.json")
    source = palette4d.load(tmp_path / "other" / "b.p4d.json").fields()["clip"]["source"]
    assert Path(source) == tmp_path / "plates" / "f.####.png"


def test_another_file_is_opened_only_when_nothing_is_lost(
    session: Session, sidecar: Path, tmp_path: Path
) -> None:
    other = Path(shutil.copy(sidecar, tmp_path / "other.p4d.json"))
    id_ = vertex(sidecar)
    session.edit(lambda document: document.set(id_, rgb=(1.0, 0.0, 0.0)))
    sidecar.write_text("{")  # broken by another program: it is not overwritten
    with pytest.raises(palette4d.Palette4dError, match="Not saved"):
        session.open_sidecar(other)
    assert session.path == sidecar
    assert session.document is not None
    assert session.document.grade.colour(id_) == (1.0, 0.0, 0.0)


def test_a_file_with_the_palette_of_another_clip_brings_its_clip(
    session: Session, sidecar: Path, tmp_path: Path
) -> None:
    """As when an analysis is undone that was of other frames or another folder."""
    grey_levels(tmp_path, range(3, 6))
    fields = json.loads(sidecar.read_text())
    fields["clip"].update(name="f", source="clip.####.png")
    sidecar.write_text(json.dumps(fields))
    session.tick(LATER)
    assert session.clip is not None
    assert session.clip.frames == [3, 4, 5]
    fields["clip"]["source"] = "gone.####.png"
    sidecar.write_text(json.dumps(fields))
    session.tick(2 * LATER)
    assert session.clip is None  # else other pictures were shown as this clip's


def test_edits_that_fail_become_the_status(session: Session) -> None:
    assert session.edit(lambda document: document.set("nowhere", rgb=(0, 0, 0))) is None
    assert session.status.level == "error"
    assert "nowhere" in session.status.text
    assert session.saved


def test_a_sidecar_that_is_opened_again_has_the_edits_that_opening_it_saved(sidecar: Path) -> None:
    session = Session()
    session.open_sidecar(sidecar)
    session.edit(lambda document: document.set("v1", rgb=(0.2, 0.3, 0.4)))
    session.open_sidecar(sidecar)
    assert session.document is not None
    assert session.document.grade.settings["v1"].rgb == (0.2, 0.3, 0.4)
    session.close()
