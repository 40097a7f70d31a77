"""OpenCL on this machine's processor (pocl), for tests: runs a kernel on arrays of float32."""

from __future__ import annotations

import ctypes
import functools
from ctypes import byref, c_char_p, c_int, c_size_t, c_uint, c_ulong, c_void_p

import numpy as np
from gpu_needed import lacks
from numpy.typing import NDArray

F32 = NDArray[np.float32]


@functools.cache
def system() -> tuple[ctypes.CDLL, c_void_p, c_void_p, c_void_p] | None:
    """The library, a device, its context and a queue; None where there is none."""
    try:
        cl = ctypes.CDLL("libOpenCL.so.1")
    except OSError:
        return None
    for name in ("clCreateContext", "clCreateCommandQueue", "clCreateBuffer", "clCreateKernel"):
        getattr(cl, name).restype = c_void_p
    cl.clCreateProgramWithSource.restype = c_void_p
    platforms, count, device, error = (c_void_p * 8)(), c_uint(), c_void_p(), c_int()
    if cl.clGetPlatformIDs(8, platforms, byref(count)):
        return None
    for platform in platforms[: count.value]:
        if cl.clGetDeviceIDs(c_void_p(platform), c_ulong(0xFFFFFFFF), 1, byref(device), None) == 0:
            context = c_void_p(cl.clCreateContext(None, 1, byref(device), None, None, byref(error)))
            queue = c_void_p(cl.clCreateCommandQueue(context, device, c_ulong(0), byref(error)))
            return cl, device, context, queue
    return None


def run(source: str, name: str, options: str, image: F32) -> F32:
    """Run the kernel `name` (in, out), a work item for each row of `image`; skip without OpenCL."""
    found = system()
    if found is None:
        lacks("no OpenCL on this machine (Debian: pocl-opencl-icd and ocl-icd-libopencl1)")
    cl, device, context, queue = found
    error, text = c_int(), c_char_p(source.encode())
    program = c_void_p(cl.clCreateProgramWithSource(context, 1, byref(text), None, byref(error)))
    if cl.clBuildProgram(program, 1, byref(device), options.encode(), None, None):
        log = ctypes.create_string_buffer(20000)
        cl.clGetProgramBuildInfo(program, device, 0x1183, c_size_t(20000), log, None)
        raise AssertionError(log.value.decode(errors="replace"))
    kernel = c_void_p(cl.clCreateKernel(program, name.encode(), byref(error)))
    result, source_image = np.empty_like(image), np.ascontiguousarray(image)
    buffers = []
    for array in (source_image, result):
        flags, size = c_ulong(1 | 32), c_size_t(array.nbytes)  # read and write, copied
        data = c_void_p(array.ctypes.data)
        buffers.append(c_void_p(cl.clCreateBuffer(context, flags, size, data, byref(error))))
    for i, buffer in enumerate(buffers):
        assert cl.clSetKernelArg(kernel, i, c_size_t(8), byref(buffer)) == 0
    items = c_size_t(len(image))
    assert cl.clEnqueueNDRangeKernel(queue, kernel, 1, None, byref(items), None, 0, None, None) == 0
    size, data = c_size_t(result.nbytes), c_void_p(result.ctypes.data)
    assert cl.clEnqueueReadBuffer(queue, buffers[1], 1, c_size_t(0), size, data, 0, None, None) == 0
    for buffer in buffers:
        cl.clReleaseMemObject(buffer)
    cl.clReleaseKernel(kernel)
    cl.clReleaseProgram(program)
    return result
