"""A proxy: a smaller copy of a clip, read in the clip's own size."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from palette4d.media.clip_base import Clip, Fill, Image


class ProxyClip(Clip):
    """A smaller copy of a clip whose frames have the clip's size: its pixels are repeated.

    Parameters
    ----------
    proxy : Clip
    width, height : int
        The clip's size in pixels.
    """

    def __init__(self, proxy: Clip, width: int, height: int) -> None:
        own = {each.name: getattr(proxy, each.name) for each in dataclasses.fields(Clip)}
        super().__init__(**{**own, "width": width, "height": height})
        self._proxy = proxy

    def load(self, frame: int) -> Image:
        """Read one frame, enlarged."""
        image = self._proxy.load(frame)
        ends = (self.height, self._proxy.height), (self.width, self._proxy.width)
        rows, columns = (np.arange(large) * small // large for large, small in ends)
        return dataclasses.replace(image, pixels=image.pixels[rows[:, None], columns])

    def file(self, frame: int) -> Path:
        """The proxy's file of a frame."""
        return self._proxy.file(frame)

    def fills(self, frames: Sequence[int]) -> Iterator[tuple[int, Fill]]:
        """Count the proxy's pixels."""
        return self._proxy.fills(frames)


def is_proxy(clip: Clip, width: int, height: int) -> bool:
    """Return whether a clip is smaller than one of this size, and of its shape but for rounding."""
    share = clip.width / width
    return share < 1 and abs(clip.height - share * height) < 2
