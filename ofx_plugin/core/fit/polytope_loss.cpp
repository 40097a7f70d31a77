#include "fit/polytope_loss.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "model/vec3.hpp"
#include "threads/share_rows.hpp"

namespace palette4d {
namespace {

struct Point {
    int from, to;
    double weight;
};

/// A track's colour at `frame`: eq. 6. Times outside the track are accepted within rounding only.
Point locate(const std::vector<int>& track, const std::vector<Vec4>& vertices, double frame) {
    if (track.size() == 1) return {track[0], track[0], 0};
    std::size_t next = 1;
    while (next + 1 < track.size() && vertices[track[next]][3] < frame) ++next;
    const int from = track[next - 1], to = track[next];
    const double t0 = vertices[from][3], t1 = vertices[to][3];
    if (!(t1 > t0)) return {from, to, frame >= t1 ? 1.0 : 0.0};
    return {from, to, std::clamp((frame - t0) / (t1 - t0), 0.0, 1.0)};
}

const BlockTopology& block_of(const std::vector<BlockTopology>& blocks, double frame) {
    for (const BlockTopology& block : blocks)
        if (frame >= block.first && frame <= block.last) return block;
    throw std::invalid_argument("no block covers frame " + std::to_string(frame));
}

/// Memory that a thread reuses from frame to frame.
struct Scratch {
    std::vector<Point> points;
    std::vector<Vec3> palette, slice_gradient;
};

FrameLoss one_frame(const std::vector<Vec4>& vertices, const BlockTopology& block,
                    const FrameColours& frame, const LossWeights& weights, Scratch& scratch,
                    std::vector<std::pair<int, Vec4>>* gradient) {
    auto& [points, palette, slice_gradient] = scratch;
    points.clear();
    palette.clear();
    for (const auto& track : block.tracks) {
        points.push_back(locate(track, vertices, frame.frame));
        const Vec4 &a = vertices[points.back().from], &b = vertices[points.back().to];
        const double w = points.back().weight;
        palette.push_back(
            {a[0] + w * (b[0] - a[0]), a[1] + w * (b[1] - a[1]), a[2] + w * (b[2] - a[2])});
    }
    const FrameLoss loss = palette_loss(*frame.colours, palette, block.faces, weights,
                                        gradient ? &slice_gradient : nullptr);
    if (!gradient) return loss;
    gradient->reserve(2 * points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Point& p = points[i];
        const Vec3& g = slice_gradient[i];
        const Vec4 &a = vertices[p.from], &b = vertices[p.to];
        const double span = b[3] - a[3];
        double along = 0;  // dLoss/dweight
        for (int c = 0; c < 3; ++c) along += g[c] * (b[c] - a[c]);
        const double dt = span > 0 ? along / span : 0;
        // weight = (t - ta) / (tb - ta)
        gradient->push_back({p.from,
                             {g[0] * (1 - p.weight), g[1] * (1 - p.weight), g[2] * (1 - p.weight),
                              -dt * (1 - p.weight)}});
        gradient->push_back(
            {p.to, {g[0] * p.weight, g[1] * p.weight, g[2] * p.weight, -dt * p.weight}});
    }
    return loss;
}

}  // namespace

std::vector<FrameLoss> polytope_loss(const std::vector<Vec4>& vertices,
                                     const std::vector<BlockTopology>& blocks,
                                     const std::vector<FrameColours>& frames,
                                     const std::vector<int>& which, const LossWeights& weights,
                                     int threads, std::vector<Vec4>* gradient) {
    const int vertex_count = static_cast<int>(vertices.size());
    for (const BlockTopology& block : blocks) {
        const int tracks = static_cast<int>(block.tracks.size());
        for (const auto& track : block.tracks) {
            if (track.empty()) throw std::invalid_argument("an empty track");
            for (int v : track)
                if (v < 0 || v >= vertex_count)
                    throw std::invalid_argument("a track names vertex " + std::to_string(v));
        }
        for (const Face& face : block.faces)
            for (int corner : face)
                if (corner < 0 || corner >= tracks)
                    throw std::invalid_argument("a face names track " + std::to_string(corner));
    }
    for (int f : which)
        if (f < 0 || f >= static_cast<int>(frames.size()) || !frames[f].colours)
            throw std::invalid_argument("no colours for frame index " + std::to_string(f));

    const int count = static_cast<int>(which.size());
    std::vector<FrameLoss> losses(which.size());
    std::vector<std::vector<std::pair<int, Vec4>>> parts(gradient ? which.size() : 0);
    // A frame takes microseconds: a few of them are not worth a thread.
    share_rows(count, std::max(1, std::min(threads, count / 4)), [&](const NextRow& next) {
        Scratch scratch;
        for (int i = next(); i >= 0; i = next()) {
            const FrameColours& frame = frames[which[i]];
            losses[i] = one_frame(vertices, block_of(blocks, frame.frame), frame, weights, scratch,
                                  gradient ? &parts[i] : nullptr);
        }
    });

    if (gradient) {
        gradient->assign(vertices.size(), Vec4{0, 0, 0, 0});
        for (const auto& part : parts)
            for (const auto& [vertex, g] : part)
                for (int c = 0; c < 4; ++c) (*gradient)[vertex][c] += g[c];
    }
    return losses;
}

double smoothness(const std::vector<Vec4>& vertices, const std::vector<TimeEdge>& edges,
                  double length, std::vector<Vec4>* gradient) {
    if (gradient) gradient->assign(vertices.size(), Vec4{0, 0, 0, 0});
    const int vertex_count = static_cast<int>(vertices.size());
    const double edge_count = static_cast<double>(edges.size());
    double sum = 0;
    for (const TimeEdge& edge : edges) {
        if (std::min(edge.from, edge.to) < 0 || std::max(edge.from, edge.to) >= vertex_count)
            throw std::invalid_argument("an edge from vertex " + std::to_string(edge.from) +
                                        " to " + std::to_string(edge.to) + " of " +
                                        std::to_string(vertex_count));
        const Vec4 &a = vertices[edge.from], &b = vertices[edge.to];
        const double dt = b[3] - a[3];
        if (!(dt > 0)) continue;
        const Vec3 change{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        const double distance = norm(change), steepness = edge.weight * length / dt,
                     slope = distance * steepness;
        sum += slope;
        if (!gradient) continue;
        Vec4 &early = (*gradient)[edge.from], &late = (*gradient)[edge.to];
        for (int c = 0; c < 3; ++c) {
            const double by = change[c] * steepness / std::max(distance, 1e-12) / edge_count;
            late[c] += by;
            early[c] -= by;
        }
        late[3] -= slope / dt / edge_count;
        early[3] += slope / dt / edge_count;
    }
    return edges.empty() ? 0 : sum / edge_count;
}

}  // namespace palette4d
