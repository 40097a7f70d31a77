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
import pytest
from gpu_needed import lacks
from numpy.typing import NDArray
from parity.implementations import Core, Document

from palette4d import _core

F32 = NDArray[np.float32]


def compiler() -> str:
    """The C++ compiler of the build."""
    if os.name == "nt":
        pytest.skip("under Wine no compiler is there to build the kernel; Linux runs this")
    return os.environ.get("CXX") or shutil.which("g++") or "c++"


@functools.cache
def library(part: str = "frame") -> ctypes.CDLL:
    """The kernel as a library; compiled once in a process."""
    here = Path(__file__).parent
    command = [compiler(), "-std=c++17", "-Wextra", here / "kernel.cpp"]
    if part == "metal":
        clang = shutil.which("clang++") or lacks("no clang++ (Debian: clang)")
        # Metal is C++14, and has attributes of its own.
        command = [clang, "-std=c++14", "-Wno-unknown-attributes", f"-I{here}"]
        command.append(here / "kernel_metal.cpp")
    with tempfile.TemporaryDirectory() as folder:
        text, made = Path(folder) / "kernel.inc", Path(folder) / "kernel.so"
        text.write_text(_core.kernel_text(part), encoding="utf-8")
        command += ["-O2", "-Wall", "-Werror", "-shared", "-fPIC", f'-DPALETTE4D_KERNEL="{text}"']
        subprocess.run([*command, "-o", made], check=True, timeout=120)
        return ctypes.CDLL(str(made))


def draw(image: F32, recolourer: _core.Recolourer, part: str = "frame", **options: Any) -> F32:
    """What the kernel draws; `options` of `_core.kernel_table`."""
    height, width, channels = image.shape
    table, grids = _core.kernel_table(recolourer, size=(height, width), **options)
    source = np.ones((height, width, 4), np.float32)
    source[..., :channels] = image[::-1]
    result = np.empty_like(source)
    # 42 planes of cells of 2 x 2 pixels, or larger ones.
    scratch = np.full(42 * (-(-height // 2)) * (-(-width // 2)), np.nan, np.float32)
    arrays = table, grids, scratch, source, result
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in arrays]
    library(part).draw(*pointers, ctypes.c_int(width), ctypes.c_int(height))
    return np.ascontiguousarray(result[::-1, :, :channels])


def draw_by_metal(image: F32, recolourer: _core.Recolourer, **options: Any) -> F32:
    """What the kernel for Metal draws; the source lacks the first and the last column."""
    return draw(image, recolourer, "metal", **options)


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
