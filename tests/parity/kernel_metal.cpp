// The kernel for Metal (PALETTE4D_KERNEL) as C++ of Clang, which knows its address spaces.
#include <initializer_list>

#include PALETTE4D_KERNEL

// Draws RGBA pixels. The source is said to lack the first and the last column.
extern "C" void draw(const float* table, const float* grids, float* scratch, const float* in,
                     float* out, int width, int height) {
    const p4d_image image{0, 4 * width, 0, 4 * width, width, height, 1, 0, width - 1, height};
    for (const auto pass : {&p4d_cells, &p4d_fits, &p4d_means, &p4d_draw}) {
        // As many threads as groups of 64 have.
        for (unsigned y = 0; y < static_cast<unsigned>(height); ++y) {
            for (unsigned x = 0; x < static_cast<unsigned>(width + 63) / 64 * 64; ++x) {
                pass((device const float*)in, (device float*)out, (constant const float*)table,
                     (device const float*)grids, (device float*)scratch,
                     *(constant const p4d_image*)&image, {x, y});
            }
        }
    }
}
