#include "model/slice.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace palette4d {

Vec3 mixed(const Vec3& u, const Vec3& v, double weight) {
    return {u[0] + weight * (v[0] - u[0]), u[1] + weight * (v[1] - u[1]),
            u[2] + weight * (v[2] - u[2])};
}

double weight_between(double from, double to, double frame) {
    const double weight = (frame - from) / (to - from);
    return weight < 1.0 ? weight : std::nextafter(1.0, 0.0);
}

namespace {

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

}  // namespace palette4d
