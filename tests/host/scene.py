"""A clip as numbered pictures, and melt to render it through the node."""

from __future__ import annotations

import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from palette4d import _core
from palette4d.media.frame_writer import quantised

SERVICE = "openfx.org.palette4d.Palette4D"
RATE = 25  # melt's own idea of the rate of numbered pictures
Image = NDArray[Any]  # (h, w, 3 or 4) uint8 or uint16


def write_image(path: Path, image: Image) -> None:
    spec = oiio.ImageSpec(image.shape[1], image.shape[0], image.shape[2], str(image.dtype))
    spec.attribute("png:compressionLevel", 1)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec)
    assert output.write_image(np.ascontiguousarray(image))
    assert output.close()


def read_image(path: Path) -> Image:
    hint = oiio.ImageSpec()
    hint.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), hint)
    assert source, f"{path}: {oiio.geterror()}"
    image = np.asarray(source.read_image(str(source.spec().format)))
    source.close()
    return image


def recolour(
    sidecar: _core.Sidecar, frame: float, image: Image, strength: float = 1.0
) -> NDArray[np.float32]:
    """What the core makes of a frame, clamped to 0..1 as files of integers are."""
    cut = _core.slice_at(sidecar.polytope, frame)
    edited = _core.edited_colours(sidecar.polytope, sidecar.edits, cut)
    picks = sidecar.picks_at(cut.frame)
    recolourer = _core.Recolourer(cut.rgb, edited, cut.faces, picks=picks)
    top = np.float32(np.iinfo(image.dtype).max)
    values = image.astype(np.float32) / top
    return np.clip(_core.draw(values, "recoloured", recolourer, strength=strength), 0, 1)


# Seconds until the first frame, twice as long at each new try, and until the last.
FIRST_FRAME, WHOLE_CLIP = 5.0, 300.0


def run_until_it_writes(
    command: Sequence[str],
    folder: Path,
    environment: dict[str, str],
    written: Callable[[], object],
) -> tuple[str, int]:
    """What melt said, and the KiB of memory that it took at most; asked again where it must be.

    On a busy machine melt 7.42, with or without an effect, now and then (2 of 100 runs) ends
    without a word before its first frame, or waits for ever instead (1 of 100), its rendering
    threads gone already. A render that stops midway, after its first frame, fails the test.
    """
    for attempt in range(5):
        patience = FIRST_FRAME * 2**attempt
        said, status, memory = _run_once(command, folder, environment, written, patience)
        assert status in (0, None), f"melt ended with {status}: {said}"
        if written():
            assert status == 0, f"melt did not end within {WHOLE_CLIP:g} s: {said}"
            return said, memory
    raise AssertionError(f"melt wrote nothing, five times: {said}")


def _run_once(
    command: Sequence[str],
    folder: Path,
    environment: dict[str, str],
    written: Callable[[], object],
    patience: float,
) -> tuple[str, int | None, int]:
    """What a program said, its exit status (None: it was killed) and its most KiB of memory."""
    with tempfile.TemporaryFile() as output:
        program = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            cwd=folder,
            env={**os.environ, **environment},
        )
        started = time.monotonic()
        killed = False
        while True:
            # wait4, and not Popen's own: it tells the memory of this program alone.
            ended, status, used = os.wait4(program.pid, os.WNOHANG)
            if ended:
                break
            elapsed = time.monotonic() - started
            if not killed and elapsed > (WHOLE_CLIP if written() else patience):
                program.kill()
                killed = True
            time.sleep(0.02)
        program.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        said = output.read().decode(errors="replace")
    return said, None if killed else program.returncode, int(used.ru_maxrss)


@dataclass
class Scene:
    """A clip as numbered pictures, and melt to render it through the node."""

    melt: Path
    plugins: Path
    folder: Path
    clip: list[Image]

    def __post_init__(self) -> None:
        height, width = self.clip[0].shape[:2]
        self.folder.mkdir(parents=True)
        for index, image in enumerate(self.clip):
            write_image(self.folder / f"in_{index:03d}.png", image)
        profile = {
            "description": "test",
            "frame_rate_num": RATE,
            "frame_rate_den": 1,
            "width": width,
            "height": height,
            "progressive": 1,
            "sample_aspect_num": 1,
            "sample_aspect_den": 1,
            "display_aspect_num": width,
            "display_aspect_den": height,
            "colorspace": 709,
        }
        lines = [f"{key}={value}\n" for key, value in profile.items()]
        (self.folder / "profile").write_text("".join(lines))

    def run(self, *words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [str(self.melt), *words],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            cwd=self.folder,
            env={**os.environ, "OFX_PLUGIN_PATH": str(self.plugins)},
            timeout=300,
            check=True,
        )

    def write(
        self, pattern: str, *words: str, folder: Path | None = None, **environment: str
    ) -> tuple[list[Path], str]:
        """The files that melt writes into a folder (the scene's), and what it said meanwhile."""
        folder = folder or self.folder

        def written() -> list[Path]:
            # A movie's file is there, and empty, before its first frame.
            return sorted(path for path in folder.glob(pattern) if path.stat().st_size)

        for old in folder.glob(pattern):
            old.unlink()
        environment = {"OFX_PLUGIN_PATH": str(self.plugins), **environment}
        said, _ = run_until_it_writes([str(self.melt), *words], folder, environment, written)
        return written(), said

    def render(
        self, effect: str = SERVICE, *, real_time: int = -1, **parameters: object
    ) -> tuple[list[Image], str]:
        """The clip through an effect, at its own depth, and what melt said meanwhile."""
        image_format = "rgba" if self.clip[0].dtype == np.uint8 else "rgba64"
        pixels = "rgba" if image_format == "rgba" else "rgba64be"
        files, said = self.write(
            "out_*.png",
            # abnormal: without the loader's normalisers, which take pictures through 4:2:2.
            # Not -quiet: it would keep the persistent messages to itself.
            *("-profile", "profile", "abnormal:in_%03d.png", "-attach", effect),
            *(f"{name}={value}" for name, value in parameters.items()),
            *("-consumer", "avformat:out_%03d.png", "vcodec=png", "an=1", f"pix_fmt={pixels}"),
            *(f"mlt_image_format={image_format}", f"real_time={real_time}"),
        )
        assert len(files) == len(self.clip), said
        return [read_image(path) for path in files], said

    def unchanged(self, frames: list[Image]) -> bool:
        """Whether every frame came through bit for bit."""
        return all(
            np.array_equal(frame[..., :3], image[..., :3])
            for frame, image in zip(frames, self.clip, strict=True)
        )

    def check(
        self,
        frames: list[Image],
        sidecar: _core.Sidecar,
        *,
        strength: Sequence[float] | None = None,
        offset: float = 0.0,
    ) -> None:
        """Every frame is the core's, rounded to its depth, and not the source's."""
        first = float(sidecar.clip["first"])
        expected = []
        for index, image in enumerate(self.clip):
            s = 1.0 if strength is None else strength[index]
            expected.append(recolour(sidecar, first + index + offset, image[..., :3], s))
        self.check_against(frames, expected)

    def check_against(self, frames: list[Image], expected: Iterable[NDArray[np.float32]]) -> None:
        """Every frame is the expected one, (h, w, 3) within 0..1, rounded to its depth, and
        together they are not the source."""
        top = float(np.iinfo(self.clip[0].dtype).max)
        # Bytes are rounded by the node itself, and are those that `palette4d render` writes; floats
        # are rounded by the host, which computes in float32.
        limit = 0.51
        changed = 0.0
        together = zip(frames, self.clip, expected, strict=True)
        for index, (frame, image, wanted) in enumerate(together):
            error = np.abs(frame[..., :3].astype(np.float64) - wanted.astype(np.float64) * top)
            assert error.max() <= limit, f"frame {index}: off by {error.max()} of {top}"
            if top == 255:
                assert np.array_equal(frame[..., :3], quantised(wanted, "uint8")), f"frame {index}"
            assert np.all(frame[..., 3] == top), f"frame {index}: its alpha changed"
            changed += float(np.abs(wanted - image[..., :3] / top).mean())
        assert changed / len(frames) > 0.005, "the edit changed next to nothing"
