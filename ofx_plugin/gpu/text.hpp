// The kernel's text in the dialects of GPUs, as it is compiled at run time.
#pragma once

namespace palette4d::gpu {

/// The parts, without a dialect's prelude.
const char* layout_text();
const char* face_text();
/// layout, face, palette, picks and pixel: all that a frame's table needs.
const char* frame_text();

const char* opencl_text();
const char* cuda_text();

}  // namespace palette4d::gpu
