#include "recolour/frame_picks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace palette4d {
namespace {

/// The membership at which a matte without softness has its step, and by how much it begins before
/// and is whole after it at softness 1. It never begins below kLeast.
constexpr double kFirm = 0.4, kSoft = 1 - kFirm, kLeast = 0.02;
/// Width of the soft ends of a pick's range of lightness.
constexpr double kLightnessEnd = 0.1;

struct Held {
    Vec3 point;
    double strength;
    FrameMatte matte;
    bool learned;
};

/// Sets the nodes around a point.
void set_around(FrameMatte& matte, const Vec3& point, float value) {
    const MatteGrid::Place p = MatteGrid::place(point);
    for (int corner = 0; corner < 8; ++corner) {
        matte[MatteGrid::index(p.u + (corner >> 2), p.v + (corner >> 1 & 1), p.l + (corner & 1))] =
            value;
    }
}

/// A pick's matte where it was picked, for all lightnesses.
FrameMatte still_values(const Pick& pick) {
    float values[2 * Matte::kMiddle + 1];
    const double half = std::max(kSoft * pick.softness, 1e-3);
    const double low = std::max(kFirm - half, kLeast), high = kFirm + half;
    for (int i = 0; i <= 2 * Matte::kMiddle; ++i) {
        const double odds = Matte::log_odds(static_cast<std::uint8_t>(i)) + pick.reach;
        const double membership = i == 0 ? 0.0 : 1 / (1 + std::exp(-odds));
        double value = smooth_step(membership, low, high);
        if (pick.levels > 1) value = std::round(value * (pick.levels - 1)) / (pick.levels - 1);
        values[i] = static_cast<float>(value);
    }
    FrameMatte still(MatteGrid::kSize);
    const std::vector<std::uint8_t>& odds = pick.taken().odds;
    for (std::size_t i = 0; i < still.size(); ++i) still[i] = values[odds[i]];
    return still;
}

/// How much of the matte a pick's range of lightness takes.
std::array<float, MatteGrid::kLightnesses> lightness_shares(const Pick& pick) {
    std::array<float, MatteGrid::kLightnesses> shares{};
    for (int l = 0; l < MatteGrid::kLightnesses; ++l) {
        const double at = l / MatteGrid::kPerLightness;
        double in = 1;
        if (pick.darkest > 0) {
            in = smooth_step(at, pick.darkest - kLightnessEnd, pick.darkest);
        }
        if (pick.lightest < 1) {
            in *= 1 - smooth_step(at, pick.lightest, pick.lightest + kLightnessEnd);
        }
        shares[static_cast<std::size_t>(l)] = static_cast<float>(in);
    }
    return shares;
}

/// A pick's matte at a frame, without holds.
FrameMatte baked(const Pick& pick, const Vec3& from, const Vec3& to) {
    FrameMatte still = still_values(pick);
    const Vec3 away = to - from;
    if (pick_distance2(to, from) > 1e-10) {
        FrameMatte moved(MatteGrid::kSize);
        std::size_t at = 0;
        for (int u = 0; u < MatteGrid::kSaturations; ++u) {
            for (int v = 0; v < MatteGrid::kSaturations; ++v) {
                for (int l = 0; l < MatteGrid::kLightnesses; ++l, ++at) {
                    const Vec3 node = MatteGrid::point(u, v, l);
                    const double along = nearness(node, to);
                    moved[at] =
                        along == 0
                            ? still[at]
                            : static_cast<float>(MatteGrid::at(still.data(), node - along * away));
                }
            }
        }
        still.swap(moved);
    }
    // The picked colour itself is the thing's.
    set_around(still, to, 1);
    if (pick.darkest > 0 || pick.lightest < 1) {
        const auto shares = lightness_shares(pick);
        for (std::size_t l = 0; l < shares.size(); ++l) {
            for (std::size_t i = l; i < still.size(); i += MatteGrid::kLightnesses) {
                still[i] *= shares[l];
            }
        }
    }
    return still;
}

void hold_back(FrameMatte& matte, const Vec3& pick, const std::vector<Held>& holds) {
    if (holds.empty()) return;
    const MatteGrid::Place p = MatteGrid::place(pick);
    std::size_t at = 0;
    for (int u = 0; u < MatteGrid::kSaturations; ++u) {
        for (int v = 0; v < MatteGrid::kSaturations; ++v) {
            for (int l = 0; l < MatteGrid::kLightnesses; ++l, ++at) {
                if (matte[at] == 0) continue;
                const Vec3 node = MatteGrid::point(u, v, l);
                // The picked colour itself is the thing's, whatever a hold has learned.
                const bool own = (u == p.u || u == p.u + 1) && (v == p.v || v == p.v + 1) &&
                                 (l == p.l || l == p.l + 1);
                double left = 1;
                for (const Held& hold : holds) {
                    const double kept = own || !hold.learned ? 1 - spared(node, hold.point, pick)
                                                             : static_cast<double>(hold.matte[at]);
                    left *= 1 - hold.strength * kept;
                }
                matte[at] *= static_cast<float>(left);
            }
        }
    }
}

struct Moment {
    const Pick* pick;
    Vec3 colour, point;  ///< at the frame
    Vec3 first;          ///< the point where it was picked
    double strength;
};

std::vector<Moment> moments(const Edits& edits, double frame, bool hold) {
    std::vector<Moment> result;
    for (const Pick& pick : edits.picks) {
        if (!pick.enabled || pick.hold != hold) continue;
        const double strength = pick.strength_at(frame);
        if (!(strength > 0)) continue;
        const Vec3 colour = pick.colour_at(frame);
        const DisplayCurve* const curve = edits.display.get();
        result.push_back({&pick, colour, pick_point(displayed(colour, curve)),
                          pick_point(displayed(pick.rgb, curve)), strength});
    }
    return result;
}

FramePick frame_pick(const Moment& moment, const std::vector<Held>& holds, double frame) {
    FrameMatte matte = baked(*moment.pick, moment.first, moment.point);
    hold_back(matte, moment.point, holds);
    std::optional<FrameWindow> window;
    if (moment.pick->window) window.emplace(*moment.pick->window, frame);
    return {moment.colour, moment.pick->change_at(frame), moment.strength,
            std::make_shared<const FrameMatte>(std::move(matte)), window};
}

/// Without picks.
FramePicks none_of(const Edits& edits) {
    FramePicks picks;
    picks.display = edits.display;
    picks.width = edits.width;
    picks.height = edits.height;
    picks.lines = edits.height;
    return picks;
}

std::vector<Held> held_at(const std::vector<Moment>& holds) {
    std::vector<Held> held;
    for (const Moment& hold : holds) {
        held.push_back({hold.point, hold.strength, baked(*hold.pick, hold.first, hold.point),
                        hold.pick->matte != nullptr});
    }
    return held;
}

}  // namespace

bool FramePicks::windows() const {
    return std::any_of(picks.begin(), picks.end(),
                       [](const FramePick& pick) { return pick.window.has_value(); });
}

std::size_t FramePicks::bytes() const {
    std::size_t sum = vector_bytes(picks);
    for (const FramePick& pick : picks) sum += vector_bytes(*pick.matte);
    return left ? sum + vector_bytes(*left) : sum;
}

FramePicks picks_at(const Edits& edits, double frame) {
    FramePicks result = none_of(edits);
    const std::vector<Held> held = held_at(moments(edits, frame, true));
    if (!held.empty()) {
        FrameMatte left(MatteGrid::kSize, 1.0f);
        for (const Held& hold : held) {
            const auto strength = static_cast<float>(hold.strength);
            for (std::size_t i = 0; i < left.size(); ++i) left[i] *= 1 - strength * hold.matte[i];
        }
        result.left = std::make_shared<const FrameMatte>(std::move(left));
    }
    for (const Moment& pick : moments(edits, frame, false)) {
        result.picks.push_back(frame_pick(pick, held, frame));
    }
    return result;
}

FramePicks matte_at(const Edits& edits, const std::string& id, double frame) {
    FramePicks result = none_of(edits);
    for (const bool hold : {false, true}) {
        for (const Moment& moment : moments(edits, frame, hold)) {
            if (moment.pick->id != id) continue;
            const std::vector<Held> held =
                hold ? std::vector<Held>() : held_at(moments(edits, frame, true));
            result.picks.push_back(frame_pick(moment, held, frame));
            result.picks.back().change = {1, 1, 1};
            result.picks.back().is_matte = true;
        }
    }
    return result;
}

StillMatte still_matte(const Edits& edits, const Pick& pick) {
    return {still_values(pick), lightness_shares(pick),
            pick_point(displayed(pick.rgb, edits.display.get())), pick.matte != nullptr};
}

std::vector<PickMoment> pick_moments(const Edits& edits, double frame) {
    std::vector<PickMoment> result;
    for (const bool hold : {false, true}) {
        for (const Moment& moment : moments(edits, frame, hold)) {
            const auto index = static_cast<std::size_t>(moment.pick - edits.picks.data());
            result.push_back({index, moment.point, moment.strength});
        }
    }
    return result;
}

namespace {

/// The first and last nodes, by axis, whose values are not `idle`; in no order without such.
struct Extent {
    int first[3] = {MatteGrid::kSaturations, MatteGrid::kSaturations, MatteGrid::kLightnesses};
    int last[3] = {-1, -1, -1};

    Extent(const FrameMatte& matte, float idle) {
        const auto add = [&](int axis, int node) {
            first[axis] = std::min(first[axis], node);
            last[axis] = std::max(last[axis], node);
        };
        const float* line = matte.data();
        for (int u = 0; u < MatteGrid::kSaturations; ++u) {
            for (int v = 0; v < MatteGrid::kSaturations; ++v, line += MatteGrid::kLightnesses) {
                bool some = false;
                for (int l = 0; l < MatteGrid::kLightnesses; ++l) some |= line[l] != idle;
                if (!some) continue;
                add(0, u);
                add(1, v);
                for (int l = 0; l < MatteGrid::kLightnesses; ++l) {
                    if (line[l] != idle) add(2, l);
                }
            }
        }
    }
    bool empty() const { return last[0] < 0; }
};

constexpr int kNodes[3] = {MatteGrid::kSaturations, MatteGrid::kSaturations,
                           MatteGrid::kLightnesses};

/// A node's value reaches to its neighbours, and beyond the grid without end.
template <class T>
void set_bounds(const Extent& extent, typename PickPlan<T>::Grid& grid) {
    constexpr double kEndless = std::numeric_limits<double>::infinity();
    for (int c = 0; c < 3; ++c) {
        // A hundredth of a cell is for rounding.
        const double per = c == 2 ? MatteGrid::kPerLightness : MatteGrid::kPerSaturation;
        const double start = c == 2 ? 0 : -MatteGrid::kMost;
        const int first = extent.first[c], last = extent.last[c];
        grid.low[c] = static_cast<T>(first == 0 ? -kEndless : start + (first - 1.01) / per);
        grid.high[c] =
            static_cast<T>(last == kNodes[c] - 1 ? kEndless : start + (last + 1.01) / per);
    }
}

/// A grid's values as the kernels of single precision read them: those around all points within
/// the bounds.
std::shared_ptr<const FrameMatte> arranged(const std::shared_ptr<const FrameMatte>& matte,
                                           const Extent& extent, PickPlan<float>::Grid& grid) {
    if (extent.empty()) return matte;  // never read
    int first[3], count[3];
    for (int c = 0; c < 3; ++c) {
        // Within the hundredth of a cell the next cell counts.
        first[c] = std::max(extent.first[c] - 2, 0);
        count[c] = std::min(extent.last[c] + 2, kNodes[c] - 1) - first[c] + 1;
    }
    const int line = 2 * count[2], plane = count[1] * line;
    FrameMatte pairs(static_cast<std::size_t>(count[0] * plane), 0.0f);
    float* to = pairs.data();
    for (int u = 0; u < count[0]; ++u) {
        for (int v = 0; v < count[1]; ++v) {
            const float* const from =
                &(*matte)[MatteGrid::index(first[0] + u, first[1] + v, first[2])];
            const float* const next = from + (v + 1 < count[1] ? MatteGrid::kLightnesses : 0);
            for (int l = 0; l < count[2]; ++l) {
                *to++ = from[l];
                *to++ = next[l];
            }
        }
    }
    grid.plane = plane;
    grid.step[0] = static_cast<float>(plane);
    grid.step[1] = static_cast<float>(line);
    grid.step[2] = 2;
    grid.base = static_cast<float>(first[0] * plane + first[1] * line + first[2] * 2);
    return std::make_shared<const FrameMatte>(std::move(pairs));
}

/// As double precision reads them.
std::shared_ptr<const FrameMatte> arranged(const std::shared_ptr<const FrameMatte>& matte,
                                           const Extent&, PickPlan<double>::Grid& grid) {
    constexpr int kLine = MatteGrid::kLightnesses, kPlane = MatteGrid::kSaturations * kLine;
    grid.plane = kPlane;
    grid.step[0] = kPlane;
    grid.step[1] = kLine;
    grid.step[2] = 1;
    grid.base = 0;
    return matte;
}

template <class T>
typename PickPlan<T>::Window plan_of(const std::optional<FrameWindow>& window) {
    constexpr T kFar = T(1e15);
    if (!window) return {{-kFar, -kFar}, {kFar, kFar}, 1, 0, 1};
    const auto& box = window->box;
    const T scale = static_cast<T>(1 / window->feather);
    const T outside = window->inverted ? T(1) : T(0);
    return {{box[0], box[1]}, {box[2], box[3]}, scale, outside, 1 - 2 * outside};
}

}  // namespace

template <class T>
typename PickPlan<T>::Grid PickMemory<T>::grid(const std::shared_ptr<const FrameMatte>& matte,
                                               float idle) {
    typename PickPlan<T>::Grid grid{};
    const Extent extent(*matte, idle);
    set_bounds<T>(extent, grid);
    mattes_.push_back(arranged(matte, extent, grid));
    if (mattes_.back() != matte) arranged_bytes_ += vector_bytes(*mattes_.back());
    grid.values = mattes_.back()->data();
    return grid;
}

template <class T>
PickMemory<T>::PickMemory(const FramePicks& picks, const std::vector<Vec3>& done) {
    for (std::size_t i = 0; i < picks.picks.size(); ++i) {
        const FramePick& pick = picks.picks[i];
        const Vec3 shown = displayed(pick.colour, picks.display.get()), point = pick_point(shown);
        const PickedColour picked(shown);
        const double own = picked.amount(shown);
        const Vec3 change = pick.change - (i < done.size() ? done[i] : Vec3{0, 0, 0});
        typename PickPlan<T>::One one;
        one.matte = grid(pick.matte, 0);
        for (std::size_t c = 0; c < 3; ++c) {
            one.at[c] = static_cast<T>(point[c]);
            one.change[c] = static_cast<T>(pick.strength * change[c] / own);
        }
        for (std::size_t c = 0; c < 2; ++c) one.along[c] = static_cast<T>(picked.along[c]);
        one.window = plan_of<T>(pick.window);
        one.plain = static_cast<T>(picked.plain);
        one.dark = static_cast<T>(picked.dark);
        one.bright = static_cast<T>(picked.bright);
        one.strength = static_cast<T>(pick.strength);
        const double light = (change[0] + change[1] + change[2]) * (1.0 / 3);
        one.light = pick.is_matte ? T(0) : static_cast<T>(pick.strength * light / own);
        one.shade = static_cast<T>(own * picked.dark);
        picks_.push_back(one);
    }
    if (picks.left) left_ = grid(picks.left, 1);
    if (picks.display) {
        const DisplayCurve& curve = *picks.display;
        for (const double value : curve.values) display_.push_back(static_cast<T>(value));
        display_from_ = static_cast<T>(curve.from);
        display_scale_ =
            static_cast<T>(static_cast<double>(display_.size() - 1) / (curve.to - curve.from));
    }
}

template <class T>
PickPlan<T> PickMemory<T>::plan() const {
    return {picks_.data(),
            static_cast<int>(picks_.size()),
            left_,
            display_.empty() ? nullptr : display_.data(),
            static_cast<int>(display_.size()),
            display_from_,
            display_scale_};
}

template <class T>
std::size_t PickMemory<T>::bytes() const {
    return vector_bytes(picks_, display_) + arranged_bytes_;
}

template class PickMemory<float>;
template class PickMemory<double>;

double left_at(const FramePicks& picks, const Vec3& colour) {
    if (!picks.left) return 1;
    return MatteGrid::at(picks.left->data(), pick_point(displayed(colour, picks.display.get())));
}

Vec3 with_picks(const FramePicks& picks, const PickPlan<double>& plan, const Vec3& colour,
                const Vec3& moved, const Spot* spot) {
    const Vec3 shown = displayed(colour, picks.display.get()), point = pick_point(shown);
    const auto reaches = [&](const PickPlan<double>::Grid& grid) {
        bool inside = true;
        for (std::size_t c = 0; c < 3; ++c) {
            inside &= point[c] >= grid.low[c] && point[c] <= grid.high[c];
        }
        return inside;
    };
    Vec3 sum{};
    double shares = 0;
    for (int k = 0; k < plan.count; ++k) {
        const PickPlan<double>::One& pick = plan.picks[k];
        if (!reaches(pick.matte)) continue;
        double matte = MatteGrid::at(pick.matte.values, point);
        if (const auto& window = picks.picks[static_cast<std::size_t>(k)].window; spot && window) {
            matte *= window->at(*spot);
        }
        const PickedColour picked({pick.along[0], pick.along[1]}, pick.plain, pick.dark,
                                  pick.bright);
        const double amount = picked.amount(shown);
        double share = matte * amount;
        double dark =
            matte *
            std::max(amount - (PickedColour::grey_of(shown) + kLeastLight) * pick.shade, 0.0);
        if (plan.count > 1) {
            const double weight =
                matte * pick.strength / (pick_distance2(point, vec3(pick.at)) + kNearestPick);
            shares += weight;
            share *= weight;
            dark *= weight;
        }
        for (std::size_t c = 0; c < 3; ++c) sum[c] += share * pick.change[c] - dark * pick.light;
    }
    if (plan.count > 1) sum = (1 / std::max(shares, 1e-30)) * sum;
    const bool held = plan.left.values && moved != Vec3{0, 0, 0} && reaches(plan.left);
    return held ? MatteGrid::at(plan.left.values, point) * moved + sum : moved + sum;
}

}  // namespace palette4d
