"""A pick before its colour is chosen, and the mattes that lie over the picture.

A click in the picture learns what a pick there takes, beside the views' thread. While its colour is
dragged, nothing is learned. It knows no toolkit.
"""

from abc import abstractmethod

from palette4d import _core
from palette4d.grade.document import Document
from palette4d.grade.later import Unread
from palette4d.grade.mattes import Learned, odds_of
from palette4d.grade.picks import Pick
from palette4d.studio.newest import Newest
from palette4d.studio.session_view import SessionView
from palette4d.studio.states import Place

#: Stands for the id of the pick that is being made.
DRAFT = "draft"


class Drafts(SessionView):
    """A session's clicked pixel, and what a pick there takes."""

    def __init__(self) -> None:
        """Begin without a pixel."""
        super().__init__()
        self._learner = Newest("palette4d learner")
        self._drafted: tuple[Place, Document, Pick] | None = None
        self._waits: Place | None = None

    @property
    @abstractmethod
    def document(self) -> Document | None:
        """The document as the views show it."""

    @property
    def picked(self) -> Pick | None:
        """The pick or hold that is selected, the first one."""
        picks = () if self.document is None else self.document.grade.picks
        return next((pick for pick in picks if pick.id in self.selection), None)

    @property
    def draft(self) -> Pick | None:
        """The pick of the clicked pixel, with its matte; None until that is learned."""
        found = self._drafted
        return None if found is None or found[0] is not self.place else found[2]

    @property
    def learning(self) -> bool:
        """Whether the matte of the clicked pixel is being learned."""
        return self.place is not None and self._waits is self.place

    def begin_pick(self, place: Place) -> None:
        """Inspect a pixel that was clicked, and learn what a pick there takes."""
        super().begin_pick(place)
        document, clip = self.document, self.clip
        if document is None or clip is None:
            return
        trial, source, self._waits = Document(document.grade), clip.source, place

        def work() -> None:
            try:
                made = trial.pick(
                    place.frame,
                    pixel=(place.x, place.y),
                    box=place.box,
                    to=place.colour,
                    clip=source,
                    follow=False,
                    any_value=True,
                )
            except Exception as error:  # whatever fails, the window stays
                failed = error
                self.post(lambda: self._failed(place, failed))
            else:
                self.post(lambda: self._learned(place, trial, made))

        self._learner.ask(work)

    def _learned(self, place: Place, trial: Document, made: Pick) -> None:
        if self.place is not place:
            return
        self._drafted, self._waits = (place, trial, made), None
        self.take_mattes(trial)
        self.emit("draft")

    def unread(self, place: Place) -> Unread:
        """Return what is known of a pixel before the clip is read."""
        found = self._drafted
        if found is None or found[0] is not place:
            return Unread(place.colour)
        _, document, made = found
        if made.matte is None:
            return Unread(place.colour)
        odds = odds_of(document.grade.mattes[made.matte])
        return Unread(place.colour, Learned(odds, True))

    def _failed(self, place: Place, error: Exception) -> None:
        if self.place is place:
            self._waits = None
            self.report(error)

    @abstractmethod
    def take_mattes(self, trial: Document) -> None:
        """Have the mattes that were learned for a copy of the document."""

    # ------------------------------------------------------------------------------------- mattes

    @property
    def shown_matte(self) -> str | None:
        """The handle, palette colour or pick whose matte lies over the picture, or `DRAFT`."""
        if self.hover is not None:
            return self.hover
        if self.place is not None:
            here = self.place.frame == self.frame and self.draft is not None
            return DRAFT if here and (self.view.matte or not self.dragging) else None
        return self.picked.id if self.view.matte and self.picked is not None else None

    def pick_matte(self, id: str | None) -> _core.FramePicks | None:
        """Return the matte of a pick at the playhead; None for other ids."""
        document, id_ = self.document, id
        if id == DRAFT and self._drafted is not None:
            _, document, made = self._drafted
            id_ = made.id
        picks = () if document is None else document.grade.picks
        if document is None or all(pick.id != id_ for pick in picks):
            return None
        return document.grade.core.pick_matte_at(str(id_), self.frame)
