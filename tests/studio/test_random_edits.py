"""Random edits, drags, undos and redos: undone, they leave the first bytes."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule, run_state_machine_as_test

from palette4d.grade.document import Document
from palette4d.grade.edits import RAMPS
from palette4d.studio import grade_steps
from palette4d.studio.session import Session

GOLDEN = Path(__file__).resolve().parent.parent / "golden" / "sidecars"
Colour = tuple[float, float, float]


@pytest.mark.parametrize(
    ("runs", "steps"), [(6, 40), pytest.param(50, 200, marks=pytest.mark.slow)]
)
def test_random_edits_undone_are_the_first_bytes(tmp_path: Path, runs: int, steps: int) -> None:
    start = tmp_path / "start.p4d.json"
    Document(json.loads((GOLDEN / "v1_merge.p4d.json").read_text())).save(start)
    first = start.read_bytes()
    polytope = json.loads(first)["polytope"]
    ids = [each["id"] for each in polytope["vertices"]]
    edges = [each["id"] for each in polytope["edges"]]
    handles = st.lists(st.sampled_from([*ids, "s1", "s2", "p1"]), max_size=3, unique=True)
    colour = st.tuples(*[st.floats(-0.5, 1.5, width=32)] * 3)

    class Grading(RuleBasedStateMachine):
        """A person who edits, drags, undoes and redoes, while the session saves."""

        def __init__(self) -> None:
            super().__init__()
            self.path = Path(tempfile.mkdtemp(dir=tmp_path)) / "a.p4d.json"
            self.path.write_bytes(first)
            self.session = Session()
            self.session.open_sidecar(self.path)
            self.now = 0.0

        @property
        def document(self) -> Document:
            assert self.session.document is not None
            return self.session.document

        @rule(id_=st.sampled_from(ids), rgb=colour)
        def set(self, id_: str, rgb: Colour) -> None:
            self.session.edit(lambda document: document.set(id_, rgb=rgb, any_value=True))

        @rule(edge=st.sampled_from(edges), frame=st.integers(0, 20), rgb=colour)
        def stop(self, edge: str, frame: int, rgb: Colour) -> None:
            self.session.edit(
                lambda document: document.stop(edge, frame=frame, rgb=rgb, any_value=True)
            )

        @rule(frame=st.integers(0, 20), dragging=st.booleans())
        def move(self, frame: int, dragging: bool) -> None:
            grade_steps.move_stop(self.session, "s1", frame, dragging=dragging)
            self.session.drop()

        @rule(id_=st.sampled_from(ids), colours=st.lists(colour, max_size=4), kept=st.booleans())
        def drag(self, id_: str, colours: list[Colour], kept: bool) -> None:
            for rgb in colours:
                self.session.drag(lambda document, c=rgb: document.set(id_, rgb=c, any_value=True))
            if kept:
                self.session.drop()
            else:
                self.session.cancel()

        @rule(chosen=handles)
        def select(self, chosen: list[str]) -> None:
            self.session.select(*chosen)

        @rule(ramp=st.sampled_from(RAMPS))
        def ramp(self, ramp: str) -> None:
            grade_steps.set_ramp(self.session, ramp)

        @rule()
        def lock(self) -> None:
            grade_steps.lock(self.session)

        @rule()
        def reset(self) -> None:
            grade_steps.reset(self.session)

        @rule()
        def reset_all(self) -> None:
            grade_steps.reset_all(self.session)

        @rule(rgb=colour, to=colour, frame=st.integers(0, 20))
        def pick(self, rgb: Colour, to: Colour, frame: int) -> None:
            if len(self.document.grade.picks) < 3:
                self.session.edit(
                    lambda document: document.pick(
                        frame, colour=rgb, to=to, follow=False, any_value=True
                    )
                )

        @rule(on=st.booleans())
        def switch(self, on: bool) -> None:
            if any(pick.id == "p1" for pick in self.document.grade.picks):
                grade_steps.enable(self.session, "p1", on)

        @rule()
        def keep_version(self) -> None:
            grade_steps.keep_version(self.session)

        @rule(number=st.integers(0, 3))
        def use_version(self, number: int) -> None:
            if number < len(self.session.versions):
                grade_steps.use_version(self.session, self.session.versions[number])

        @rule()
        def undo(self) -> None:
            self.session.undo()

        @rule()
        def redo(self) -> None:
            self.session.redo()

        @rule()
        def wait(self) -> None:
            self.now += 1e9
            self.session.tick(self.now)

        @invariant()
        def nothing_is_dragged(self) -> None:
            assert not self.session.dragging

        def teardown(self) -> None:
            state, done = self.document.grade.state, len(self.document.history.done)
            for _ in range(done):
                self.session.undo()
            for _ in range(done):
                self.session.redo()
            assert self.document.grade.state == state
            for _ in range(done):
                self.session.undo()
            for name in self.document.grade.versions:  # no step takes them away
                self.session.edit(lambda document, name=name: document.remove_version(name))
            self.session.edit(lambda document: document.forget_history())
            assert self.session.save()
            self.session.close()
            assert self.path.read_bytes() == first

    run_state_machine_as_test(
        Grading,
        settings=settings(
            max_examples=runs,
            stateful_step_count=steps,
            deadline=None,
            suppress_health_check=list(HealthCheck),
        ),
    )
