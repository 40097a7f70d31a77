#include "lattice/palette_regions.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "model/vec3.hpp"

namespace palette4d {
namespace {

/// Largest rounding error of an affine displacement in single precision.
constexpr double kRounding = 2e-5;
/// Displacements that differ by no more than this count as equal.
constexpr float kAlike = 8e-5f;
constexpr std::size_t kMostWalls = PaletteRegions::kMostRegions;

/// base + (p - start) . gradient * change, summed over the gradients.
struct AffineSum {
    Vec3 start;
    PaletteRegions::Affine sum{};
    void add(const Vec3& gradient, const Vec3& change) {
        for (std::size_t c = 0; c < 3; ++c) sum[c + 1] = sum[c + 1] + gradient[c] * change;
        sum[0] = sum[0] - dot(start, gradient) * change;
    }
};

std::size_t index(int i) { return static_cast<std::size_t>(i); }

}  // namespace

struct PaletteRegions::Rooms {
    float centre[kMostWalls], box[kMostWalls];
    std::size_t count;
    Rooms(const Walls& walls, const float* at, float half_width) : count(walls.offset.size()) {
        const float *x = walls.normal[0].data(), *y = walls.normal[1].data(),
                    *z = walls.normal[2].data(), *offset = walls.offset.data(),
                    *reach = walls.reach.data();
        for (std::size_t i = 0; i < count; ++i) {
            centre[i] = x[i] * at[0] + y[i] * at[1] + z[i] * at[2] - offset[i];
            box[i] = half_width * reach[i];
        }
    }
    /// Whether the whole box lies outside one of the walls.
    bool behind_one() const {
        for (std::size_t i = 0; i < count; ++i) {
            if (centre[i] + box[i] < 0) return true;
        }
        return false;
    }
};

struct PaletteRegions::Found {
    static constexpr int kMost = 12;
    int regions[kMost];
    int count = 0;
    const int* begin() const { return regions; }
    const int* end() const { return regions + count; }
    bool has(int region) const { return std::find(begin(), end(), region) != end(); }
};

int PaletteRegions::add_region(const Affine& affine) {
    affine_.push_back(affine);
    for (auto& faces : edge_faces_) faces.push_back(-1);
    edge_choices_.push_back(-1);
    return static_cast<int>(affine_.size()) - 1;
}

int PaletteRegions::add_plane(const Vec3& normal, const Vec3& through, int below, int above) {
    const Vec3 unit = (1 / norm(normal)) * normal;
    planes_.push_back({unit, dot(unit, through), below, above});
    return static_cast<int>(planes_.size()) - 1;
}

std::unique_ptr<const PaletteRegions> PaletteRegions::of(const PaletteBody& body,
                                                         const std::vector<Vec3>& displacement,
                                                         const float* unit, double size) {
    if (!body.convex() || body.flat() || body.faces().empty()) return nullptr;
    std::unique_ptr<PaletteRegions> regions(new PaletteRegions);
    if (!regions->add_surface(body, displacement) || !regions->precise(size)) return nullptr;
    regions->add_walls(unit);
    return regions;
}

bool PaletteRegions::add_surface(const PaletteBody& body, const std::vector<Vec3>& displacement) {
    struct Side {
        int face;
        Vec3 outwards;  ///< in the face's plane
    };
    std::map<std::pair<int, int>, std::vector<Side>> sides;
    add_region({});
    for (std::size_t f = 0; f < body.faces().size(); ++f) {
        if (body.degenerate(f)) return false;
        const Face& face = body.faces()[f];
        const Vec3 &a = body.rgb()[face[0]], &normal = body.normal(f);
        const Vec3 j = body.rgb()[face[1]] - a, k = body.rgb()[face[2]] - a;
        const Vec3 across = cross(j, k);
        const double scale = 1 / dot(across, across);
        AffineSum moved{a, {displacement[face[0]]}};
        moved.add(scale * cross(k, across), displacement[face[1]] - displacement[face[0]]);
        moved.add(scale * cross(across, j), displacement[face[2]] - displacement[face[0]]);
        const int region = add_region(moved.sum);
        add_plane(normal, a, kInside, region);  // number region - 1
        for (std::size_t s = 0; s < 3; ++s) {
            const int from = face[s], to = face[(s + 1) % 3], third = face[(s + 2) % 3];
            const Vec3 side = cross(body.rgb()[to] - body.rgb()[from], normal);
            const bool away = dot(side, body.rgb()[third] - body.rgb()[from]) < 0;
            sides[std::minmax(from, to)].push_back({region, (away ? 1.0 : -1.0) * side});
        }
    }
    std::map<int, int> vertices;
    for (const auto& [ends, two] : sides) {
        const auto [from, to] = ends;
        const Vec3& start = body.rgb()[from];
        const Vec3 along = body.rgb()[to] - start;
        const auto normal_of = [&](const Side& side) { return body.normal(index(side.face) - 1); };
        if (two.size() != 2 || norm(along) <= 0) return false;
        // Coplanar faces too: their edge's region has no width, but boxes across the edge need it.
        AffineSum moved{start, {displacement[from]}};
        moved.add((1 / dot(along, along)) * along, displacement[to] - displacement[from]);
        const int edge = add_region(moved.sum);
        int plane[2];
        for (std::size_t s = 0; s < 2; ++s) {
            plane[s] = add_plane(two[s].outwards, start, two[s].face, edge);
            edge_faces_[s][index(edge)] = two[s].face;
        }
        for (const int end : {from, to}) {
            if (vertices.count(end) == 0) vertices[end] = add_region({displacement[end]});
            add_plane(end == to ? along : -1 * along, body.rgb()[end], edge, vertices[end]);
        }
        // Above the first face: that face, else the edge or the second face. Below it: the inside,
        // or again the edge or the second face.
        const int second = chosen(plane[1]);
        const int first = chosen(add_plane(two[0].outwards, start, two[0].face, second));
        const int below = chosen(add_plane(normal_of(two[1]), start, kInside, second));
        edge_choices_[index(edge)] = add_plane(normal_of(two[0]), start, below, first);
    }
    return count() <= kMostRegions;
}

void PaletteRegions::add_walls(const float* unit) {
    std::copy_n(unit, 3, unit_.begin());
    walls_.resize(count());
    for (std::size_t p = 0; p < planes_.size(); ++p) {
        const Plane& plane = planes_[p];
        if (plane.below < 0 || plane.above < 0) continue;
        for (const bool above : {false, true}) {
            const int region = above ? plane.above : plane.below;
            const int beyond = above ? plane.below : plane.above;
            Walls& walls = walls_[index(region)];
            const double sign = above ? 1 : -1;
            double reach = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                walls.normal[c].push_back(static_cast<float>(sign * plane.normal[c]));
                reach += std::abs(plane.normal[c]) * static_cast<double>(unit[c]);
            }
            walls.offset.push_back(static_cast<float>(sign * plane.offset));
            walls.reach.push_back(static_cast<float>(reach));
            walls.plane.push_back(static_cast<int>(p));
            walls.beyond.push_back(beyond);
        }
    }
}

bool PaletteRegions::precise(double size) const {
    double largest = 0;
    for (const Affine& affine : affine_) {
        for (std::size_t c = 0; c < 3; ++c) {
            double sum = std::abs(affine[0][c]);
            for (std::size_t k = 1; k < 4; ++k) sum += size * std::abs(affine[k][c]);
            largest = std::max(largest, sum);
        }
    }
    constexpr double kFloat = 1.2e-7;
    return largest * kFloat <= kRounding;
}

bool PaletteRegions::alike(int a, int b, const float* centre, float half_width) const {
    const Affine &one = affine_[index(a)], &other = affine_[index(b)];
    for (std::size_t c = 0; c < 3; ++c) {
        double at_centre = one[0][c] - other[0][c], range = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const double slope = one[k + 1][c] - other[k + 1][c];
            at_centre += slope * static_cast<double>(centre[k]);
            range += std::abs(slope) * static_cast<double>(half_width * unit_[k]);
        }
        if (std::abs(at_centre) + range > static_cast<double>(kAlike)) return false;
    }
    return true;
}

bool PaletteRegions::touches_inside(const float* centre, float half_width) const {
    return !Rooms(walls_[kInside], centre, half_width).behind_one();
}

/// Adds the regions that the box touches, starting at `region`. False when there are too many.
bool PaletteRegions::find(int region, const float* centre, float half_width, Found& found) const {
    const Walls& walls = walls_[index(region)];
    const Rooms rooms(walls, centre, half_width);
    if (rooms.behind_one()) return true;
    if (found.count == Found::kMost) return false;
    found.regions[found.count++] = region;
    for (std::size_t i = 0; i < rooms.count; ++i) {
        const int next = walls.beyond[i];
        if (rooms.centre[i] - rooms.box[i] < 0 && !found.has(next) &&
            !find(next, centre, half_width, found)) {
            return false;
        }
    }
    return true;
}

PaletteRegions::Around PaletteRegions::around(const float* centre, float half_width,
                                              int start) const {
    // Steps to the region of the centre, each time across the wall that it violates most.
    constexpr int kMostSteps = 16;
    int region = start;
    for (int step = 0; step < kMostSteps; ++step) {
        const Walls& walls = walls_[index(region)];
        const Rooms rooms(walls, centre, half_width);
        float least = 0;
        std::size_t farthest = 0, crossed = 0;
        int crossings = 0;
        for (std::size_t i = 0; i < rooms.count; ++i) {
            if (rooms.centre[i] < least) {
                least = rooms.centre[i];
                farthest = i;
            }
            if (rooms.centre[i] < rooms.box[i]) {
                ++crossings;
                crossed = i;
            }
        }
        if (least >= 0) return {region, crossings, crossed};
        region = walls.beyond[farthest];
    }
    return {kSeveral, 0, 0};
}

std::size_t PaletteRegions::most_inside(const float* low, float width, int side) const {
    // A row of boxes along blue crosses each wall of the inside once, so the boxes inside all walls
    // are consecutive.
    const Walls& walls = walls_[kInside];
    const double half = width / 2, blue = low[2] + half * unit_[2];
    constexpr double kSlack = 1e-3;  // of a box, for rounding in single precision
    std::size_t most = 0;
    for (int x = 0; x < side; ++x) {
        const double red = low[0] + (2 * x + 1) * half * unit_[0];
        for (int y = 0; y < side; ++y) {
            const double green = low[1] + (2 * y + 1) * half * unit_[1];
            double first = 0, last = side - 1;
            for (std::size_t i = 0; i < walls.offset.size(); ++i) {
                const double room = walls.normal[0][i] * red + walls.normal[1][i] * green +
                                    walls.normal[2][i] * blue - walls.offset[i] +
                                    half * walls.reach[i];
                const double step = walls.normal[2][i] * width * unit_[2];
                const double slack = kSlack * half * walls.reach[i];
                if (step > 0) {
                    first = std::max(first, -(room + slack) / step);
                } else if (step < 0) {
                    last = std::min(last, -(room + slack) / step);
                } else if (room + slack < 0) {
                    last = -1;
                }
            }
            most +=
                static_cast<std::size_t>(std::max(0.0, std::floor(last) - std::ceil(first) + 1));
        }
    }
    return most;
}

bool PaletteRegions::within_two(int region, int other, const float* centre,
                                float half_width) const {
    const Walls& walls = walls_[index(other)];
    const Rooms rooms(walls, centre, half_width);
    for (std::size_t i = 0; i < rooms.count; ++i) {
        if (rooms.centre[i] < rooms.box[i] && walls.beyond[i] != region) return false;
    }
    return true;
}

PaletteRegions::Within PaletteRegions::within(const float* centre, float half_width,
                                              int start) const {
    const Around at_centre = around(centre, half_width, start);
    const int region = at_centre.region;
    if (region == kSeveral) return {kSeveral, -1, touches_inside(centre, half_width)};
    if (at_centre.crossings == 0) return {region, -1, region == kInside};
    const Walls& walls = walls_[index(region)];
    Found found;
    // Boxes across one wall are the most frequent and need no search.
    const int beyond_one = walls.beyond[at_centre.crossed];
    if (at_centre.crossings == 1 && within_two(region, beyond_one, centre, half_width)) {
        found.count = 2;
        found.regions[0] = region;
        found.regions[1] = beyond_one;
    } else if (!find(region, centre, half_width, found)) {
        return {kSeveral, -1, touches_inside(centre, half_width)};
    }
    const bool inside = found.has(kInside);
    const Within neither{kSeveral, -1, inside};
    const auto moves_alike = [&](int other) { return alike(region, other, centre, half_width); };
    if (!inside && std::all_of(found.begin(), found.end(), moves_alike)) {
        return {region, -1, false};
    }
    if (found.count == 2) {
        const auto beyond = std::find(walls.beyond.begin(), walls.beyond.end(), found.regions[1]);
        if (beyond == walls.beyond.end()) return neither;
        const auto wall = static_cast<std::size_t>(beyond - walls.beyond.begin());
        return {region, walls.plane[wall], inside};
    }
    for (const int edge : found) {
        if (edge_choices_[index(edge)] < 0) continue;
        const bool known = std::all_of(found.begin(), found.end(), [&](int other) {
            return other == kInside || other == edge || other == edge_faces_[0][index(edge)] ||
                   other == edge_faces_[1][index(edge)];
        });
        return known ? Within{region, edge_choices_[index(edge)], inside, inside} : neither;
    }
    return neither;
}

}  // namespace palette4d
