// What DCTL's documentation promises, for a C++ compiler: draws float32 RGB colours at a frame with
// the file PALETTE4D_DCTL.
#include <cmath>

#define __DEVICE__ static
#define __CONSTANT__ static const
struct float3 {
    float x, y, z;
};
static float3 make_float3(float x, float y, float z) { return {x, y, z}; }
static float _fabs(float x) { return std::fabs(x); }
static float _sqrtf(float x) { return std::sqrt(x); }
static float _atan2f(float y, float x) { return std::atan2(y, x); }
static float _fminf(float x, float y) { return std::fmin(x, y); }
static float _fmaxf(float x, float y) { return std::fmax(x, y); }
inline float _log2f(float x) { return std::log2(x); }
inline float _exp2f(float x) { return std::exp2(x); }
inline float _powf(float x, float y) { return std::pow(x, y); }
static int TIMELINE_FRAME_INDEX = 0;
#define FIRST_OF(value, ...) value
#define DCTLUI_SLIDER_FLOAT float
#define DCTLUI_VALUE_BOX int
#define DEFINE_UI_PARAMS(name, label, kind, ...) static kind name = FIRST_OF(__VA_ARGS__, 0);
#include PALETTE4D_DCTL

extern "C" void draw(int timeline_frame, float strength, int offset, const float* in, float* out,
                     long pixels) {
    TIMELINE_FRAME_INDEX = timeline_frame;
    p4d_strength = strength;
    p4d_offset += offset;
    for (long i = 0; i < 3 * pixels; i += 3) {
        const float3 to = transform(1, 1, 0, 0, in[i], in[i + 1], in[i + 2]);
        out[i] = to.x;
        out[i + 1] = to.y;
        out[i + 2] = to.z;
    }
    p4d_offset -= offset;
}
