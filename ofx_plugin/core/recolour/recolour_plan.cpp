#include "recolour/recolour_plan.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "model/vec3.hpp"

namespace palette4d {
namespace {

template <class T>
void round(const Vec3& from, T (&to)[3]) {
    for (std::size_t c = 0; c < 3; ++c) to[c] = static_cast<T>(from[c]);
}

Vec3 turned(const Vec3& v) {
    Vec3 result{};
    for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) result[r] += kTurn[r][c] * v[c];
    }
    return result;
}

double largest(const Vec3& v) { return std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}); }

}  // namespace

template <class T>
PlanMemory<T>::PlanMemory(const PaletteBody& body, const std::vector<Vec3>& displacement) {
    plan_.convex = body.convex();
    plan_.solid = !body.faces().empty() && !body.flat();

    double size = body.extent();
    Vec3 low = displacement[0], high = displacement[0];
    for (std::size_t i = 0; i < body.rgb().size(); ++i) {
        const Vec3& colour = body.rgb()[i];
        typename Plan<T>::Vertex vertex;
        round(colour, vertex.at);
        round(turned(colour - body.rgb()[0]), vertex.ray);
        size = std::max(size, largest(colour));
        const Vec3& delta = displacement[i];
        vertices_.push_back(vertex);
        for (std::size_t c = 0; c < 3; ++c) {
            low[c] = std::min(low[c], delta[c]);
            high[c] = std::max(high[c], delta[c]);
        }
        if (delta == Vec3{0, 0, 0}) continue;
        typename Plan<T>::Mover mover;
        mover.vertex = i * Plan<T>::kVertex;
        round(delta, mover.delta);
        movers_.push_back(mover);
    }
    if (movers_.empty()) {
        usable_ = true;
        return;
    }
    plan_.size = static_cast<T>(size);
    plan_.spread = static_cast<T>(largest(high - low));
    // Leaves room, so that products of three lengths and of their inverses do not overflow.
    const double room = sizeof(T) == sizeof(float) ? 1e6 : 1e40;
    usable_ = body.extent() > 1 / room && size < room && largest(high - low) < room;
    if (!usable_) return;
    if (plan_.solid) add_inside(body);
    add_surface(body, displacement);

    plan_.vertices = vertices_.data();
    plan_.movers = movers_.data();
    plan_.edges = edges_.data();
    plan_.faces = faces_.data();
    plan_.segments = segments_.data();
    plan_.triangles = triangles_.data();
    plan_.vertex_count = static_cast<int>(vertices_.size());
    plan_.mover_count = static_cast<int>(movers_.size());
    plan_.edge_count = static_cast<int>(edges_.size());
    plan_.face_count = static_cast<int>(faces_.size());
    plan_.segment_count = static_cast<int>(segments_.size());
    plan_.triangle_count = static_cast<int>(triangles_.size());
}

template <class T>
void PlanMemory<T>::add_inside(const PaletteBody& body) {
    std::map<std::pair<std::size_t, std::size_t>, std::size_t> edge_of;
    const auto edge = [&](std::size_t a, std::size_t b) {
        const auto [at, added] = edge_of.insert({{a, b}, edges_.size() * Plan<T>::kEdge});
        if (added) edges_.push_back({a * Plan<T>::kVertex, b * Plan<T>::kVertex});
        return at->second;
    };
    for (std::size_t f = 0; f < body.faces().size(); ++f) {
        if (body.degenerate(f)) continue;
        Face corners = body.faces()[f];
        std::sort(corners.begin(), corners.end());
        const auto i = static_cast<std::size_t>(corners[0]),
                   j = static_cast<std::size_t>(corners[1]),
                   k = static_cast<std::size_t>(corners[2]);
        const Vec3 &a = body.rgb()[i], &b = body.rgb()[j], &c = body.rgb()[k];
        typename Plan<T>::Face face;
        face.i = i * Plan<T>::kVertex;
        face.j = j * Plan<T>::kVertex;
        face.k = k * Plan<T>::kVertex;
        face.jk = edge(j, k);
        face.ik = edge(i, k);
        face.ij = edge(i, j);
        const Vec3 normal = cross(b - a, c - a);
        const bool same_way = dot(normal, body.normal(f)) > 0;
        round(norm(normal) * body.normal(f), face.area);
        face.twice_area = static_cast<T>(norm(normal));
        const Vec3 up = turned((1 / norm(normal)) * normal);
        round(up[2] < 0 ? -1 * up : up, face.ray_normal);
        face.ray_sign = static_cast<T>((up[2] < 0) == same_way ? -1 : 1);
        faces_.push_back(face);
        double width = 0;
        for (const Vec3& colour : body.rgb()) {
            width = std::max(width, std::abs(dot(body.normal(f), colour - a)));
        }
        plan_.steepness = std::max(plan_.steepness, static_cast<T>(plan_.spread / width));
    }
}

template <class T>
void PlanMemory<T>::add_surface(const PaletteBody& body, const std::vector<Vec3>& displacement) {
    std::set<std::pair<int, int>> sides;
    if (body.faces().empty()) sides.insert({0, static_cast<int>(body.rgb().size()) - 1});
    for (const std::size_t f : body.skin()) {
        const Face& face = body.faces()[f];
        for (std::size_t s = 0; s < 3; ++s) sides.insert(std::minmax(face[s], face[(s + 1) % 3]));
        if (body.degenerate(f)) continue;
        const Vec3& start = body.rgb()[face[0]];
        const Vec3 j = body.rgb()[face[1]] - start, k = body.rgb()[face[2]] - start;
        const Vec3 normal = cross(j, k);
        const double scale = 1 / dot(normal, normal);
        const Vec3 gradient_j = scale * cross(k, normal), gradient_k = scale * cross(normal, j);
        const Vec3& delta = displacement[face[0]];
        const Vec3 change_j = displacement[face[1]] - delta,
                   change_k = displacement[face[2]] - delta;
        typename Plan<T>::Triangle triangle;
        round(start, triangle.start);
        round(std::sqrt(scale) * normal, triangle.normal);
        round(gradient_j, triangle.gradient_j);
        round(gradient_k, triangle.gradient_k);
        round(delta, triangle.delta);
        round(change_j, triangle.change_j);
        round(change_k, triangle.change_k);
        triangle.slope = static_cast<T>(norm(gradient_j) * largest(change_j) +
                                        norm(gradient_k) * largest(change_k));
        plan_.steepness = std::max(plan_.steepness, triangle.slope);
        triangles_.push_back(triangle);
    }
    for (const auto& [a, b] : sides) {
        const Vec3 along = body.rgb()[b] - body.rgb()[a];
        const Vec3 change = displacement[b] - displacement[a];
        const double length2 = dot(along, along);
        const double inverse = length2 > 0 ? 1 / length2 : 0.0;
        typename Plan<T>::Segment segment;
        round(body.rgb()[a], segment.start);
        round(along, segment.along);
        segment.inverse_length2 = static_cast<T>(inverse);
        round(displacement[a], segment.delta);
        round(change, segment.change);
        segment.slope = static_cast<T>(std::sqrt(inverse) * largest(change));
        plan_.steepness = std::max(plan_.steepness, segment.slope);
        segments_.push_back(segment);
    }
}

template class PlanMemory<float>;
template class PlanMemory<double>;

}  // namespace palette4d
