"""Making picks: the colour at a pixel, what its matte is learned from, and its path."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.errors import Arg, Message, Palette4dError
from palette4d.common.text import hex_of, percent
from palette4d.grade import follow, follow_window
from palette4d.grade.edits import Colour, as_colour
from palette4d.grade.follow import Progress
from palette4d.grade.grade import Grade
from palette4d.grade.mattes import Display, Learned, learn, most_frames
from palette4d.grade.picks import ALIKE, PathKey, Pick, Window
from palette4d.media.clip_base import FrameError, describe
from palette4d.media.proxy_clip import ProxyClip, is_proxy
from palette4d.media.source_clip import find_clip, nearest_frame

if TYPE_CHECKING:
    from palette4d.media.clip_base import Clip

F32 = NDArray[np.float32]
Given = str | os.PathLike[str] | None
#: Decimal places of a picked colour's code values: below a step of 16 bits.
DIGITS = 6

#: A frame whose colours differ by more than this from the analysed ones is of another clip: those
#: of one clip differ by up to 0.13, nearly all of others by more than 0.2 (docs/lab/picks.md).
OTHER_CLIP = 0.16
#: A colour of another clip is here if a connected region of this share of a frame has it.
LEAST_REGION = 5e-4
#: A box with more than this share of other colours than its main one is reported.
MIXED = 0.25
#: Distance in pick space within which two clips' colours are the same thing's.
SAME_COLOUR = 0.06

#: The advice for another clip than the palette's.
OWN_CLIP = Message(
    f"Give the palette's clip as {Arg('clip')}, or pick by {Arg('colour')} with "
    f"{Arg('follow', False)}"
)


class ClipOfPicks:
    """The clip of a sidecar, opened when it is needed.

    Attributes
    ----------
    unread : bool
        It is read later (`grade.later`): paths and mattes are not known yet.
    display : tuple or None
        `mattes.display_curve` of the palette's encoding.
    """

    unread = False
    display: Display | None = None

    def __init__(
        self,
        clip: Mapping[str, Any],
        conversion: _core.ColourConversion | None,
        sidecar: Path | None,
        given: Given = None,
    ) -> None:
        self._fields, self._conversion = clip, conversion
        self._sidecar, self._given = sidecar or Path("unsaved.p4d.json"), given
        self._read: dict[int, F32] = {}
        self._clip: Clip | None = None

    @classmethod
    def of(cls, grade: Grade, given: Given = None, file: Path | None = None) -> ClipOfPicks:
        """Return the clip of a grade, which will be in `file`, or the user's."""
        own, file = grade.analysed.conversion, file or grade.path
        clip = cls(grade.members["clip"], None if own is None else own.steps, file, given)
        clip.display = grade.display()
        return clip

    def open(self) -> Clip | None:
        """Return the clip, or None if none was given and the sidecar's clip is not there.

        A smaller copy of it is read in the size of the palette's clip, which places refer to.

        Raises
        ------
        Palette4dError
            The given clip cannot be opened, or the clip is not the sidecar's.
        """
        if self._clip is not None:
            return self._clip
        given = None if self._given is None else os.fspath(self._given)
        if (clip := find_clip(self._sidecar, self._fields, given)) is None:
            return None
        width, height = self._fields["size"]
        first, last, step = self._frames
        known = range(first, last + 1, step)
        if is_proxy(clip, width, height):
            clip = ProxyClip(clip, width, height)
        if (clip.width, clip.height) != (width, height):
            raise Palette4dError(
                f"{clip.source} has {clip.width}x{clip.height} pixels, but the palette's clip has "
                f"{width}x{height}: it is another clip.",
                OWN_CLIP,
            )
        if missing := [frame for frame in (known[0], known[-1]) if frame not in clip.frames]:
            raise Palette4dError(
                f"{clip.source} has the frames {describe(clip.frames)}, but not frame "
                f"{missing[0]} of the palette's clip ({known[0]} to {known[-1]}): it is another "
                "clip.",
                OWN_CLIP,
            )
        self._clip = clip
        return clip

    def colour(self, frame: float, pixel: tuple[float, float], box: int) -> Colour:
        """Return the main colour of a box around a pixel, in the palette's code values."""
        colours = self.box(frame, pixel, box)
        return as_colour(np.round(colours[main_colour(colours, self.display)].mean(axis=0), DIGITS))

    def alike(self, rgb: Colour, other: Colour) -> bool:
        """Whether two colours may be one thing's in two clips."""
        one, two = _core.pick_points([rgb, other], self.display)
        return bool(np.linalg.norm(one - two) < SAME_COLOUR)

    def box(self, frame: float, pixel: tuple[float, float], box: int) -> NDArray[np.float64]:
        """Return the (n, 3) colours of a box around a pixel, in the palette's code values.

        Raises
        ------
        Palette4dError
            The pixel or the frame is not there, or the box holds no colour.
        """
        clip = self.open()
        if clip is None:
            raise Palette4dError(
                f"the clip {self._fields['source']!r} is not there, so that its pixels cannot be "
                f"read; give {Arg('clip')}, or the colour itself with {Arg('colour')}"
            )
        self.check_places(frame, [pixel])
        x, y = pixel
        most = max(clip.width, clip.height)
        if not 1 <= box <= most:
            raise Palette4dError(f"found a box of {box} pixels, expected 1 to {most}")
        pixels = clip.straight_colours(clip.read(int(frame)))
        left, top = (max(0, math.floor(place) - (box - 1) // 2) for place in (x, y))
        right, bottom = (math.floor(place) + box // 2 + 1 for place in (x, y))
        colours = pixels[top:bottom, left:right].reshape(-1, 3).astype(np.float64)
        colours = colours[np.isfinite(colours).all(axis=1)]
        if not len(colours):
            raise Palette4dError(
                f"the pixel {x:g},{y:g} of frame {frame:g} has no colour: it is transparent or not "
                f"a finite number. Pick another pixel, or a larger {Arg('box')}"
            )
        return colours if self._conversion is None else self._conversion.to_palette(colours)

    def check_places(self, frame: float, pixels: Iterable[tuple[float, float]]) -> None:
        """Refuse a frame or pixels that the clip does not have; without a clip, nothing."""
        clip = self.open()
        if clip is None:
            return
        if frame not in clip.frames:
            raise Palette4dError(
                f"{clip.source} has no frame {frame:g}; expected one of {describe(clip.frames)}"
            )
        for x, y in pixels:
            if not (0 <= x < clip.width and 0 <= y < clip.height):
                raise Palette4dError(
                    f"the pixel {x:g},{y:g} lies outside the picture; expected 0,0 (top left) to "
                    f"{clip.width - 1},{clip.height - 1}"
                )

    def shows(self, frame: float) -> bool:
        """Whether a frame of the clip can be read, and has a colour."""
        try:
            return bool(np.isfinite(self.read(int(frame))).any())
        except Palette4dError:
            return False

    def read(self, frame: int) -> F32:
        """Return a frame's straight colours, (h, w, 3) in the palette's code values."""
        if frame not in self._read:
            clip = self.open()
            assert clip is not None
            colours = clip.straight_colours(clip.read(frame))
            if self._conversion is not None:
                colours = np.asarray(self._conversion.to_palette(colours), np.float32)
            self._read[frame] = np.ascontiguousarray(colours)
            if len(self._read) > most_frames(colours.size):
                del self._read[next(iter(self._read))]
        return self._read[frame]

    def learn(self, pick: Pick, holds: Sequence[Pick], display: Display | None) -> Learned | None:
        """Learn the matte of a pick or hold; None where the clip is not there."""
        clip = self.open()
        if clip is None:
            return None
        first, last, _ = self._frames
        frames = [frame for frame in clip.frames if first <= frame <= last]
        return learn(pick, holds, frames, self.read, display)

    def at_home(self, pick: Pick, display: Display | None) -> Pick | None:
        """Return a pick of another clip at the largest region here that has nearly its colour.

        None if no connected region of `LEAST_REGION` has it in the nearest frame that can be read.
        """
        from scipy import ndimage

        clip = self.open()
        assert clip is not None
        frame, pixels = self._near(pick.frame)
        real = np.asarray(np.isfinite(pixels).all(axis=2))
        colours = np.where(real[..., None], pixels, 0).reshape(-1, 3)
        off = _core.pick_points(colours, display) - _core.pick_points([pick.rgb], display)
        near = (np.linalg.norm(off, axis=1) < SAME_COLOUR).reshape(real.shape)
        alike = ndimage.binary_opening(near & real)
        if not alike.any():
            return None
        region, place, box = largest_part(alike)
        if region.mean() < LEAST_REGION:
            return None
        rgb = self.colour(frame, place, box)
        return replace(pick, frame=frame, rgb=rgb, pixel=place, box=box)

    def _near(self, frame: float) -> tuple[int, F32]:
        """Return the nearest frame of the clip that can be read, and its colours."""
        clip = self.open()
        assert clip is not None
        for near in sorted(clip.frames, key=lambda number: abs(number - frame)):
            try:
                return near, self.read(near)
            except FrameError as error:
                bad = error
        raise bad

    def warnings(self, pick: Pick, stored: Sequence[NDArray[np.float64]]) -> tuple[str, ...]:
        """Return what speaks against a pick's clip and its colour.

        `stored` are colours of the analysed clip at its times, (m, 4), and their shares.
        """
        clip = self.open()
        if clip is None:
            return ()
        frame = nearest_frame(clip, pick.frame)
        _, colours = follow.read_colours(clip, [frame], self._conversion)
        if not colours:
            return ()
        lines = []
        rgb, counts = colours[0]
        if min((_unlike(rgb, counts, rgbw) for rgbw in stored), default=0.0) > OTHER_CLIP:
            lines.append(
                f"the colours of frame {frame} of {clip.source} differ much from those that were "
                f"analysed; if it is another clip, give the analysed one as {Arg('clip')}, or "
                "analyse it"
            )
        if pick.pixel is not None:
            box = self.box(frame, pick.pixel, pick.box or 1)
            others = ~main_colour(box, self.display)
            if others.mean() > MIXED:
                lines.append(
                    f"{percent(float(others.mean()))} of the box of {pick.id} has other colours, "
                    f"such as {hex_of(np.median(box[others], axis=0).tolist())}; it has the main "
                    f"one. Pick inside of one colour, or give a smaller {Arg('box')}"
                )
        away = np.linalg.norm(rgb - pick.rgb, axis=1)
        if pick.pixel is None and away.min() > ALIKE:
            lines.append(
                f"no pixel of frame {frame} is near the colour of {pick.id}: the nearest one, "
                f"{hex_of(rgb[away.argmin()])}, is {away.min():.2f} away"
            )
        return tuple(map(Message, lines))

    @property
    def missing(self) -> bool:
        """Whether the clip cannot be read."""
        return self.open() is None

    def path(
        self, pick: Pick, given: Sequence[PathKey] = (), progress: Progress | None = None
    ) -> tuple[PathKey, ...]:
        """Follow a pick from its own colour and the given keys of its path.

        Returns those keys alone if the clip is missing, or if the range is a single frame.
        """
        span = pick.span(self._frames)
        if span[0] >= span[1] or (clip := self.open()) is None:
            return tuple(given)
        starts = [(nearest_frame(clip, pick.frame), pick.rgb)]
        others = [key for key in given if key.frame != pick.frame]
        starts += [(nearest_frame(clip, key.frame), key.rgb) for key in others]
        return follow.paths(clip, starts, span, conversion=self._conversion, progress=progress)

    def window(self, pick: Pick, window: Window, progress: Progress | None = None) -> Window:
        """Follow a window of a pick from its given keys.

        Returns it with those keys alone if the clip is missing, if there is a single frame, or if
        the box reaches across the picture: what is in it is no single thing, but near and far.
        """
        given = window.given
        span = pick.span(self._frames)
        known = {key.frame: key.box for key in given.keys}
        low, high = min(span[0], *known), max(span[1], *known)
        if low >= high or given.spans(*self._fields["size"]) or (clip := self.open()) is None:
            return given
        keys = follow_window.boxes(
            clip,
            {nearest_frame(clip, frame): box for frame, box in known.items()},
            span,
            conversion=self._conversion,
            display=self.display,
            progress=progress,
        )
        return replace(given, keys=keys)

    @property
    def _frames(self) -> tuple[int, int, int]:
        """First and last frame number of the palette's clip, and the step between frames."""
        frames = self._fields["frames"]
        return frames["first"], frames["last"], frames["step"]


def _unlike(
    rgb: NDArray[np.float64], counts: NDArray[np.float64], rgbw: NDArray[np.float64]
) -> float:
    """Return how the shares of pixels near stored colours differ from the stored shares, 0..1."""
    near = []
    for colours, shares in ((rgb, counts), (rgbw[:, :3], rgbw[:, 3])):
        square = ((colours[:, None] - rgbw[:, :3]) ** 2).sum(axis=2)
        near.append(shares / shares.sum() @ np.exp(square / (-2 * ALIKE**2)))
    return float(np.abs(near[0] - near[1]) @ rgbw[:, 3] / ((near[0] + near[1]) @ rgbw[:, 3]))


def corrected(pick: Pick, frame: float, rgb: Colour) -> Pick:
    """Return a pick whose path goes through a colour at another frame, before it is followed."""
    if frame == pick.frame:
        raise Palette4dError(
            f"{pick.id} was picked at frame {frame:g} itself, expected another frame: change its "
            f"{Arg('colour')} there"
        )
    keys = {key.frame: key for key in pick.path if key.given and key.frame != pick.frame}
    keys[frame] = PathKey(frame, rgb, True)
    return replace(pick, path=tuple(keys[f] for f in sorted(keys)))


def main_colour(colours: NDArray[np.float64], display: Display | None) -> NDArray[np.bool_]:
    """Return which of (n, 3) colours are near, in pick space, the colour that most are near."""
    points = _core.pick_points(colours, display)
    some = points[:: -(-len(points) // 1024)]
    near = ((some[:, None] - some) ** 2).sum(axis=2) < ALIKE**2
    main = some[near[near.sum(axis=1).argmax()]].mean(axis=0)
    return np.asarray(((points - main) ** 2).sum(axis=1) < (2 * ALIKE) ** 2)


def largest_part(mask: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], tuple[int, int], int]:
    """Return the largest connected part of a mask that is not empty, its middle, and a box there.

    The middle is the pixel (x, y) farthest from the part's edge. The box has at most 15 pixels.
    """
    from scipy import ndimage

    labels, _ = ndimage.label(mask)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    largest = np.asarray(labels == sizes.argmax())
    depth = ndimage.distance_transform_cdt(np.pad(largest, 1))[1:-1, 1:-1]
    row, column = np.unravel_index(int(depth.argmax()), depth.shape)
    return largest, (int(column), int(row)), int(min(2 * int(depth.max()) - 1, 15))
