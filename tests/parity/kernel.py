"""The GPU kernel's text, compiled as C++, as one more implementation."""

from __future__ import annotations

import ctypes
import functools
import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from parity.implementations import Core, Document

from palette4d import _core

F32 = NDArray[np.float32]


def compiler() -> str:
    """The C++ compiler of the build."""
    return os.environ.get("CXX") or shutil.which("g++") or "c++"


@functools.cache
def library() -> ctypes.CDLL:
    """The kernel as a library; compiled once in a process."""
    with tempfile.TemporaryDirectory() as folder:
        text, made = Path(folder) / "kernel.inc", Path(folder) / "kernel.so"
        text.write_text(_core.kernel_text("frame"), encoding="utf-8")
        source = Path(__file__).with_suffix(".cpp")
        command = [
            compiler(),
            "-std=c++17",
            "-O2",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-shared",
            "-fPIC",
        ]
        subprocess.run(
            [*command, f'-DPALETTE4D_KERNEL="{text}"', source, "-o", made], check=True, timeout=120
        )
        return ctypes.CDLL(str(made))


def draw(image: F32, recolourer: _core.Recolourer, **options: Any) -> F32:
    """What the kernel draws; `options` of `_core.kernel_table`."""
    table, grids = _core.kernel_table(recolourer, **options)
    source = np.ascontiguousarray(image)
    result = np.empty_like(source)
    pixels, channels = source.size // source.shape[-1], source.shape[-1]
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in (table, grids, source, result)]
    library().draw(*pointers, ctypes.c_long(pixels), ctypes.c_int(channels))
    return result


class Kernel(Core):
    """As the compiled core, but for the pictures."""

    def __init__(self) -> None:
        super().__init__("single")
        self.name = "kernel"

    def recolour(
        self,
        image: F32,
        document: Document,
        frame: float,
        strength: float = 1.0,
        premultiplied: bool = False,
    ) -> F32:
        recolourer = self.recolourer(document, frame)
        premultiplied = premultiplied and image.shape[-1] == 4
        return draw(image, recolourer, strength=strength, premultiplied=premultiplied)


KERNEL = Kernel()
