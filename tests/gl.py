"""OpenGL without a window (Mesa's EGL and llvmpipe), for tests: draws pixels with a shader."""

from __future__ import annotations

import ctypes
import functools
import os
from ctypes import c_char_p, c_float, c_int, c_uint, c_void_p
from typing import Any

import numpy as np
from gpu_needed import lacks
from numpy.typing import NDArray

F32 = NDArray[np.float32]

_VERTEX = b"""#version 330
void main() { gl_Position = vec4(gl_VertexID % 2 * 4 - 1, gl_VertexID / 2 * 4 - 1, 0, 1); }
"""
#: GL_TEXTURE_2D, GL_RGBA, GL_FLOAT, GL_UNSIGNED_BYTE
_FLAT, _RGBA, _FLOATS, _BYTES = 0x0DE1, 0x1908, 0x1406, 0x1401


@functools.cache
def functions() -> Any:
    """The functions of a current context of OpenGL 3.3; None where there is none."""
    os.environ.setdefault("LIBGL_ALWAYS_SOFTWARE", "1")
    try:
        egl = ctypes.CDLL("libEGL.so.1")
    except OSError:
        return None
    egl.eglGetProcAddress.restype = c_void_p
    address = egl.eglGetProcAddress(b"eglGetPlatformDisplayEXT")
    if not address:
        return None
    of_platform = ctypes.CFUNCTYPE(c_void_p, c_int, c_void_p, c_void_p)(address)
    display = c_void_p(of_platform(0x31DD, None, None))  # EGL_PLATFORM_SURFACELESS_MESA
    if not display or not egl.eglInitialize(display, None, None) or not egl.eglBindAPI(0x30A2):
        return None
    egl.eglCreateContext.restype = c_void_p
    # Version 3.3, of the core profile.
    wanted = (c_int * 7)(0x3098, 3, 0x30FB, 3, 0x30FD, 1, 0x3038)
    context = c_void_p(egl.eglCreateContext(display, None, None, wanted))
    if not context or not egl.eglMakeCurrent(display, None, None, context):
        return None

    def function(name: str, *arguments: Any, result: Any = None) -> Any:
        at = egl.eglGetProcAddress(name.encode())
        return ctypes.CFUNCTYPE(result, *(type(a) for a in arguments))(at)(*arguments)

    return function


def _texture(gl: Any, unit: int, size: tuple[int, ...], data: NDArray[Any] | None) -> c_uint:
    """Bind a new texture without filters to a unit: RGBA of float32, or of uint8."""
    texture = c_uint()
    gl("glActiveTexture", c_uint(0x84C0 + unit))
    gl("glGenTextures", c_int(1), ctypes.pointer(texture))
    gl("glBindTexture", c_uint(_FLAT), texture)
    whole = data is not None and data.dtype == np.uint8
    gl(
        "glTexImage2D",
        c_uint(_FLAT),
        c_int(0),
        c_int(0x8058 if whole else 0x8814),  # GL_RGBA8, GL_RGBA32F
        *map(c_int, size),
        c_int(0),
        c_uint(_RGBA),
        c_uint(_BYTES if whole else _FLOATS),
        c_void_p(None if data is None else data.ctypes.data),
    )
    for setting in (0x2800, 0x2801):
        gl("glTexParameteri", c_uint(_FLAT), c_uint(setting), c_int(0x2600))  # nearest
    return texture


def run(
    fragment: str, image: F32, uniforms: dict[str, float], picks: NDArray[np.uint8] | None = None
) -> F32:
    """Draw a fragment shader that reads `source` and writes `result`; skip without OpenGL.

    `image` is (n, 4) float32, a row of pixels; `picks` the (h, w, 4) texture p4d_mattes.
    """
    gl = functions()
    if gl is None:
        lacks("no OpenGL without a window (Debian: libegl1, libegl-mesa0 and libgl1-mesa-dri)")
    program = gl("glCreateProgram", result=c_uint)
    for kind, text in ((0x8B31, _VERTEX), (0x8B30, fragment.encode())):
        shader = gl("glCreateShader", c_uint(kind), result=c_uint)
        source = c_char_p(text)
        gl("glShaderSource", c_uint(shader), c_int(1), ctypes.pointer(source), c_void_p())
        gl("glCompileShader", c_uint(shader))
        gl("glAttachShader", c_uint(program), c_uint(shader))
    gl("glLinkProgram", c_uint(program))
    log = ctypes.create_string_buffer(20000)
    linked = c_int()
    gl("glGetProgramiv", c_uint(program), c_uint(0x8B82), ctypes.pointer(linked))
    if not linked.value:
        gl(
            "glGetShaderInfoLog",
            c_uint(shader),
            c_int(20000),
            c_void_p(),
            c_void_p(ctypes.addressof(log)),
        )
        raise AssertionError(log.value.decode(errors="replace"))
    gl("glUseProgram", c_uint(program))
    for name, value in uniforms.items():
        place = gl("glGetUniformLocation", c_uint(program), c_char_p(name.encode()), result=c_int)
        gl("glUniform1f", c_int(place), c_float(value))
    count = len(image)
    pixels = np.ascontiguousarray(image)
    target = _texture(gl, 0, (count, 1), None)
    _texture(gl, 0, (count, 1), pixels)
    if picks is not None:
        _texture(gl, 1, picks.shape[1::-1], np.ascontiguousarray(picks))
        place = gl("glGetUniformLocation", c_uint(program), c_char_p(b"p4d_mattes"), result=c_int)
        gl("glUniform1i", c_int(place), c_int(1))
    frame, array = c_uint(), c_uint()
    gl("glGenFramebuffers", c_int(1), ctypes.pointer(frame))
    gl("glBindFramebuffer", c_uint(0x8D40), frame)
    gl(
        "glFramebufferTexture2D",
        c_uint(0x8D40),
        c_uint(0x8CE0),
        c_uint(_FLAT),
        target,
        c_int(0),
    )
    gl("glGenVertexArrays", c_int(1), ctypes.pointer(array))
    gl("glBindVertexArray", array)
    gl("glViewport", c_int(0), c_int(0), c_int(count), c_int(1))
    gl("glDrawArrays", c_uint(4), c_int(0), c_int(3))
    result = np.empty_like(pixels)
    gl(
        "glReadPixels",
        c_int(0),
        c_int(0),
        c_int(count),
        c_int(1),
        c_uint(_RGBA),
        c_uint(_FLOATS),
        c_void_p(result.ctypes.data),
    )
    assert gl("glGetError", result=c_uint) == 0
    return result
