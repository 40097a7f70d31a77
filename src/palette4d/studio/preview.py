"""The preview: a frame before and after the edits, at the size on screen, beside the views' thread.

Input: a frame's pixels, the palette at that time, a part of the frame and a look. Output: pictures
of 8 bits. While something moves, the part is scaled down first and recoloured then; when nothing
moves, the frame is recoloured as `palette4d render` does, and scaled down then. Of waiting requests
only the newest is kept, and exact work stops for a new request. Pictures are kept, for playing and
for going back to a frame.
"""

import contextlib
import dataclasses
import threading
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.errors import in_words
from palette4d.grade.answer import WIDTH
from palette4d.grade.document import Document
from palette4d.grade.mattes import Display as Curve
from palette4d.grade.palette import Palette
from palette4d.studio.display import Display, Look
from palette4d.studio.player import MOST_MOVING, ByteCache, Region, nearest, resampled
from palette4d.studio.response import Responses

F32 = NDArray[np.float32]
U8 = NDArray[np.uint8]
Part = tuple[int, int, int, int]

#: Bytes of scaled frames, of pictures before the edits, and of pictures to play, that are kept.
SMALL_BYTES, BEFORE_BYTES, REEL_BYTES = 80 << 20, 40 << 20, 320 << 20
#: The pixels of a request that has none yet, or none any more.
NO_PIXELS = np.zeros((0, 0, 3), np.float32)
#: Pixels that are recoloured between two looks for a newer request.
STRIP = 300_000
#: Pixels in which colours outside of the palette are looked for.
OUTSIDE_POINTS = 60_000
#: The grey of a matte's other pixels, and how much of the picture shows through.
MATTE_GREY, MATTE_SHOWS = 58, 0.12
#: Pixels that a pick leaves alone, beside its matte: this share of their lightness, and a grey.
REST_LIGHT, REST_LIFT = 0.32, 12
#: Light that is added to pixels that it takes, by their luminance: dark ones would not be seen.
LIFT = np.rint((1 - np.arange(256) / 255) ** 4 * 100).astype(np.uint16)


@dataclass(frozen=True)
class Grade:
    """A palette at a time with its edits: what recolouring needs."""

    palette: Palette
    conversion: _core.ColourConversion | None
    picks: _core.FramePicks | None = None
    curve: Curve | None = None  #: from the palette's code values to a display's

    @classmethod
    def of(cls, document: Document, frame: float) -> "Grade":
        """Return a document's grade at a time."""
        palette, own = document.grade.palette(frame), document.grade.core.conversion
        picks = document.grade.core.edits.picks_at(palette.frame)
        curve = document.grade.display() if picks.count else None
        return cls(palette, None if own is None else own.steps, picks, curve)

    @classmethod
    def of_version(cls, document: Document, name: str, frame: float) -> "Grade | None":
        """Return the grade of a version at a time; None if there is no such version."""
        return cls.of(document.version(name), frame) if name in document.grade.versions else None

    @classmethod
    def shown(cls, document: Document, version: str, frame: float) -> "Grade":
        """Return the grade that "after" shows: that of a version, or the document's ("")."""
        return cls.of_version(document, version, frame) or cls.of(document, frame)

    def of_part(self, part: Part, proxy: tuple[float, float]) -> "Grade":
        """Return the grade of a part of the picture: windows of picks lie elsewhere in it.

        `part` is left, top, right and bottom; `proxy` is `pixels.proxy_of`.
        """
        return dataclasses.replace(self, picks=_of_part(self.picks, part, proxy))

    def recolourer(self) -> _core.Recolourer:
        """Return the exact recolouring."""
        palette = self.palette
        return _core.Recolourer(palette.rgb, palette.edited, palette.faces, picks=self.picks)


def _of_part(
    picks: _core.FramePicks | None, part: Part, proxy: tuple[float, float]
) -> _core.FramePicks | None:
    if picks is None or not any(picks.windows):
        return picks
    (x, y), (left, top, right, bottom) = proxy, part
    return picks.of_part((left / x, top / y, right / x, bottom / y))


@dataclass(frozen=True)
class Request:
    """What is to be shown.

    Attributes
    ----------
    clip : int
        Changes with the clip.
    frame, pixels
        The frame's number and its (h, w, 3 or 4) code values.
    premultiplied : bool
        Whether colours are multiplied by alpha.
    grade, before : Grade or None
        The edits after, and before (None: the source).
    region : Region
        The part and its size.
    display, look
        How code values become colours on the screen.
    against : hashable
        Changes with what `before` is.
    revision : int
        Changes with the grade.
    sides : frozenset of str
        "before", "after", or both.
    settled : bool
        Nothing moves: make the exact picture.
    matte : str or None
        A palette colour or handle whose weight is shown, or a pick whose matte is.
    pick_matte : FramePicks or None
        The matte of that pick.
    outside : bool
        Mark colours outside of the palette.
    scaled : bool
        The pixels are the region's at its coarse size, not the frame's.
    proxy : (float, float)
        Pixels of the frame for one of the palette's clip (`pixels.proxy_of`).
    """

    clip: int
    frame: int
    pixels: F32
    premultiplied: bool
    grade: Grade | None
    before: Grade | None
    region: Region
    display: Display
    look: Look
    against: Any
    revision: int
    sides: frozenset[str] = frozenset({"after"})
    settled: bool = True
    matte: str | None = None
    pick_matte: _core.FramePicks | None = None
    outside: bool = False
    scaled: bool = False
    proxy: tuple[float, float] = (1.0, 1.0)

    @property
    def key(self) -> tuple[Any, ...] | None:
        """What the picture depends on; None if it is not kept."""
        if self.matte is not None or self.outside:
            return None
        return (
            self.clip,
            self.frame,
            self.region,
            self.look,
            self.sides,
            self.against,
            self.revision,
        )


@dataclass(frozen=True)
class Picture:
    """Pictures of 8 bits, (h, w, 4), for a request.

    Attributes
    ----------
    outside : (h, w) bool or None
        Where colours are outside of the palette.
    share : float
        The share of those.
    matte : bool
        The wanted matte is shown; else its handle has no weight in this frame.
    """

    request: Request
    before: U8 | None
    after: U8 | None
    exact: bool
    outside: U8 | None = None
    share: float = 0.0
    matte: bool = False
    error: str = ""
    quick_error: float = field(default=0.0)


class _Newer(Exception):
    """A newer request waits."""


class Preview:
    """Makes pictures in a thread.

    Parameters
    ----------
    ready : callable
        Called in the preview's thread with each `Picture`.
    """

    def __init__(self, ready: Callable[[Picture], object]) -> None:
        self._tell = ready
        self._small = ByteCache[tuple[int, int, Region], F32](SMALL_BYTES)
        self._befores = ByteCache[tuple[Any, ...], U8](BEFORE_BYTES)
        self._reel = ByteCache[tuple[Any, ...], Picture](REEL_BYTES)
        self._responses = Responses()
        self._film: deque[Callable[[], Request | None]] = deque()
        self._wake = threading.Condition()
        self._waiting: Request | None = None
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="palette4d preview", daemon=True)
        self._thread.start()

    def ask(self, request: Request) -> None:
        """Make this picture next; a request that still waits is dropped."""
        with self._wake:
            self._waiting = request
            self._wake.notify()

    def roll(self, film: Iterable[Callable[[], Request | None]]) -> None:
        """Make these pictures to play, in this order, where no other picture is asked for.

        Each is a function that returns the request, called in the preview's thread.
        """
        with self._wake:
            self._film = deque(film)
            self._wake.notify()

    def kept(self, key: tuple[Any, ...] | None) -> Picture | None:
        """Return a picture that was made before (`Request.key`), or None."""
        return None if key is None else self._reel.get(key)

    def forget(self) -> None:
        """Forget the pixels that were kept."""
        self._small.clear()
        self._befores.clear()
        self._reel.clear()
        self._responses.forget()

    def close(self) -> None:
        """End the thread."""
        with self._wake:
            self._closed, self._waiting = True, None
            self._wake.notify()

    def _run(self) -> None:
        while True:
            with self._wake:
                while self._waiting is None and not self._film and not self._closed:
                    self._wake.wait()
                if self._closed:
                    return
                request, self._waiting = self._waiting, None
                scene = self._film.popleft() if request is None else None
            if request is None:
                assert scene is not None
                self._develop(scene)
                continue
            try:
                found = self.kept(request.key)
                if found is not None:
                    self._ready(dataclasses.replace(found, request=request))
                # A coarse picture first, unless the exact one takes no longer.
                elif not request.settled or request.pixels.size > 4 * STRIP:
                    self._show(self.make(request, exact=False))
                if request.settled and not (found is not None and found.exact):
                    self._show(self.make(request, exact=True, check=self._check))
            except _Newer:
                continue
            except Exception as error:  # whatever fails, the window stays and says it
                text = in_words(error) or type(error).__name__
                self._ready(Picture(request, None, None, False, error=text))

    def _develop(self, scene: Callable[[], Request | None]) -> None:
        """Make a picture to play; one that fails is dropped."""
        with contextlib.suppress(Exception):
            request = scene()
            if request is None:
                return
            self._show(self.make(request, exact=False))

    def _show(self, picture: Picture) -> None:
        """Keep a picture, unless it belongs to a drag, and tell of it."""
        request = picture.request
        key = request.key if request.settled or request.scaled else None
        if key is not None:
            sides = (picture.before, picture.after)
            size = sum(side.nbytes for side in sides if side is not None)
            # Without the frame's pixels, which are many.
            kept = dataclasses.replace(request, pixels=NO_PIXELS)
            self._reel.put(key, dataclasses.replace(picture, request=kept), size)
        self._ready(picture)

    def _ready(self, picture: Picture) -> None:
        if not self._closed:
            self._tell(picture)

    def _check(self) -> None:
        if self._waiting is not None or self._closed:
            raise _Newer

    def make(
        self, request: Request, *, exact: bool, check: Callable[[], None] = lambda: None
    ) -> Picture:
        """Make a picture now.

        Parameters
        ----------
        request : Request
            What to show.
        exact : bool
            As `palette4d render`; or recoloured at the coarse size on screen.
        check : callable
            Called now and then; may raise to stop.
        """
        painter = request.display.painter(request.look)
        before = after = None
        if "before" in request.sides:
            before = self._before(request, painter, exact, check)
        if "after" in request.sides:
            colours = self._graded(request, request.grade, exact, check)
            after = _painted(painter, colours, request.premultiplied, exact, check)
        matte = None
        if request.matte is not None and request.grade is not None and after is not None:
            source = self._source(request, exact)
            picks = _of_part(request.pick_matte, request.region.part, request.proxy)
            matte = matte_of(source, request.grade, request.matte, picks)
            if matte is not None:
                shown = _highlighted if request.pick_matte is None else _singled_out
                after = shown(after, matte)
        outside, share = None, 0.0
        if request.outside and request.grade is not None:
            outside, share = outside_of(self._source(request, exact), request.grade)
        return Picture(
            request,
            before,
            after,
            exact,
            outside,
            share,
            matte is not None,
            quick_error=painter.error,
        )

    @staticmethod
    def exact(
        pixels: F32, grade: Grade, premultiplied: bool, check: Callable[[], None] = lambda: None
    ) -> F32:
        """Return (h, w, c) pixels recoloured as `palette4d render` does, to the bit.

        What picks do is cleaned up along the picture's edges, so the pixels must be all of it.
        """
        recolourer = grade.recolourer()
        premultiplied = premultiplied and pixels.shape[2] == 4
        # Threads cost small pictures more than they gain: the window's thread works beside them.
        threads = 1 if pixels.shape[0] * pixels.shape[1] <= MOST_MOVING else 0
        if grade.picks is not None and grade.picks.count:
            check()
            return _core.draw(
                np.ascontiguousarray(pixels),
                "recoloured",
                recolourer,
                premultiplied=premultiplied,
                threads=threads,
                conversion=grade.conversion,
            )
        result = np.empty(pixels.shape, np.float32)
        rows = max(1, STRIP // pixels.shape[1])
        for top in range(0, len(pixels), rows):
            check()
            strip = np.ascontiguousarray(pixels[top : top + rows])
            result[top : top + rows] = recolourer.apply(
                strip,
                premultiplied=premultiplied,
                precision="single",
                threads=threads,
                conversion=grade.conversion,
            )
        return result

    def _graded(
        self, request: Request, grade: Grade | None, exact: bool, check: Callable[[], None]
    ) -> F32:
        """Return the region's colours with a grade."""
        if grade is None:
            return self._source(request, exact)
        cleaned = grade.picks is not None and grade.picks.count > 0  # pixels change those around
        if exact and (cleaned or not request.region.whole):
            whole = self.exact(request.pixels, grade, request.premultiplied, check)
            return resampled(whole, request.region)
        source = self._source(request, exact)
        grade = grade.of_part(request.region.part, request.proxy)
        dragged = not (exact or request.settled or request.scaled)
        if dragged and grade.conversion is None and source.shape[2] == 3:
            return self._responses.picture(source, grade)
        return self.exact(source, grade, request.premultiplied, check)

    def _source(self, request: Request, exact: bool) -> F32:
        """Return the region's pixels at its size, or at its coarse size.

        Of a first picture, nearest pixels will do.
        """
        if request.scaled:
            return request.pixels
        region = request.region if exact else request.region.coarse
        key = (request.clip, request.frame, region)
        found = self._small.get(key)
        if found is None and not exact and request.settled:
            return nearest(request.pixels, region)
        if found is None:
            found = resampled(request.pixels, region)
            self._small.put(key, found, found.nbytes)
        return found

    def _before(self, request: Request, painter: Any, exact: bool, check: Callable[[], None]) -> U8:
        key = (request.clip, request.frame, request.region, request.look, exact, request.against)
        found = self._befores.get(key)
        if found is None:
            colours = self._graded(request, request.before, exact, check)
            found = _painted(painter, colours, request.premultiplied, exact, check)
            if exact or not request.settled:  # else it is made of nearest pixels
                self._befores.put(key, found, found.nbytes)
        return found


def _painted(
    painter: Any, colours: F32, premultiplied: bool, exact: bool, check: Callable[[], None]
) -> U8:
    """Return the (h, w, 4) picture of code values, laid over black where they have alpha."""
    alpha = None
    if colours.shape[2] == 4:
        alpha = np.clip(np.nan_to_num(colours[..., 3:]), 0, 1)
        colours = _core.straight_colours(colours, premultiplied=premultiplied)
    rows = max(1, STRIP // colours.shape[1])
    if exact and painter.error and rows < len(colours):
        parts = []
        for top in range(0, len(colours), rows):
            check()
            parts.append(painter.paint(colours[top : top + rows]))
        result = np.concatenate(parts)
    else:
        result = painter.paint(colours, exact=exact)
    if alpha is not None:
        result[..., :3] = np.rint(result[..., :3] * alpha).astype(np.uint8)
    return result


def shares_of(palette: Palette, id_: str) -> NDArray[np.float64]:
    """Return how much of each palette colour a handle moves, (n,), 0..1.

    A palette colour moves with the vertices at its edge's ends; a stop or an edge is its edge.
    """
    shares = np.zeros(len(palette.ids))
    for k, (own, ends) in enumerate(zip(palette.ids, palette.ends, strict=True)):
        if id_ == own:
            shares[k] = 1
        elif id_ in ends:
            late = float(palette.weights[k])
            shares[k] = late if id_ == ends[1] else 1 - late
    return shares


def matte_of(
    colours: F32, grade: Grade, id_: str, picks: _core.FramePicks | None = None
) -> F32 | None:
    """Return the (h, w) weight of a handle or palette colour; None if it has none here.

    With `picks`, the matte of a pick (`_core.Sidecar.pick_matte_at`).
    """
    palette = grade.palette
    moved = np.array(palette.rgb)
    if picks is None:
        shares = shares_of(palette, id_)
        if not shares.any():
            return None
        # Recolouring adds weights times displacements: displaced by its shares in red, a grey
        # picture of the weights comes out. A pick's matte is added in the same way.
        moved[:, 0] += shares
    own = np.ascontiguousarray(colours[..., :3])
    if grade.conversion is not None:
        own = grade.conversion.to_palette(own).astype(np.float32)
    recolourer = _core.Recolourer(palette.rgb, moved, palette.faces, picks=picks)
    done = recolourer.apply(own, precision="single", threads=0, picture=True)
    matte: F32 = np.clip(np.nan_to_num(done[..., 0] - own[..., 0]), 0, 1)
    return matte if picks is None or matte.any() else None


def taken_share(pixels: F32, document: Document, id_: str, frame: int) -> float:
    """Return the share of a frame that a pick or hold takes there: the mean of its matte.

    Large pictures are looked at in every n-th pixel.
    """
    step = max(1, round(pixels.shape[1] / WIDTH))
    picks = document.grade.core.pick_matte_at(id_, frame)
    matte = matte_of(pixels[::step, ::step], Grade.of(document, frame), id_, picks)
    return 0.0 if matte is None else float(matte.mean())


def _highlighted(picture: U8, matte: F32) -> U8:
    """Return the picture where the matte is, and grey elsewhere."""
    weight = (matte * (1 - MATTE_SHOWS) + MATTE_SHOWS)[..., None]
    result = picture.copy()
    result[..., :3] = picture[..., :3] * weight + MATTE_GREY * (1 - weight)
    return result


def _singled_out(picture: U8, matte: F32) -> U8:
    """Return the picture where a pick acts, its dark pixels lighter; dark and grey elsewhere."""
    weight = (matte * np.float32(256)).astype(np.uint16)
    colours = picture[..., :3].astype(np.uint16)
    grey = colours @ np.array([54, 183, 19], np.uint16) >> 8  # Rec.709's luminance weights
    rest = ((grey * np.uint16(256 * REST_LIGHT) >> 8) + np.uint16(REST_LIFT)) * (256 - weight)
    lift, result = LIFT[grey], picture.copy()
    for channel in range(3):
        lit = np.minimum(colours[..., channel] + lift, 255)
        result[..., channel] = (lit * weight + rest) >> 8
    return result


def outside_of(colours: F32, grade: Grade) -> tuple[U8, float]:
    """Return where colours are more than 1/255 outside of the palette, 0 or 255, and the share.

    Large pictures are looked at in every n-th pixel.
    """
    step = max(1, int(np.ceil(np.sqrt(colours.shape[0] * colours.shape[1] / OUTSIDE_POINTS))))
    points: Any = colours[::step, ::step, :3]
    if grade.conversion is not None:
        points = grade.conversion.to_palette(points)
    flat = np.asarray(points, np.float64).reshape(-1, 3)
    _, distances = _core.palette_weights(flat, grade.palette.rgb, grade.palette.faces)
    out = (distances > 1 / 255).reshape(points.shape[:2])
    return (out * np.uint8(255)).astype(np.uint8), float(out.mean())
