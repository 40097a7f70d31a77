// The GPU kernel's text as C++, and a function that draws an image with it. The text stands in
// PALETTE4D_KERNEL.
#include <cmath>

#define P4D_FN static
#define P4D_STRUCT(name, body) \
    struct name {              \
        body                   \
    };
#define P4D_INT(x) static_cast<int>(x)
#define P4D_FLOAT(x) static_cast<float>(x)
#define P4D_TABLE [[maybe_unused]] const float *t_, [[maybe_unused]] const float *g_,
#define P4D_G(i) g_[i]
#define P4D_SQRT std::sqrt
#define P4D_ATAN2 std::atan2
#define P4D_ABS std::fabs
#define P4D_MIN std::fmin
#define P4D_MAX std::fmax
#define P4D_LOG2 std::log2
#define P4D_EXP2 std::exp2
#define P4D_POW std::pow
#define P4D_SOURCE const float *in_, int row_,
#define P4D_SCRATCH [[maybe_unused]] float *s_,
#include PALETTE4D_KERNEL

/// An image of RGBA pixels; `scratch` has room for the planes of the table's cells.
extern "C" void draw(const float* table, const float* grids, float* scratch, const float* in,
                     float* out, int width, int height) {
    const int columns = static_cast<int>(table[P4D_CELLS]);
    const int rows = static_cast<int>(table[P4D_CELLS + 1]), row = 4 * width;
    for (int i = 0; i < columns * rows; ++i) {
        p4d_sum_cell(table, grids, in, row, scratch, i % columns, i / columns);
    }
    for (int i = 0; i < columns * rows; ++i) {
        p4d_fit_cell(table, grids, scratch, i % columns, i / columns);
    }
    for (int i = 0; i < columns * rows; ++i) {
        p4d_smooth_cell(table, grids, scratch, i % columns, i / columns);
    }
    for (int i = 0; i < width * height; ++i, in += 4, out += 4) {
        const p4d_rgba c =
            p4d_pixel(table, grids, scratch, in[0], in[1], in[2], in[3], i % width, i / width);
        out[0] = c.r;
        out[1] = c.g;
        out[2] = c.b;
        out[3] = c.a;
    }
}
