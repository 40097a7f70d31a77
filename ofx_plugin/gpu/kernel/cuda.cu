/* Prelude for CUDA. */
#define P4D_FN static __device__ __forceinline__
#define P4D_STRUCT(name, body) struct name { body };
#define P4D_INT(x) ((int)(x))
#define P4D_FLOAT(x) ((float)(x))
#define P4D_TABLE const float *__restrict__ t_, const float *__restrict__ g_,
#define P4D_G(i) __ldg(g_ + (i))
#define P4D_SQRT sqrtf
#define P4D_ATAN2 atan2f
#define P4D_ABS fabsf
#define P4D_MIN fminf
#define P4D_MAX fmaxf
#define P4D_LOG2 log2f
#define P4D_EXP2 exp2f
#define P4D_POW powf
#define P4D_SOURCE const float *in_, long long row_,
#define P4D_SCRATCH float *s_,
@P4D_FRAME@
/* As in opencl.cl. */
#define P4D_ARGUMENTS                                                                              \
    const float *in, float *out, const float *table, const float *grids, float *scratch,           \
        int table_size, long long in_row, long long out_row, int width, int height, int x1,        \
        int y1, int x2, int y2

/* The table, in memory that the threads of a block share. */
static __device__ __forceinline__ const float *p4d_shared(const float *table, int table_size) {
    extern __shared__ float shared[];
    for (int i = threadIdx.x; i < table_size; i += blockDim.x) shared[i] = table[i];
    __syncthreads();
    return shared;
}

/* The passes over cells, a thread for each. */
extern "C" __global__ void p4d_cells(P4D_ARGUMENTS) {
    const float *shared = p4d_shared(table, table_size);
    int x = blockIdx.x * blockDim.x + threadIdx.x, y = blockIdx.y;
    if (x >= P4D_INT(shared[P4D_CELLS])) return;
    for (; y < P4D_INT(shared[P4D_CELLS + 1]); y += gridDim.y) {
        p4d_sum_cell(shared, grids, in, in_row, scratch, x, y);
    }
}

extern "C" __global__ void p4d_fits(P4D_ARGUMENTS) {
    int x = blockIdx.x * blockDim.x + threadIdx.x, y = blockIdx.y;
    if (x >= P4D_INT(table[P4D_CELLS])) return;
    for (; y < P4D_INT(table[P4D_CELLS + 1]); y += gridDim.y) {
        p4d_fit_cell(table, grids, scratch, x, y);
    }
}

extern "C" __global__ void p4d_means(P4D_ARGUMENTS) {
    int x = blockIdx.x * blockDim.x + threadIdx.x, y = blockIdx.y;
    if (x >= P4D_INT(table[P4D_CELLS])) return;
    for (; y < P4D_INT(table[P4D_CELLS + 1]); y += gridDim.y) {
        p4d_smooth_cell(table, grids, scratch, x, y);
    }
}

extern "C" __global__ void p4d_draw(P4D_ARGUMENTS) {
    const float *shared = p4d_shared(table, table_size);
    int x = blockIdx.x * blockDim.x + threadIdx.x, y = blockIdx.y;
    if (x >= width) return;
    for (; y < height; y += gridDim.y) {
        float *to = out + y * out_row + 4 * x;
        p4d_rgba c;
        c.r = c.g = c.b = c.a = 0.0f;
        if (x >= x1 && x < x2 && y >= y1 && y < y2) {
            const float *from = in + y * in_row + 4 * x;
            c = p4d_pixel(shared, grids, scratch, from[0], from[1], from[2], from[3], x, y);
        }
        to[0] = c.r;
        to[1] = c.g;
        to[2] = c.b;
        to[3] = c.a;
    }
}
