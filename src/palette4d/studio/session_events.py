"""How the views of a session hear what changed. It knows no toolkit."""

from collections.abc import Callable
from typing import Literal

from palette4d.common.errors import Palette4dError, in_words
from palette4d.grade.clip_of_picks import OWN_CLIP
from palette4d.media.clip_base import LEAVE_OUT
from palette4d.studio import texts
from palette4d.studio.states import Code, Level, Status

#: The advice of the API, and the window's.
ADVICE = {LEAVE_OUT: texts.BAD_FRAME, OWN_CLIP: texts.OWN_CLIP}

#: Whether a panel is told of each step of a drag; None: it is no panel.
Follows = Callable[[], bool] | None

Event = Literal[
    "document",  # the palette or its edits, also of every step of a drag
    "clip",  # another clip, or none
    "frame",
    "pixels",  # the frame's pixels have arrived, or the reason why they cannot
    "selection",
    "hover",
    "probe",
    "view",
    "wipe",  # the wipe alone has moved
    "playing",
    "range",
    "status",
    "followed",  # an edit has read the clip, or failed
    "draft",  # what a pick of the clicked pixel takes is learned
    "answer",  # what the selected pick takes is known, or is not any more
    "picture",  # the viewer shows another picture
    "tool",  # what a click in the picture does
]


class Events:
    """The events of a session, and the status, which is one of them.

    Attributes
    ----------
    status : Status
        What the last action did.
    post : callable
        Runs a function on the views' thread; the window sets it.
    later : callable
        Runs a panel's function soon, when the picture is shown; the window sets it.
    """

    def __init__(self) -> None:
        """Begin without listeners."""
        self._callbacks: dict[str, list[tuple[Callable[[], object], Follows]]] = {}
        self.status = Status()
        self.post: Callable[[Callable[[], object]], object] = lambda call: call()
        self.later: Callable[[Callable[[], object]], object] = lambda call: call()

    @property
    def dragging(self) -> bool:
        """Whether something is being dragged."""
        return False

    def on(
        self,
        event: Event,
        callback: Callable[[], object],
        *,
        panel: bool = False,
        follows: Callable[[], bool] = lambda: False,
    ) -> None:
        """Call a function after every event of this kind.

        A panel is told later while frames go by: the picture comes first. While something is
        dragged, only panels that follow it are told, and the others when it is let go.
        """
        self._callbacks.setdefault(event, []).append((callback, follows if panel else None))

    def emit(self, event: Event) -> None:
        """Tell the views."""
        dragged = event == "document" and self.dragging
        for callback, follows in tuple(self._callbacks.get(event, ())):
            if follows is None or not (dragged or event == "frame"):
                callback()
            elif not dragged or follows():
                self.later(callback)

    def say(self, text: str, level: Level = "info", code: Code = "") -> None:
        """Set the status."""
        self.status = Status(text, level, code)
        self.emit("status")

    def report(self, error: Exception) -> None:
        """Show an error as the status."""
        self.say(words_of(error), "error")


def words_of(error: Exception) -> str:
    """Return an error as a sentence, with the window's own advice where it has some."""
    if isinstance(error, Palette4dError) and error.advice in ADVICE:
        return f"{error.text} {ADVICE[error.advice]}"
    return in_words(error) or type(error).__name__
