// The kernel for Metal (PALETTE4D_KERNEL) as C++ of Clang, which knows its address spaces.
#include PALETTE4D_KERNEL

// Draws RGBA pixels. The source is said to lack the first and the last column.
extern "C" void draw(const float* table, const float* grids, const float* in, float* out, int width,
                     int height) {
    const p4d_window window{0, 4 * width, 0, 4 * width, width, height, 1, 0, width - 1, height};
    // As many threads as groups of 64 have.
    for (unsigned y = 0; y < static_cast<unsigned>(height); ++y) {
        for (unsigned x = 0; x < static_cast<unsigned>(width + 63) / 64 * 64; ++x) {
            p4d_draw((device const float*)in, (device float*)out, (constant const float*)table,
                     (device const float*)grids, *(constant const p4d_window*)&window, {x, y});
        }
    }
}
