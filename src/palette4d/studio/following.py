"""Edits that read the clip: made at once, and completed beside the views' thread.

What a gesture asks for is in the document when it ends, with a path and a matte that are not known
yet; so it is saved at once. A thread does the same edit with the clip, one after another, and what
it found is put into the step. An edit that a newer one replaces is left: undo takes it up again. It
knows no toolkit.
"""

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from palette4d.grade import edits, later, unread_steps
from palette4d.grade.document import Document, OfClip
from palette4d.grade.edits import Edit
from palette4d.grade.follow import Progress
from palette4d.grade.grade import Grade
from palette4d.studio import texts
from palette4d.studio.session_events import words_of

if TYPE_CHECKING:
    from palette4d.studio.session import Session

#: An edit of a document with its clip, or with an `Unread` one.
ClipEdit = Callable[[Document, OfClip | None, Progress | None], object]
#: Seconds between two words about the progress.
SAY_EVERY = 0.1


@dataclass(frozen=True)
class Job:
    """An edit that is made, and not completed yet.

    Attributes
    ----------
    edit : callable or None
        Does it; None: `later.do_again` does, because another program began it.
    clip : str
        The clip.
    text : str
        What it did, for people.
    before, after : Grade
        Around it, as it was made.
    step : Edit
        Its step in the history.
    """

    edit: ClipEdit | None
    clip: str
    text: str
    before: Grade
    after: Grade
    step: Edit

    def with_readings(self, readings: later.Readings, done: Grade) -> "Job":
        """Return the job after an earlier one has completed picks that this one knows too."""
        before, after = (
            grade.with_state(later.with_readings(grade.state, readings)).with_mattes(done.mattes)
            for grade in (self.before, self.after)
        )
        changes = edits.difference(before.state, after.state).undoable().changes
        step = replace(self.step, changes=changes)
        return replace(self, before=before, after=after, step=step)


class _Replaced(Exception):
    """What a thread reads is not wanted any more."""


class Follower:
    """Completes edits of a session in a thread, in the order in which they were made."""

    def __init__(self, session: "Session") -> None:
        """Wait for edits."""
        self._session = session
        self._jobs: deque[Job] = deque()

    def __len__(self) -> int:
        """How many edits are not completed yet."""
        return len(self._jobs)

    def add(self, job: Job) -> None:
        """Complete this edit, the newest one, when those before it are that it does not replace."""
        state, first = job.after.state, self._first
        self._jobs = deque(
            each for each in self._jobs if not unread_steps.replaces(job.step, each.step, state)
        )
        self._jobs.append(job)
        if self._first is not first:
            self._begin()

    def again(self, jobs: Iterable[Job]) -> None:
        """Complete these edits of before too, unless they wait already."""
        first = self._first
        waiting = [each.step for each in self._jobs]
        self._jobs.extend(
            job for job in jobs if not any(later.same(job.step, step) for step in waiting)
        )
        if self._jobs and self._first is not first:
            self._begin()

    def clear(self) -> None:
        """Forget all: there is another document."""
        self._jobs.clear()

    def _begin(self) -> None:
        job, session = self._jobs[0], self._session
        session.say(texts.LEARNING)
        threading.Thread(
            target=lambda: self._work(job), name="palette4d follower", daemon=True
        ).start()

    def _work(self, job: Job) -> None:
        """Do an edit with its clip; runs in a thread."""
        session, said = self._session, 0.0
        trial = Document(job.before)

        def say(done: int, total: int) -> None:
            nonlocal said
            if self._first is not job:
                raise _Replaced
            if time.monotonic() - said >= SAY_EVERY:
                said = time.monotonic()
                words = texts.FOLLOWING.format(done=done, total=total)
                session.post(lambda: session.say(words) if self._first is job else None)

        try:
            if job.edit is None:
                later.do_again(trial, job.step, job.clip, say)
            else:
                job.edit(trial, job.clip, say)
        except _Replaced:
            return
        except Exception as error:  # whatever fails, the window stays
            failed = error
            session.post(lambda: self._failed(job, failed))
        else:
            session.post(lambda: self._done(job, trial))

    @property
    def _first(self) -> Job | None:
        """The job that is being done; no other one is wanted."""
        jobs = self._jobs
        return jobs[0] if jobs else None

    def _done(self, job: Job, done: Document) -> None:
        if self._first is not job:
            return
        readings = later.readings_of(done.grade, job.after)
        self._jobs.popleft()
        self._jobs = deque(each.with_readings(readings, done.grade) for each in self._jobs)
        like = done.history.done[-1] if done.history.done else job.step
        if self._session.complete((job.step, like), readings, done.grade.mattes):
            self._session.say(job.text)
        self._next()

    def _failed(self, job: Job, error: Exception) -> None:
        if self._first is not job:
            return
        self._jobs.popleft()
        self._session.say(texts.NOT_FOLLOWED.format(why=words_of(error)), "error")
        self._next()

    def _next(self) -> None:
        if self._jobs:
            self._begin()
        self._session.emit("followed")
