"""Undo of an analysis, while other programs edit the sidecar."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from palette4d.cli.main import main
from palette4d.studio import texts
from palette4d.studio.former import Former
from palette4d.studio.session import Session

#: Another program that holds the lock while it writes, and edits like a script that knows no steps.
SLOW_WRITER = """
import sys, time
from pathlib import Path
from palette4d.common.locking import locked
from palette4d.grade import sidecar
path = Path(sys.argv[1])
with locked(path) as held:
    print("held", flush=True)
    time.sleep(0.5)
    old = path.read_bytes()
    fields = sidecar.load(path)
    fields["extra"] = {"other": "precious"}
    sidecar.write(path, sidecar.dumps(fields).encode(), held, replaces=old)
"""


@pytest.fixture(scope="module")
def again(analysed: Path, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The sidecar of another analysis of the clip."""
    out = tmp_path_factory.mktemp("again") / "clip.p4d.json"
    clip = str(analysed / "clip" / "frame.####.png")
    assert main(["analyze", clip, "-o", str(out), "--vertices", "9", "--quiet"]) == 0
    return out.read_bytes()


@pytest.fixture
def former(sidecar: Path, again: bytes) -> Former:
    """A session whose sidecar was just analysed again."""
    session = Session()
    session.open_sidecar(sidecar)
    former = Former(session, lambda: None)
    former.keep(sidecar)
    sidecar.write_bytes(again)
    session.open_sidecar(sidecar)
    former.written(sidecar)
    assert former.can_undo
    return former


def another_program_edits(sidecar: Path) -> bytes:
    edit = [sys.executable, "-m", "palette4d", "edit", str(sidecar), "palette", "--by", "0.05,0,0"]
    subprocess.run(edit, check=True, timeout=60, stdout=subprocess.DEVNULL)
    return sidecar.read_bytes()


def test_an_analysis_is_undone_and_redone(former: Former, sidecar: Path, again: bytes) -> None:
    before = former._past[0].data
    former.undo()
    assert sidecar.read_bytes() == before
    assert former.session.status.text == texts.ANALYSIS_UNDONE
    former.redo()
    assert sidecar.read_bytes() == again


@pytest.mark.parametrize("whose", ["own", "another program's"])
def test_edits_made_while_the_analysis_runs_come_back(
    sidecar: Path, again: bytes, whose: str
) -> None:
    session = Session()
    session.open_sidecar(sidecar)
    former = Former(session, lambda: None)
    former.keep(sidecar)
    if whose == "own":
        session.edit(lambda document: document.adjust(by=(0.05, 0, 0)))
        session.edit(lambda document: document.save_version("meanwhile"))
        assert session.save()
    else:
        another_program_edits(sidecar)
        session.tick()
    edited = sidecar.read_bytes()
    sidecar.write_bytes(again)
    session.tick()  # the new file may be seen before the analysis says that it is done
    session.open_sidecar(sidecar)
    former.written(sidecar)
    former.undo()
    assert sidecar.read_bytes() == edited


def test_edits_that_an_analysis_dropped_come_back(sidecar: Path) -> None:
    """Also where it found the same palette, and its file is seen before it says that it is done."""
    analysed = sidecar.read_bytes()
    session = Session()
    session.open_sidecar(sidecar)
    session.edit(lambda document: document.adjust(by=(0.05, 0, 0)))
    assert session.save()
    edited = sidecar.read_bytes()
    former = Former(session, lambda: None)
    former.keep(sidecar)
    sidecar.write_bytes(analysed)
    session.tick()
    session.open_sidecar(sidecar)
    former.written(sidecar)
    former.undo()
    assert sidecar.read_bytes() == edited


def test_edits_of_another_program_are_undone_first(former: Former, sidecar: Path) -> None:
    before = former._past[0].data
    assert former.session.document
    assert not former.session.document.grade.edited
    theirs = another_program_edits(sidecar)
    former.undo()
    assert sidecar.read_bytes() == theirs
    assert former.session.status.text == texts.ANALYSIS_STAYS
    assert former.session.document.grade.edited
    former.undo()
    assert not former.session.document.grade.edited
    former.undo()
    assert sidecar.read_bytes() == before


def test_edits_without_steps_are_kept(former: Former, sidecar: Path) -> None:
    fields = json.loads(sidecar.read_text())
    vertex = fields["polytope"]["vertices"][0]["id"]
    fields["edits"]["vertices"] = [{"vertex": vertex, "rgb": [0.1, 0.2, 0.3]}]
    sidecar.write_text(json.dumps(fields))
    former.session.tick()  # they are shown
    former.undo()
    assert json.loads(sidecar.read_text())["edits"]["vertices"] == fields["edits"]["vertices"]


@pytest.mark.parametrize("other", ["edits at once", "holds the lock"])
def test_what_another_program_writes_meanwhile_stays(
    former: Former, sidecar: Path, again: bytes, other: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After Studio saved, and before it brings the former file back."""
    save = former.session.save
    running: list[subprocess.Popen[str]] = []

    def save_first() -> bool:
        done = save()
        if other == "edits at once":
            another_program_edits(sidecar)
        else:
            slow = [sys.executable, "-c", SLOW_WRITER, str(sidecar)]
            running.append(subprocess.Popen(slow, text=True, stdout=subprocess.PIPE))
            assert running[0].stdout
            assert running[0].stdout.readline() == "held\n"
        return done

    monkeypatch.setattr(former.session, "save", save_first)
    former.undo()
    for process in running:
        process.communicate(timeout=60)
        assert process.returncode == 0
    fields = json.loads(sidecar.read_text())
    assert fields["polytope"] == json.loads(again)["polytope"]
    assert fields["edits"]["vertices"] if other == "edits at once" else fields["extra"]
    assert former.session.status.level == "error"
    assert "was changed by another program" in former.session.status.text
