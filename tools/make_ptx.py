"""Compile the GPU kernel for NVIDIA: `python tools/make_ptx.py` writes gpu/kernel/draw.ptx.

Needs NVRTC 11.8, whose PTX all drivers since 2022 read: `pip install nvidia-cuda-nvrtc-cu11`. The
file begins with the hash of what it was made from, which a test compares.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib.metadata
import sys
from pathlib import Path

KERNEL = Path(__file__).resolve().parents[1] / "ofx_plugin" / "gpu" / "kernel"
PTX = KERNEL / "draw.ptx"
#: The oldest GPUs that drivers of today know, from 2016 on.
OPTIONS = (
    "--gpu-architecture=compute_60",
    "--std=c++14",
    "--fmad=true",
    "--prec-div=false",
    "--prec-sqrt=false",
)


def source() -> str:
    """The kernel in CUDA's dialect, as CMake puts it together."""
    parts = [
        "buffers",
        "layout",
        "face",
        "palette",
        "display",
        "grids",
        "picks",
        "sampled",
        "convert",
        "colour",
        "clean_up",
        "pixel",
    ]
    frame = "".join((KERNEL / f"{part}.inc").read_text(encoding="utf-8") for part in parts)
    return (KERNEL / "cuda.cu").read_text(encoding="utf-8").replace("@P4D_FRAME@", frame)


def stamp() -> str:
    """The first line of the PTX of this source."""
    made_of = "\n".join((source(), *OPTIONS))
    return f"// sha256 of the source and options: {hashlib.sha256(made_of.encode()).hexdigest()}\n"


def nvrtc() -> ctypes.CDLL:
    """The compiler's library of the installed package."""
    package = importlib.metadata.files("nvidia-cuda-nvrtc-cu11") or []
    found = [path for path in package if path.name.startswith("libnvrtc.so")]
    if not found:
        raise SystemExit("found no NVRTC; install it: pip install nvidia-cuda-nvrtc-cu11==11.8.89")
    return ctypes.CDLL(str(found[0].locate()))


def compiled() -> str:
    """The PTX of the source."""
    library = nvrtc()
    program = ctypes.c_void_p()
    options = (ctypes.c_char_p * len(OPTIONS))(*(option.encode() for option in OPTIONS))
    text = source().encode()
    library.nvrtcCreateProgram(ctypes.byref(program), text, b"draw.cu", 0, None, None)
    failed = library.nvrtcCompileProgram(program, len(OPTIONS), options)
    size = ctypes.c_size_t()
    if failed:
        library.nvrtcGetProgramLogSize(program, ctypes.byref(size))
        log = ctypes.create_string_buffer(size.value)
        library.nvrtcGetProgramLog(program, log)
        raise SystemExit(log.value.decode())
    library.nvrtcGetPTXSize(program, ctypes.byref(size))
    ptx = ctypes.create_string_buffer(size.value)
    library.nvrtcGetPTX(program, ptx)
    return stamp() + ptx.value.decode()


if __name__ == "__main__":
    PTX.write_text(compiled(), encoding="utf-8", newline="\n")
    print(f"{PTX}: {PTX.stat().st_size} bytes", file=sys.stderr)
