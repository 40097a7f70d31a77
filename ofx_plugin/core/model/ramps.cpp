#include "model/ramps.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "model/vec3.hpp"

namespace palette4d {
namespace {

/// What a handle does to its edges.
struct Knot {
    double frame;
    Vec3 by;
};

/// Below this length of a colour, its shades are less and less certain: all are near black.
constexpr double kDark = 0.6;

/// Bump::along of a bump at a colour: the ray from black through it has its shades.
Vec3 along(const Vec3& centre, double shade) {
    return std::sqrt(1 - shade * shade) / std::max(norm(centre), kDark) * centre;
}

bool still(const Vec3& by) { return by == Vec3{0, 0, 0}; }

/// The displacements of one polytope's handles.
class Displacements {
public:
    Displacements(const Polytope& polytope, const Edits& edits)
        : polytope_(polytope), edits_(edits) {}

    Vec3 of_vertex(int vertex) const {
        if (edits_.vertex_rgb.empty() || !edits_.vertex_rgb[vertex]) return {0, 0, 0};
        return *edits_.vertex_rgb[vertex] - polytope_.vertices()[vertex].rgb;
    }

    Vec3 of_stop(const Stop& stop) const {
        const Edge& edge = polytope_.edges()[stop.edge];
        const Vertex &from = polytope_.vertices()[edge.from], &to = polytope_.vertices()[edge.to];
        return stop.rgb - mixed(from.rgb, to.rgb, weight_between(from.frame, to.frame, stop.frame));
    }

    /// All handles on an edge, its ends included, in time order.
    std::vector<Knot> on_edge(int edge) const {
        const Edge& ends = polytope_.edges()[edge];
        std::vector<Knot> knots;
        for (const int end : {ends.from, ends.to}) {
            knots.push_back({polytope_.vertices()[end].frame, of_vertex(end)});
        }
        for (const Stop& stop : edits_.stops) {
            if (stop.edge == edge) knots.push_back({stop.frame, of_stop(stop)});
        }
        std::sort(knots.begin(), knots.end(),
                  [](const Knot& a, const Knot& b) { return a.frame < b.frame; });
        return knots;
    }

    /// A monotone cubic (Fritsch and Butland 1984) along an edge. It goes on across a vertex that
    /// one edge enters and one leaves; where edges split or merge its slope is 0.
    Vec3 smooth(int edge, double frame) const {
        std::vector<Knot> knots = on_edge(edge);
        const Edge& ends = polytope_.edges()[edge];
        const auto after = std::upper_bound(knots.begin(), knots.end(), frame,
                                            [](double t, const Knot& k) { return t < k.frame; });
        auto to = static_cast<std::size_t>(after - knots.begin());
        const bool first = to == 1, last = to + 1 == knots.size();
        bool flat_start = false, flat_end = false;
        if (first) {
            if (const int before = only_neighbour(ends.from, true, flat_start); before >= 0) {
                const std::vector<Knot> earlier = on_edge(before);
                knots.insert(knots.begin(), earlier[earlier.size() - 2]);
                ++to;
            }
        }
        if (last) {
            if (const int next = only_neighbour(ends.to, false, flat_end); next >= 0) {
                knots.push_back(on_edge(next)[1]);
            }
        }
        return cubic(knots, to, flat_start, flat_end, frame);
    }

private:
    /// The one edge before or after a vertex, else -1. `branches`: where edges split or merge.
    int only_neighbour(int vertex, bool before, bool& branches) const {
        int entering = 0, leaving = 0, found = -1;
        for (std::size_t i = 0; i < polytope_.edges().size(); ++i) {
            const Edge& edge = polytope_.edges()[i];
            entering += edge.to == vertex;
            leaving += edge.from == vertex;
            if ((before ? edge.to : edge.from) == vertex) found = static_cast<int>(i);
        }
        branches = entering > 1 || leaving > 1;
        return branches ? -1 : found;
    }

    /// The cubic between knots[to - 1] and knots[to].
    static Vec3 cubic(const std::vector<Knot>& knots, std::size_t to, bool flat_start,
                      bool flat_end, double frame) {
        const Knot &a = knots[to - 1], &b = knots[to];
        const Knot* const before = to >= 2 ? &knots[to - 2] : nullptr;
        const Knot* const after = to + 1 < knots.size() ? &knots[to + 1] : nullptr;
        const double length = b.frame - a.frame;
        const double u = weight_between(a.frame, b.frame, frame);
        Vec3 result{};
        for (std::size_t c = 0; c < 3; ++c) {
            const double rise = b.by[c] - a.by[c], slope = rise / length;
            const auto slope_to = [&](const Knot& from, const Knot& end) {
                return (end.by[c] - from.by[c]) / (end.frame - from.frame);
            };
            const double earlier = before ? slope_to(*before, a) : 0.0,
                         later = after ? slope_to(b, *after) : 0.0,
                         earlier_length = before ? a.frame - before->frame : 0.0,
                         later_length = after ? after->frame - b.frame : 0.0;
            const double start = flat_start ? 0.0
                                 : before   ? inner_slope(earlier_length, earlier, length, slope)
                                 : after    ? outer_slope(length, slope, later_length, later)
                                            : slope;
            const double end = flat_end ? 0.0
                               : after  ? inner_slope(length, slope, later_length, later)
                               : before ? outer_slope(length, slope, earlier_length, earlier)
                                        : slope;
            const double v = 1 - u;
            result[c] = a.by[c] + rise * (u * u * (3 - 2 * u)) +
                        length * (start * (u * v * v) - end * (u * u * v));
        }
        return result;
    }

    /// Between two intervals of given lengths and slopes: their weighted harmonic mean.
    static double inner_slope(double length0, double slope0, double length1, double slope1) {
        if (!(slope0 * slope1 > 0)) return 0;
        const double weight0 = 2 * length1 + length0, weight1 = length1 + 2 * length0;
        return (weight0 + weight1) / (weight0 / slope0 + weight1 / slope1);
    }

    /// At the free end of the interval `length0`: a parabola's, bounded to stay monotone.
    static double outer_slope(double length0, double slope0, double length1, double slope1) {
        const double slope =
            ((2 * length0 + length1) * slope0 - length0 * slope1) / (length0 + length1);
        if (!(slope * slope0 > 0)) return 0;
        if (!(slope0 * slope1 > 0) && std::abs(slope) > 3 * std::abs(slope0)) return 3 * slope0;
        return slope;
    }

    const Polytope& polytope_;
    const Edits& edits_;
};

/// The nearest elements of an edge on both sides of a frame; null where a side has none.
template <class Element>
std::pair<const Element*, const Element*> around(const std::vector<Element>& elements, int edge,
                                                 double frame) {
    const Element *before = nullptr, *after = nullptr;
    for (const Element& element : elements) {
        if (element.edge != edge) continue;
        if (element.frame <= frame) {
            if (before == nullptr || element.frame > before->frame) before = &element;
        } else if (after == nullptr || element.frame < after->frame) {
            after = &element;
        }
    }
    return {before, after};
}

/// The solution's displacement of a palette colour.
Vec3 solved(const Polytope& polytope, const Solution& solution, const SlicePoint& point,
            double frame) {
    const auto of_vertex = [&](int vertex) {
        return solution.vertex_by.empty() ? Vec3{0, 0, 0} : solution.vertex_by[vertex];
    };
    if (point.edge < 0) return of_vertex(point.from);
    const auto [before, after] = around(solution.keys, point.edge, frame);
    if (before == nullptr && after == nullptr) {
        return mixed(of_vertex(point.from), of_vertex(point.to), point.weight);
    }
    return mixed(before ? before->by : of_vertex(point.from),
                 after ? after->by : of_vertex(point.to),
                 weight_between(before ? before->frame : polytope.vertices()[point.from].frame,
                                after ? after->frame : polytope.vertices()[point.to].frame, frame));
}

void require_vertices(const char* what, std::size_t found, const Polytope& polytope) {
    if (found == 0 || found == polytope.vertices().size()) return;
    throw std::invalid_argument("edited_colours: " + std::string(what) + " of " +
                                std::to_string(found) + " vertices, expected " +
                                std::to_string(polytope.vertices().size()));
}

/// The keys before and after a frame, and the weight of the latter.
template <class Key>
struct Around {
    const Key &a, &b;
    double weight;
};

template <class Key>
Around<Key> around(const std::vector<Key>& keys, double frame) {
    const auto after = std::upper_bound(keys.begin(), keys.end(), frame,
                                        [](double t, const Key& key) { return t < key.frame; });
    const Key& b = after == keys.end() ? keys.back() : *after;
    const Key& a = after == keys.begin() ? b : *(after - 1);
    return {a, b, &a == &b ? 0.0 : weight_between(a.frame, b.frame, frame)};
}

}  // namespace

std::vector<Vec3> edited_colours(const Polytope& polytope, const Edits& edits, const Slice& slice) {
    require_vertices("edits", edits.vertex_rgb.size(), polytope);
    require_vertices("ramps", edits.vertex_ramp.size(), polytope);
    require_vertices("a solution", edits.solution.vertex_by.size(), polytope);
    const auto& vertices = polytope.vertices();
    const Displacements displacements(polytope, edits);
    const auto edited = [&](int vertex) {
        return !edits.vertex_rgb.empty() && edits.vertex_rgb[vertex].has_value();
    };
    const auto colour = [&](int vertex) -> const Vec3& {
        return edited(vertex) ? *edits.vertex_rgb[vertex] : vertices[vertex].rgb;
    };
    const auto vertex_ramp = [&](int vertex) {
        return edits.vertex_ramp.empty() ? std::nullopt : edits.vertex_ramp[vertex];
    };
    const auto still_at = [&](const Stop* stop, int vertex) {
        return still(stop ? displacements.of_stop(*stop) : displacements.of_vertex(vertex));
    };
    const auto by_handles = [&](const SlicePoint& point, const Vec3& original) {
        if (point.edge < 0) return edited(point.from) ? colour(point.from) : original;
        const auto [before, after] = around(edits.stops, point.edge, slice.frame);
        const Ramp ramp =
            (before ? before->ramp : vertex_ramp(point.from)).value_or(edits.default_ramp);
        if (ramp == Ramp::kLinear) {
            // Between handles that hold the clip's colours, mixing would change the last bits.
            if (still_at(before, point.from) && still_at(after, point.to)) return original;
            if (before == nullptr && after == nullptr) {
                return mixed(colour(point.from), colour(point.to), point.weight);
            }
            const double from = before ? before->frame : vertices[point.from].frame;
            const double to = after ? after->frame : vertices[point.to].frame;
            return mixed(before ? before->rgb : colour(point.from),
                         after ? after->rgb : colour(point.to),
                         weight_between(from, to, slice.frame));
        }
        if (before && before->frame == slice.frame) return before->rgb;
        const Vec3 by = ramp == Ramp::kSmooth ? displacements.smooth(point.edge, slice.frame)
                        : before              ? displacements.of_stop(*before)
                                              : displacements.of_vertex(point.from);
        return still(by) ? original : original + by;
    };

    std::vector<Vec3> result = slice.rgb;
    for (std::size_t i = 0; i < result.size(); ++i) {
        result[i] = by_handles(slice.where[i], slice.rgb[i]);
        const Vec3 by = solved(polytope, edits.solution, slice.where[i], slice.frame);
        if (!still(by)) result[i] = result[i] + by;
    }
    return result;
}

std::vector<Bump> bumps_at(const Edits& edits, double frame) {
    std::vector<Bump> result;
    for (const Solution::MovingBump& bump : edits.solution.bumps) {
        const auto [a, b, weight] = around(bump.keys, frame);
        const Vec3 by = mixed(a.by, b.by, weight);
        const Vec3 centre = mixed(a.centre, b.centre, weight);
        if (!still(by)) result.push_back({centre, bump.radius, by, 0, along(centre, bump.shade)});
    }
    for (const Solution::MovingHold& hold : edits.solution.holds) {
        const auto [a, b, weight] = around(hold.keys, frame);
        const double keep = (1 - weight) * a.keep + weight * b.keep;
        const double radius = (1 - weight) * a.radius + weight * b.radius;
        const Vec3 centre = mixed(a.centre, b.centre, weight);
        if (keep > 0) result.push_back({centre, radius, {}, keep, along(centre, hold.shade)});
    }
    return result;
}

}  // namespace palette4d
