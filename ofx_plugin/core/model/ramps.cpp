#include "model/ramps.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include "model/vec3.hpp"

namespace palette4d {
namespace {

/// What a handle does to its edges.
struct Knot {
    double frame;
    Vec3 by;
};

bool still(const Vec3& by) { return by == Vec3{0, 0, 0}; }

/// The displacements of one polytope's handles, and which handles are around a frame.
class Displacements {
public:
    Displacements(const Polytope& polytope, const Edits& edits)
        : polytope_(polytope),
          edits_(edits),
          sorted_(edits.stop_order.size() == edits.stops.size() ? std::vector<int>()
                                                                : order_of(edits.stops)),
          order_(sorted_.empty() ? edits.stop_order : sorted_) {}

    Vec3 of_vertex(int vertex) const {
        if (edits_.vertex_rgb.empty() || !edits_.vertex_rgb[vertex]) return {0, 0, 0};
        return *edits_.vertex_rgb[vertex] - polytope_.vertices()[vertex].rgb;
    }

    Vec3 of_stop(const Stop& stop) const {
        const Edge& edge = polytope_.edges()[stop.edge];
        const Vertex &from = polytope_.vertices()[edge.from], &to = polytope_.vertices()[edge.to];
        return stop.rgb - mixed(from.rgb, to.rgb, weight_between(from.frame, to.frame, stop.frame));
    }

    /// The stops of an edge just before (or at) and after a frame; null where there is none.
    std::pair<const Stop*, const Stop*> around(int edge, double frame) const {
        const std::ptrdiff_t count = stops_until(edge, frame);
        return {count > 0 ? &stop(edge, count - 1) : nullptr,
                count < stops_on(edge) ? &stop(edge, count) : nullptr};
    }

    /// A monotone cubic (Fritsch and Butland 1984) along an edge. It goes on across a vertex that
    /// one edge enters and one leaves; where edges split or merge its slope is 0.
    Vec3 smooth(int edge, double frame) const {
        const std::ptrdiff_t to = stops_until(edge, frame) + 1;
        const Edge& ends = polytope_.edges()[edge];
        bool flat_start = false, flat_end = false;
        std::optional<Knot> before, after;
        if (to > 1) {
            before = knot(edge, to - 2);
        } else if (const int last = only_neighbour(ends.from, true, flat_start); last >= 0) {
            before = knot(last, stops_on(last));
        }
        if (to <= stops_on(edge)) {
            after = knot(edge, to + 1);
        } else if (const int next = only_neighbour(ends.to, false, flat_end); next >= 0) {
            after = knot(next, 1);
        }
        return cubic(before, knot(edge, to - 1), knot(edge, to), after, flat_start, flat_end,
                     frame);
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

    std::vector<int>::const_iterator first_on(int edge) const {
        return std::lower_bound(order_.begin(), order_.end(), edge,
                                [&](int i, int e) { return edits_.stops[i].edge < e; });
    }

    const Stop& stop(int edge, std::ptrdiff_t i) const { return edits_.stops[first_on(edge)[i]]; }

    std::ptrdiff_t stops_on(int edge) const { return first_on(edge + 1) - first_on(edge); }

    /// How many stops of an edge are not after a frame.
    std::ptrdiff_t stops_until(int edge, double frame) const {
        const auto first = first_on(edge);
        return std::upper_bound(first, first_on(edge + 1), frame,
                                [&](double t, int i) { return t < edits_.stops[i].frame; }) -
               first;
    }

    /// A handle of an edge in time order: 0 is its first vertex, then its stops, its last vertex.
    Knot knot(int edge, std::ptrdiff_t i) const {
        const Edge& ends = polytope_.edges()[edge];
        if (i > 0 && i <= stops_on(edge)) {
            const Stop& found = stop(edge, i - 1);
            return {found.frame, of_stop(found)};
        }
        const int vertex = i == 0 ? ends.from : ends.to;
        return {polytope_.vertices()[vertex].frame, of_vertex(vertex)};
    }

    /// The cubic between a and b.
    static Vec3 cubic(const std::optional<Knot>& before, const Knot& a, const Knot& b,
                      const std::optional<Knot>& after, bool flat_start, bool flat_end,
                      double frame) {
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
    const std::vector<int> sorted_;
    const std::vector<int>& order_;
};

void require_vertices(const char* what, std::size_t found, const Polytope& polytope) {
    if (found == 0 || found == polytope.vertices().size()) return;
    throw std::invalid_argument("edited_colours: " + std::string(what) + " of " +
                                std::to_string(found) + " vertices, expected " +
                                std::to_string(polytope.vertices().size()));
}

}  // namespace

std::vector<int> order_of(const std::vector<Stop>& stops) {
    std::vector<int> order(stops.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](int a, int b) {
        return std::tie(stops[a].edge, stops[a].frame) < std::tie(stops[b].edge, stops[b].frame);
    });
    return order;
}

std::vector<Vec3> edited_colours(const Polytope& polytope, const Edits& edits, const Slice& slice) {
    require_vertices("edits", edits.vertex_rgb.size(), polytope);
    require_vertices("ramps", edits.vertex_ramp.size(), polytope);
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
        const auto [before, after] = displacements.around(point.edge, slice.frame);
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
    }
    return result;
}

}  // namespace palette4d
