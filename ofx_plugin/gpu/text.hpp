// The kernel's text in the dialects of GPUs, as it is compiled at run time.
#pragma once

namespace palette4d::gpu {

/// What draws a frame by its table, without a dialect's prelude.
const char* frame_text();
/// What draws any frame of a clip's palette and edits, likewise.
const char* clip_text();
/// After that, what its picks and holds do.
const char* clip_picks_text();
/// A curve by its samples, for a conversion's functions.
const char* sampled_text();
/// After both, and the conversion's functions: a colour of the picture at a frame.
const char* clip_main_text();

const char* opencl_text();
const char* metal_text();
/// Compiled from cuda.cu by tools/make_ptx.py.
const char* cuda_ptx();

}  // namespace palette4d::gpu
