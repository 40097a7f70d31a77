#include "model/slice.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace palette4d {
namespace {

Vec3 mixed(const Vec3& u, const Vec3& v, double weight) {
    return {u[0] + weight * (v[0] - u[0]), u[1] + weight * (v[1] - u[1]),
            u[2] + weight * (v[2] - u[2])};
}

/// Position between two frames, in [0, 1): rounding must not reach 1.
double weight_between(double from, double to, double frame) {
    const double weight = (frame - from) / (to - from);
    return weight < 1.0 ? weight : std::nextafter(1.0, 0.0);
}

/// A track's position at a frame that it covers.
SlicePoint point_on(const Polytope& polytope, const std::vector<int>& track, double frame) {
    const auto& vertices = polytope.vertices();
    const auto after = std::upper_bound(track.begin(), track.end(), frame,
                                        [&](double t, int i) { return t < vertices[i].frame; });
    const int from = *(after - 1);
    if (vertices[from].frame == frame) return {-1, from, from, 0.0};
    const int to = *after;
    return {polytope.find_edge(from, to), from, to,
            weight_between(vertices[from].frame, vertices[to].frame, frame)};
}

}  // namespace

Slice slice_at(const Polytope& polytope, double frame) {
    if (polytope.sections().empty()) throw std::invalid_argument("slice_at: an empty polytope");
    if (std::isnan(frame)) throw std::invalid_argument("slice_at: frame is not a number");
    Slice slice;
    slice.frame = std::clamp(frame, polytope.first_frame(), polytope.last_frame());
    slice.section = polytope.section_at(slice.frame);
    const Section& section = polytope.sections()[slice.section];
    slice.faces = section.faces;
    slice.rgb.reserve(section.tracks.size());
    slice.where.reserve(section.tracks.size());
    for (const auto& track : section.tracks) {
        const SlicePoint point = point_on(polytope, track, slice.frame);
        const Vec3& from = polytope.vertices()[point.from].rgb;
        slice.where.push_back(point);
        slice.rgb.push_back(
            point.edge < 0 ? from : mixed(from, polytope.vertices()[point.to].rgb, point.weight));
    }
    return slice;
}

std::vector<Vec3> edited_colours(const Polytope& polytope, const Edits& edits, const Slice& slice) {
    const auto& vertices = polytope.vertices();
    if (!edits.vertex_rgb.empty() && edits.vertex_rgb.size() != vertices.size()) {
        throw std::invalid_argument("edited_colours: edits of " +
                                    std::to_string(edits.vertex_rgb.size()) +
                                    " vertices, expected " + std::to_string(vertices.size()));
    }
    const auto edited = [&](int vertex) {
        return !edits.vertex_rgb.empty() && edits.vertex_rgb[vertex].has_value();
    };
    const auto colour = [&](int vertex) -> const Vec3& {
        return edited(vertex) ? *edits.vertex_rgb[vertex] : vertices[vertex].rgb;
    };

    std::vector<Vec3> result = slice.rgb;
    for (std::size_t i = 0; i < result.size(); ++i) {
        const SlicePoint& point = slice.where[i];
        if (point.edge < 0) {
            if (edited(point.from)) result[i] = colour(point.from);
            continue;
        }
        // The stops on both sides of the frame; the edge's end where a side has none.
        const Stop* before = nullptr;
        const Stop* after = nullptr;
        for (const Stop& stop : edits.stops) {
            if (stop.edge != point.edge) continue;
            if (stop.frame <= slice.frame) {
                if (before == nullptr || stop.frame > before->frame) before = &stop;
            } else if (after == nullptr || stop.frame < after->frame) {
                after = &stop;
            }
        }
        if (before == nullptr && after == nullptr) {
            if (edited(point.from) || edited(point.to)) {
                result[i] = mixed(colour(point.from), colour(point.to), point.weight);
            }
            continue;
        }
        const double from = before ? before->frame : vertices[point.from].frame;
        const double to = after ? after->frame : vertices[point.to].frame;
        result[i] =
            mixed(before ? before->rgb : colour(point.from), after ? after->rgb : colour(point.to),
                  weight_between(from, to, slice.frame));
    }
    return result;
}

}  // namespace palette4d
