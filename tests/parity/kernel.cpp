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
#define P4D_PASS t_, g_,
#define P4D_T(i) t_[i]
#define P4D_CURVES P4D_TABLE
#define P4D_C(i) P4D_G(i)
#define P4D_G(i) g_[i]
#define P4D_SQRT std::sqrt
#define P4D_ATAN2 std::atan2
#define P4D_ABS std::fabs
#define P4D_MIN std::fmin
#define P4D_MAX std::fmax
#define P4D_LOG2 std::log2
#define P4D_EXP2 std::exp2
#define P4D_POW std::pow
#include PALETTE4D_KERNEL

extern "C" void draw(const float* table, const float* grids, const float* in, float* out,
                     long pixels, int channels) {
    for (; pixels > 0; --pixels, in += channels, out += channels) {
        const p4d_rgba c =
            p4d_pixel(table, grids, in[0], in[1], in[2], channels == 4 ? in[3] : 1.0f);
        out[0] = c.r;
        out[1] = c.g;
        out[2] = c.b;
        if (channels == 4) out[3] = c.a;
    }
}
