/* Prelude for OpenCL C 1.1. */
#pragma OPENCL FP_CONTRACT ON
#define P4D_FN static
#define P4D_STRUCT(name, body) typedef struct { body } name;
#define P4D_INT(x) ((int)(x))
#define P4D_FLOAT(x) ((float)(x))
#define P4D_TABLE __constant const float *t_, __global const float *g_,
#define P4D_G(i) g_[i]
#define P4D_SQRT sqrt
#define P4D_ATAN2 atan2
#define P4D_ABS fabs
#define P4D_MIN fmin
#define P4D_MAX fmax
#define P4D_LOG2 log2
#define P4D_EXP2 exp2
#define P4D_POW pow
#define P4D_SOURCE __global const float *in_, int row_,
#define P4D_SCRATCH __global float *s_,
@P4D_FRAME@
/* All kernels take the same. A window of RGBA pixels: its pixel (x, y) is at `*_start` + y * `*_row` +
   4 x, in floats; the source covers [x1, x2) x [y1, y2) of it. */
#define P4D_ARGUMENTS                                                                              \
    __global const float *in, __global float *out, __constant const float *table,                  \
        __global const float *grids, __global float *scratch, int in_start, int in_row,            \
        int out_start, int out_row, int width, int height, int x1, int y1, int x2, int y2

/* The passes before a picture that is cleaned up: a work item for each cell. */
#define P4D_IS_CELL(x, y) (x < (int)table[P4D_CELLS] && y < (int)table[P4D_CELLS + 1])

__kernel void p4d_cells(P4D_ARGUMENTS) {
    int x = (int)get_global_id(0), y = (int)get_global_id(1);
    if (P4D_IS_CELL(x, y)) p4d_sum_cell(table, grids, in + in_start, in_row, scratch, x, y);
}

__kernel void p4d_fits(P4D_ARGUMENTS) {
    int x = (int)get_global_id(0), y = (int)get_global_id(1);
    if (P4D_IS_CELL(x, y)) p4d_fit_cell(table, grids, scratch, x, y);
}

__kernel void p4d_means(P4D_ARGUMENTS) {
    int x = (int)get_global_id(0), y = (int)get_global_id(1);
    if (P4D_IS_CELL(x, y)) p4d_smooth_cell(table, grids, scratch, x, y);
}

/* Draws the window. Where there is no source it becomes transparent black. */
__kernel void p4d_draw(P4D_ARGUMENTS) {
    int x = (int)get_global_id(0), y = (int)get_global_id(1);
    if (x >= width || y >= height) return;
    float4 to = (float4)(0.0f, 0.0f, 0.0f, 0.0f);
    if (x >= x1 && x < x2 && y >= y1 && y < y2) {
        float4 from = vload4(0, in + in_start + y * in_row + 4 * x);
        p4d_rgba c = p4d_pixel(table, grids, scratch, from.x, from.y, from.z, from.w, x, y);
        to = (float4)(c.r, c.g, c.b, c.a);
    }
    vstore4(to, 0, out + out_start + y * out_row + 4 * x);
}
