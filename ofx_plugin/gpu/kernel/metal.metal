/* Prelude for Metal 2. */
#include <metal_stdlib>
#define P4D_FN static
#define P4D_STRUCT(name, body) struct name { body };
#define P4D_INT(x) int(x)
#define P4D_FLOAT(x) float(x)
#define P4D_TABLE constant const float *t_, device const float *g_,
#define P4D_G(i) g_[i]
#define P4D_SQRT metal::sqrt
#define P4D_ATAN2 metal::atan2
#define P4D_ABS metal::fabs
#define P4D_MIN metal::fmin
#define P4D_MAX metal::fmax
#define P4D_LOG2 metal::log2
#define P4D_EXP2 metal::exp2
#define P4D_POW metal::pow
#define P4D_SOURCE device const float *in_, int row_,
#define P4D_SCRATCH device float *s_,
@P4D_FRAME@
struct p4d_image { int in_start, in_row, out_start, out_row, width, height, x1, y1, x2, y2; };

/* As in opencl.cl. */
#define P4D_ARGUMENTS                                                                              \
    device const float *in [[buffer(0)]], device float *out [[buffer(1)]],                         \
        constant const float *table [[buffer(2)]], device const float *grids [[buffer(3)]],        \
        device float *scratch [[buffer(4)]], constant const p4d_image &w [[buffer(5)]],            \
        uint2 at [[thread_position_in_grid]]
#define P4D_IS_CELL(x, y) (x < int(table[P4D_CELLS]) && y < int(table[P4D_CELLS + 1]))

kernel void p4d_cells(P4D_ARGUMENTS) {
    int x = int(at.x), y = int(at.y);
    if (P4D_IS_CELL(x, y)) p4d_sum_cell(table, grids, in + w.in_start, w.in_row, scratch, x, y);
}

kernel void p4d_fits(P4D_ARGUMENTS) {
    int x = int(at.x), y = int(at.y);
    if (P4D_IS_CELL(x, y)) p4d_fit_cell(table, grids, scratch, x, y);
}

kernel void p4d_means(P4D_ARGUMENTS) {
    int x = int(at.x), y = int(at.y);
    if (P4D_IS_CELL(x, y)) p4d_smooth_cell(table, grids, scratch, x, y);
}

kernel void p4d_draw(P4D_ARGUMENTS) {
    int x = int(at.x), y = int(at.y);
    if (x >= w.width || y >= w.height) return;
    device float *to = out + w.out_start + y * w.out_row + 4 * x;
    p4d_rgba c;
    c.r = c.g = c.b = c.a = 0.0f;
    if (x >= w.x1 && x < w.x2 && y >= w.y1 && y < w.y2) {
        device const float *from = in + w.in_start + y * w.in_row + 4 * x;
        c = p4d_pixel(table, grids, scratch, from[0], from[1], from[2], from[3], x, y);
    }
    to[0] = c.r;
    to[1] = c.g;
    to[2] = c.b;
    to[3] = c.a;
}
