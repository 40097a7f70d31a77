#include "fit/object_region.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <queue>
#include <stdexcept>
#include <utility>

#include "fit/region_pixels.hpp"

namespace palette4d {
namespace {

/// Width, in pixels, that frames are reduced to at most: codec noise averages out, hair stays. No
/// picture that is looked at is taller than kHeight then.
constexpr int kWidth = 480, kHeight = 4 * kWidth;
/// Half width, in reduced pixels, of the band around the object that is matted. Wider: soft edges
/// and motion blur are matted. Narrower: less background is left out.
constexpr int kBand = 8;
/// Amount of the picked colour from which on a region grows.
constexpr double kGrows = 0.25;
/// A colour with the pick's saturation is a shade of it, one with half of it is a mixture or
/// another thing: limits of the region's growth.
constexpr double kPale = 0.35, kPure = 0.65;
/// At the other frames the object is found where colours are this certainly the object's.
constexpr double kSure = 0.9;
/// A step between two pixels is at least this long, in squares of pick space.
constexpr float kShortest = 1e-6f;

/// 1 where a colour has the pick's saturation or more.
double purity(const Vec3& shown, const Vec3& picked) {
    const auto [red, green] = chroma_of(picked);
    const double length = std::sqrt(red * red + green * green);
    const double certain = hue_certainty(picked);
    const auto [own_red, own_green] = chroma_of(shown);
    const double along = std::max(own_red * red + own_green * green, 0.0) / std::max(length, 1e-9);
    const double saturation = (along + kChromaNoise) / (lightness_of(shown) + kChromaNoise);
    const double relative =
        saturation * (lightness_of(picked) + kChromaNoise) / (length + kChromaNoise);
    return 1 - certain + certain * smooth_step(relative, kPale, kPure);
}

/// Squares of pixels, which may be many and large: each takes the same time.
class Squares {
public:
    explicit Squares(const View& view)
        : view_(view),
          stride_(static_cast<std::size_t>(view.width) + 1),
          changes_(stride_ * (static_cast<std::size_t>(view.height) + 1)) {}

    void add(double x, double y, double radius) {
        const double x1 = std::max(0.0, std::ceil(x - radius)),
                     x2 = std::min(view_.width - 1.0, std::floor(x + radius));
        const double y1 = std::max(0.0, std::ceil(y - radius)),
                     y2 = std::min(view_.height - 1.0, std::floor(y + radius));
        if (!(x1 <= x2 && y1 <= y2)) return;
        const auto left = static_cast<std::size_t>(x1), right = static_cast<std::size_t>(x2) + 1;
        const auto top = static_cast<std::size_t>(y1) * stride_,
                   bottom = (static_cast<std::size_t>(y2) + 1) * stride_;
        ++changes_[top + left];
        --changes_[top + right];
        --changes_[bottom + left];
        ++changes_[bottom + right];
    }

    /// Marks the pixels that are in one of them.
    void mark(Mask& mask) const {
        std::vector<std::int64_t> above(stride_);
        for (int y = 0; y < view_.height; ++y) {
            std::int64_t count = 0;
            for (int x = 0; x < view_.width; ++x) {
                const auto column = static_cast<std::size_t>(x);
                above[column] += changes_[static_cast<std::size_t>(y) * stride_ + column];
                count += above[column];
                if (count > 0) mask[view_.at(x, y)] = 1;
            }
        }
    }

private:
    const View& view_;
    const std::size_t stride_;
    std::vector<std::int64_t> changes_;  ///< of the count, to the right and below
};

/// Marks the pixels of areas. `scale`: reduced pixels for each of the frame's.
void mark(Mask& mask, const View& view, const std::vector<Brush>& areas, double scale) {
    if (areas.empty()) return;
    Squares squares(view);
    for (const Brush& area : areas) {
        const double radius = std::max(area.radius * scale, 0.5);
        for (std::size_t i = 0; i < area.points.size(); ++i) {
            // Pixel centres: reduced pixel n has the pixels from n / scale on.
            const double x = (area.points[i][0] + 0.5) * scale - 0.5,
                         y = (area.points[i][1] + 0.5) * scale - 0.5;
            const double from_x = i ? (area.points[i - 1][0] + 0.5) * scale - 0.5 : x,
                         from_y = i ? (area.points[i - 1][1] + 0.5) * scale - 0.5 : y;
            const double length = std::max(std::abs(x - from_x), std::abs(y - from_y));
            const double steps = std::ceil(length / radius) + 1;
            // Only those steps whose squares are within the frame: a line may be very long.
            double first = 1, last = steps;
            const auto clip = [&](double from, double to, int size) {
                if (from == to) return;
                const double a = (-radius - 1 - from) / (to - from) * steps,
                             b = (size + radius - from) / (to - from) * steps;
                first = std::max(first, std::floor(std::min(a, b)));
                last = std::min(last, std::ceil(std::max(a, b)));
            };
            clip(from_x, x, view.width);
            clip(from_y, y, view.height);
            for (double step = first; step <= last; step += 1) {
                const double part = step / steps;
                squares.add(from_x + part * (x - from_x), from_y + part * (y - from_y), radius);
            }
        }
    }
    squares.mark(mask);
}

/// Where one of several masks is.
Mask any_of(const std::vector<Mask>& masks, std::size_t size) {
    Mask any(size, 0);
    for (const Mask& mask : masks) {
        for (std::size_t i = 0; i < size; ++i) any[i] |= mask[i];
    }
    return any;
}

/// Areas that casts to pixels and loops over steps can take.
void check_areas(const std::vector<Brush>& areas) {
    constexpr double kMostPixels = 1e9;
    const auto fits = [](double x) { return std::abs(x) <= kMostPixels; };  // not NaN
    for (const Brush& area : areas) {
        bool good = fits(area.radius);
        for (const auto& [x, y] : area.points) good = good && fits(x) && fits(y);
        if (!good) {
            throw std::invalid_argument(
                "learn_matte: found an area with NaN or beyond 1e9 pixels; expected pixels of the "
                "frame");
        }
    }
}

/// The pixels nearest the picked colour: a thousandth of all, but none that is another colour.
void seed_by_colour(View& view, const Vec3& point) {
    std::vector<std::pair<float, std::size_t>> away;
    for (std::size_t i = 0; i < view.size(); ++i) {
        if (!view.real[i]) continue;
        const auto square = static_cast<float>(pick_distance2(view.point[i], point));
        if (square < kNear * kNear) away.emplace_back(square, i);
    }
    std::sort(away.begin(), away.end());
    away.resize(std::min(away.size(), std::max(view.size() / 1000, std::size_t{9})));
    for (const auto& [unused, i] : away) view.seed[i] = 1;
}

/// Adds to marked pixels those that are connected with them and join(pixel, mean marked colour)
/// takes.
template <class Join>
void grow(const View& view, Mask& marked, Join join_of) {
    Vec3 shown{};
    std::vector<std::size_t> open;
    for (std::size_t i = 0; i < view.size(); ++i) {
        if (!marked[i] || !view.real[i]) continue;
        for (std::size_t c = 0; c < 3; ++c) shown[c] += static_cast<double>(view.shown[c][i]);
        open.push_back(i);
    }
    if (open.empty()) return;
    const auto join = join_of(Vec3((1 / static_cast<double>(open.size())) * shown));
    spread(view, std::move(open), [&](std::size_t i) {
        if (marked[i] || !view.real[i] || !join(i)) return false;
        marked[i] = 1;
        return true;
    });
}

/// What is held takes what is connected with it, has its hue, and is on its side.
void grow_held(const View& view, Mask& marked, const Mask& side) {
    grow(view, marked, [&](const Vec3& shown) {
        return [&view, &side, hue = hue_grid(shown)](std::size_t i) {
            return !view.seed[i] && side[i] && MatteGrid::at(hue.data(), view.point[i]) >= 0.5;
        };
    });
}

/// A part of the object that has another colour than the pick takes what has its hue and shade.
void grow_object(View& view, Mask& marked, const Vec3& pick, const Mask& held) {
    grow(view, marked, [&](const Vec3& shown) {
        const Vec3 own = pick_point(shown);
        const bool other = pick_distance2(own, pick) >= kNear * kNear;
        if (other) view.marked.own.push_back(own);
        return [&view, &held, other, shown, amount = PickedColour(shown),
                hue = hue_grid(shown)](std::size_t i) {
            if (!other || held[i]) return false;
            const Vec3 colour{view.shown[0][i], view.shown[1][i], view.shown[2][i]};
            return amount.amount(colour) > kGrows &&
                   purity(colour, shown) * MatteGrid::at(hue.data(), view.point[i]) >= 0.5;
        };
    });
}

/// Whether a saturation is nearer to a point of one kind than to all of another.
bool nearer(const Vec3& point, const std::vector<Vec3>& one, const std::vector<Vec3>& other) {
    const auto away = [&point](const std::vector<Vec3>& from) {
        double least = std::numeric_limits<double>::infinity();
        for (const Vec3& own : from) {
            const double u = point[0] - own[0], v = point[1] - own[1];
            least = std::min(least, u * u + v * v);
        }
        return least;
    };
    return away(one) < away(other);
}

/// The pixels that are nearer to what is held than to the object, in the frame. A way is as long as
/// the squares of its steps in pick space: a gradual shade is short, an edge is long.
Mask held_side(const View& view, const Mask& object, const Mask& held) {
    Mask side(view.size(), 0), done(view.size(), 0);
    std::vector<float> length(view.size(), std::numeric_limits<float>::infinity());
    using Way = std::pair<float, std::size_t>;
    std::priority_queue<Way, std::vector<Way>, std::greater<>> open;
    for (std::size_t i = 0; i < view.size(); ++i) {
        if (!held[i] && !object[i]) continue;
        side[i] = held[i];
        length[i] = 0;
        open.push({0.0f, i});
    }
    while (!open.empty()) {
        const auto [own, i] = open.top();
        open.pop();
        if (done[i]) continue;
        done[i] = 1;
        visit_around(view, i, [&, from = i, so_far = own](std::size_t to) {
            float step = kShortest;
            for (const Image& plane : view.ways) {
                const float change = plane[to] - plane[from];
                step += change * change;
            }
            if (so_far + step >= length[to]) return;
            length[to] = so_far + step;
            side[to] = side[from];
            open.push({length[to], to});
        });
    }
    return side;
}

Parts parts_of(const View& view, Mask region, const Mask& other, const Mask& unsure) {
    Parts parts;
    const std::size_t size = view.size();
    const std::vector<int> outside = distances(view, region, 1),
                           inside = distances(view, region, 0);
    Mask far(size), core(size), between(size);
    for (std::size_t i = 0; i < size; ++i) {
        far[i] = outside[i] > kBand && view.real[i];
        core[i] = inside[i] > 2;
        between[i] = !far[i] && !core[i] && view.real[i];
    }
    const LocalMean of_object(view, core, kBand * 3 / 2), of_others(view, far, kBand * 3 / 2);
    std::array<Image, 3> front, back;
    for (std::size_t c = 0; c < 3; ++c) {
        front[c] = of_object.of(view.shown[c], between);
        back[c] = of_others.of(view.shown[c], between);
    }
    parts.object.assign(size, 0);
    parts.background.assign(size, 0);
    parts.band.assign(size, 0);
    Image alphas(size, 0);
    for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
            const std::size_t i = view.at(x, y);
            if (!view.real[i]) continue;
            bool mixed = false;
            double alpha = 0;
            if (between[i] && of_object.any(x, y) && of_others.any(x, y)) {
                Vec3 line, own;
                for (std::size_t c = 0; c < 3; ++c) {
                    line[c] = static_cast<double>(front[c][i]) - back[c][i];
                    own[c] = static_cast<double>(view.shown[c][i]) - back[c][i];
                }
                const double length2 = dot(line, line);
                if (length2 > 0.01) {
                    alpha = std::clamp(dot(own, line) / length2, 0.0, 1.0);
                    const Vec3 off = own - alpha * line;
                    mixed = dot(off, off) < length2 / 16;
                }
            }
            const bool object =
                (inside[i] > 1 && !mixed) || (mixed && alpha > 0.9 && region[i]) || view.seed[i];
            const bool others = !object && ((outside[i] > 1 && !mixed) || (mixed && alpha < 0.05));
            parts.object[i] = object && !other[i];
            parts.background[i] = others && !other[i] && !unsure[i];
            parts.band[i] = mixed && !object && !others && !other[i] && !unsure[i];
            alphas[i] = static_cast<float>(alpha);
        }
    }
    // A mixture has its part of the object's amount of the picked colour, not of the pick's.
    const Image means = LocalMean(view, parts.object, kBand).of(view.amount, parts.band);
    parts.wanted.assign(size, 0);
    for (std::size_t i = 0; i < size; ++i) {
        if (!parts.band[i]) continue;
        const double own = std::max(static_cast<double>(view.amount[i]), 0.05);
        parts.wanted[i] = static_cast<float>(
            std::clamp(static_cast<double>(alphas[i]) * means[i] / own, 0.0, 1.0));
    }
    parts.region = std::move(region);
    parts.held = other;
    return parts;
}

}  // namespace

View reduced(const LearningFrame& frame, const Vec3& picked, const DisplayCurve* display) {
    if (frame.width < 1 || frame.height < 1) {
        throw std::invalid_argument("learn_matte: found a frame without pixels");
    }
    check_areas(frame.object);
    check_areas(frame.others);
    View view;
    const int by = std::max((frame.width + kWidth - 1) / kWidth, (frame.height - 1) / kHeight + 1);
    view.width = (frame.width + by - 1) / by;
    view.height = (frame.height + by - 1) / by;
    const std::size_t size = view.size();
    for (Image& channel : view.shown) channel.assign(size, 0);
    view.point.resize(size);
    view.real.assign(size, 0);
    view.amount.resize(size);
    view.grows.resize(size);
    view.node.resize(size);
    view.seed.assign(size, 0);
    const Vec3 now = displayed(frame.colour, display), first = displayed(picked, display);
    const Vec3 here = pick_point(now), start = pick_point(first);
    const PickedColour own(now);
    for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
            const std::size_t i = view.at(x, y);
            Vec3 sum{};
            int count = 0;
            for (int row = y * by; row < std::min((y + 1) * by, frame.height); ++row) {
                const auto* const pixels = reinterpret_cast<const float*>(
                    reinterpret_cast<const char*>(frame.pixels) + frame.row_bytes * row);
                for (int column = x * by; column < std::min((x + 1) * by, frame.width); ++column) {
                    const float* const rgb = pixels + 3 * static_cast<std::ptrdiff_t>(column);
                    const Vec3 colour{rgb[0], rgb[1], rgb[2]};
                    if (!finite(colour)) continue;
                    add(sum, 1, colour);
                    ++count;
                }
            }
            if (count == 0) continue;
            view.real[i] = 1;
            const Vec3 shown = displayed((1.0 / count) * sum, display);
            for (std::size_t c = 0; c < 3; ++c) view.shown[c][i] = static_cast<float>(shown[c]);
            const Vec3 point = pick_point(shown);
            view.point[i] = point - nearness(point, here) * (here - start);
            const MatteGrid::Place p = MatteGrid::place(view.point[i]);
            view.node[i] = static_cast<std::uint32_t>(MatteGrid::index(
                p.u + (p.part_u >= 0.5), p.v + (p.part_v >= 0.5), p.l + (p.part_l >= 0.5)));
            const double amount = own.amount(shown);
            view.amount[i] = static_cast<float>(amount);
            view.grows[i] = static_cast<float>(amount > kGrows ? purity(shown, now) : 0);
        }
    }
    const double scale = 1.0 / by;
    mark(view.seed, view, frame.object, scale);
    for (const Brush& area : frame.others) {
        view.held.emplace_back(size, 0);
        mark(view.held.back(), view, {area}, scale);
    }
    const Mask held = any_of(view.held, size);
    view.marked.own.push_back(start);
    for (const Brush& area : frame.object) {
        Mask marked(size, 0);
        mark(marked, view, {area}, scale);
        grow_object(view, marked, start, held);
        for (std::size_t i = 0; i < size; ++i) view.seed[i] |= marked[i];
    }
    for (std::size_t c = 0; c < 3 && !view.held.empty(); ++c) {
        Image plane(size);
        for (std::size_t i = 0; i < size; ++i) {
            plane[i] = static_cast<float>(view.point[i][c] * (c == 2 ? kLightnessWeight : 1));
        }
        view.ways[c] = smoothed(view, plane);
    }
    view.seeded = frame.seeded;
    if (frame.seeded && frame.object.empty()) seed_by_colour(view, start);
    for (std::size_t i = 0; i < size; ++i) {
        view.seed[i] &= view.real[i];
        for (Mask& marked : view.held) marked[i] &= view.real[i];
    }
    if (view.seeded && !view.held.empty()) {
        view.side = held_side(view, view.seed, any_of(view.held, size));
    }
    for (const Mask& marked : view.held) {
        Vec3 sum{};
        double count = 0;
        for (std::size_t i = 0; i < size; ++i) {
            if (!marked[i]) continue;
            add(sum, 1, view.point[i]);
            count += 1;
        }
        if (count > 0) view.marked.held.push_back((1 / count) * sum);
    }
    return view;
}

Parts find_object(const View& view, const Grid& membership, const Grid& sure,
                  const MarkedColours& marked) {
    Image inside(view.size());
    Mask seeds = view.seed;
    for (std::size_t i = 0; i < view.size(); ++i) {
        if (!view.real[i]) continue;
        if (view.seeded && view.grows[i] == 0) continue;
        const double m = MatteGrid::at(membership.data(), view.point[i]);
        inside[i] = static_cast<float>(m * static_cast<double>(view.grows[i]));
        if (!view.seeded) {
            seeds[i] = m > kSure && MatteGrid::at(sure.data(), view.point[i]) > kSure;
        }
    }
    if (!view.seeded) {
        // Single pixels are noise.
        const std::vector<int> within = distances(view, seeds, 0);
        for (std::size_t i = 0; i < view.size(); ++i) seeds[i] = within[i] > 1;
    }
    const Image smooth = smoothed(view, inside);
    Mask region(view.size());
    for (std::size_t i = 0; i < view.size(); ++i) {
        region[i] = view.real[i] && (smooth[i] > 0.5f || view.seed[i]);
    }
    std::vector<Mask> held = view.held;
    Mask unsure(view.size(), 0);
    if (!held.empty()) {
        const Mask all = any_of(held, view.size());
        Mask side = view.seeded ? view.side : held_side(view, seeds, all);
        for (std::size_t i = 0; i < view.size(); ++i) {
            side[i] &= all[i] || nearer(view.point[i], marked.held, marked.own);
            region[i] &= !side[i];
        }
        for (Mask& area : held) grow_held(view, area, side);
    } else if (!marked.held.empty()) {
        // Only the colour says what is held: not enough to call it background.
        for (std::size_t i = 0; i < view.size(); ++i) {
            unsure[i] =
                region[i] && !view.seed[i] && nearer(view.point[i], marked.held, marked.own);
            region[i] &= !unsure[i];
        }
    }
    const Mask other = any_of(held, view.size());
    return parts_of(view, connected(view, region, seeds), other, unsure);
}

}  // namespace palette4d
