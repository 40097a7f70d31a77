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


def run(fragment: str, image: F32, uniforms: dict[str, float]) -> F32:
    """Draw a fragment shader that reads `source` and writes `result`; skip without OpenGL.

    `image` is (n, 4) float32, a row of pixels.
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
    textures = (c_uint * 2)()
    gl("glGenTextures", c_int(2), c_void_p(ctypes.addressof(textures)))
    kind, rgba32f, rgba, floats = c_uint(0x0DE1), c_int(0x8814), c_uint(0x1908), c_uint(0x1406)
    for texture, data in zip(textures, (None, pixels.ctypes.data), strict=True):
        gl("glBindTexture", kind, c_uint(texture))
        gl(
            "glTexImage2D",
            kind,
            c_int(0),
            rgba32f,
            c_int(count),
            c_int(1),
            c_int(0),
            rgba,
            floats,
            c_void_p(data),
        )
        for setting in (0x2800, 0x2801):
            gl("glTexParameteri", kind, c_uint(setting), c_int(0x2600))  # nearest
    frame, array = c_uint(), c_uint()
    gl("glGenFramebuffers", c_int(1), ctypes.pointer(frame))
    gl("glBindFramebuffer", c_uint(0x8D40), frame)
    gl(
        "glFramebufferTexture2D",
        c_uint(0x8D40),
        c_uint(0x8CE0),
        kind,
        c_uint(textures[0]),
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
        rgba,
        floats,
        c_void_p(result.ctypes.data),
    )
    assert gl("glGetError", result=c_uint) == 0
    return result
