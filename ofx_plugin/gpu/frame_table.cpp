#include "gpu/frame_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "gpu/convert_table.hpp"
#include "gpu/kernel/layout.inc"
#include "model/vec3.hpp"
#include "output/clean_up_kernels.hpp"
#include "recolour/recolour.hpp"
#include "recolour/recolour_plan.hpp"

namespace palette4d::gpu {
namespace {

/// x rounded to T, and the remainder rounded to T.
template <class T>
void split(double x, T& high, T& low) {
    // volatile: when GCC 12 vectorises this, it drops the rounding to float, and the remainder is
    // 0.
    const volatile T rounded = static_cast<T>(x);
    high = rounded;
    low = static_cast<T>(x - static_cast<double>(high));
}

/// Colours are pulled in to this, times the palette's largest number above 1.
constexpr float kReach = 1e4f;

class Writer {
public:
    explicit Writer(std::vector<float>& to) : to_(to) {}
    void number(double value) { to_.push_back(static_cast<float>(value)); }
    void vector(const Vec3& value) {
        for (const double v : value) number(v);
    }
    /// Positions, then what their rounding left over.
    void exact(std::initializer_list<Vec3> positions) {
        std::vector<float> rest;
        for (const Vec3& position : positions) {
            for (const double v : position) {
                float high, low;
                split(v, high, low);
                to_.push_back(high);
                rest.push_back(low);
            }
        }
        to_.insert(to_.end(), rest.begin(), rest.end());
    }

private:
    std::vector<float>& to_;
};

int add_faces(const PaletteBody& body, const std::vector<Vec3>& moved, Writer& to) {
    if (body.flat()) return 0;
    int count = 0;
    for (std::size_t f = 0; f < body.faces().size(); ++f) {
        if (body.degenerate(f)) continue;
        ++count;
        const Face& face = body.faces()[f];
        std::array<Vec3, 3> at{};
        for (std::size_t k = 0; k < 3; ++k) at[k] = body.rgb()[face[k]];
        to.exact({at[0], at[1], at[2]});
        for (std::size_t k = 0; k < 3; ++k) to.vector(moved[face[k]]);
        to.vector(body.normal(f));
        to.number(norm(cross(at[1] - at[0], at[2] - at[0])));
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 side = at[(k + 2) % 3] - at[(k + 1) % 3];
            to.number(dot(side, side));
        }
    }
    return count;
}

int add_triangles(const PaletteBody& body, const std::vector<Vec3>& moved, Writer& to) {
    int count = 0;
    for (const std::size_t f : body.skin()) {
        if (body.degenerate(f)) continue;
        ++count;
        const Face& face = body.faces()[f];
        const Vec3& start = body.rgb()[face[0]];
        const Vec3 j = body.rgb()[face[1]] - start, k = body.rgb()[face[2]] - start;
        const Vec3 normal = cross(j, k);
        const double scale = 1 / dot(normal, normal);
        to.exact({start});
        to.vector(std::sqrt(scale) * normal);
        to.vector(scale * cross(k, normal));
        to.vector(scale * cross(normal, j));
        to.vector(moved[face[0]]);
        to.vector(moved[face[1]] - moved[face[0]]);
        to.vector(moved[face[2]] - moved[face[0]]);
    }
    return count;
}

int add_segments(const PaletteBody& body, const std::vector<Vec3>& moved, Writer& to) {
    std::set<std::pair<int, int>> sides;
    if (body.faces().empty()) sides.insert({0, static_cast<int>(body.rgb().size()) - 1});
    for (const std::size_t f : body.skin()) {
        const Face& face = body.faces()[f];
        for (std::size_t s = 0; s < 3; ++s) sides.insert(std::minmax(face[s], face[(s + 1) % 3]));
    }
    for (const auto& [a, b] : sides) {
        const Vec3 along = body.rgb()[b] - body.rgb()[a];
        const double length2 = dot(along, along);
        to.exact({body.rgb()[a]});
        to.vector(along);
        to.number(length2 > 0 ? 1 / length2 : 0.0);
        to.vector(moved[a]);
        to.vector(moved[b] - moved[a]);
    }
    return static_cast<int>(sides.size());
}

constexpr int kNodes[3] = {MatteGrid::kSaturations, MatteGrid::kSaturations,
                           MatteGrid::kLightnesses};

/// Adds the part of a matte that is not `idle` to the grids, and where it is to the table.
void add_grid(const FrameMatte& matte, float idle, Writer& to, std::vector<float>& grids) {
    int first[3] = {kNodes[0], kNodes[1], kNodes[2]}, last[3] = {-1, -1, -1};
    std::size_t at = 0;
    for (int u = 0; u < kNodes[0]; ++u) {
        for (int v = 0; v < kNodes[1]; ++v) {
            for (int l = 0; l < kNodes[2]; ++l, ++at) {
                if (matte[at] == idle) continue;
                const int node[3] = {u, v, l};
                for (int c = 0; c < 3; ++c) {
                    first[c] = std::min(first[c], node[c]);
                    last[c] = std::max(last[c], node[c]);
                }
            }
        }
    }
    constexpr double kEndless = std::numeric_limits<float>::max();
    double low[3], high[3];
    for (int c = 0; c < 3; ++c) {
        // A node's value reaches to its neighbours, and beyond the grid without end.
        const double per = c == 2 ? MatteGrid::kPerLightness : MatteGrid::kPerSaturation;
        const double start = c == 2 ? 0 : -MatteGrid::kMost;
        low[c] = first[c] == 0 ? -kEndless : start + (first[c] - 1) / per;
        high[c] = last[c] == kNodes[c] - 1 ? kEndless : start + (last[c] + 1) / per;
        if (last[0] < 0) {  // nothing to read: no point is within
            low[c] = kEndless;
            high[c] = -kEndless;
            first[c] = last[c] = 1;
        }
        first[c] = std::max(first[c] - 1, 0);
        last[c] = std::min(last[c] + 1, kNodes[c] - 1);
    }
    for (const double value : low) to.number(value);
    for (const double value : high) to.number(value);
    to.number(static_cast<double>(grids.size()));
    for (const int node : first) to.number(node);
    for (int c = 0; c < 3; ++c) to.number(last[c] - first[c] + 1);
    for (int u = first[0]; u <= last[0]; ++u) {
        for (int v = first[1]; v <= last[1]; ++v) {
            const float* const line = &matte[MatteGrid::index(u, v, first[2])];
            grids.insert(grids.end(), line, line + (last[2] - first[2] + 1));
        }
    }
}

/// Adds a pick's window: its sides and 1 / its feather, in pixels of the window that is drawn. That
/// across is negative if the window is inverted.
void add_window(const std::optional<FrameWindow>& window, const FramePicks& picks,
                const CleanUp::Place* place, Writer& to) {
    if (!window || !place) {
        constexpr double kFar = 1e15;
        for (const double value : {-kFar, -kFar, kFar, kFar, 1.0, 1.0}) to.number(value);
        return;
    }
    const ImagePlace at = image_place(place->clip, place->drawn.x1, place->drawn.y1, 1, picks);
    const auto x = [&](float side) { return side / at.width - static_cast<double>(at.column); };
    const auto y = [&](float side) { return static_cast<double>(at.row) + 1 - side / at.height; };
    const auto& [left, top, right, bottom] = window->box;
    const double across = at.width / window->feather * (window->inverted ? -1 : 1);
    for (const double value :
         {x(left), y(bottom), x(right), y(top), across, at.height / window->feather}) {
        to.number(value);
    }
}

void add_picks(const Recolourer& map, const CleanUp::Place* place, FrameTable& result) {
    const FramePicks& picks = map.picks();
    const PickPlan<float> plan = map.plan().single.picks.plan();
    std::vector<float>& table = result.table;
    Writer to(table);
    const auto here = [&] { return static_cast<float>(table.size()); };
    if (picks.left) {
        table[P4D_PICKS + 2] = here();
        add_grid(*picks.left, 1, to, result.grids);
    }
    table[P4D_PICKS] = static_cast<float>(picks.picks.size());
    table[P4D_PICKS + 1] = here();
    for (std::size_t i = 0; i < picks.picks.size(); ++i) {
        add_grid(*picks.picks[i].matte, 0, to, result.grids);
        const PickPlan<float>::One& one = plan.picks[i];
        const float values[] = {one.at[0],    one.at[1],     one.at[2],     one.along[0],
                                one.along[1], one.plain,     one.dark,      one.bright,
                                one.strength, one.change[0], one.change[1], one.change[2],
                                one.light,    one.shade};
        table.insert(table.end(), std::begin(values), std::end(values));
        add_window(picks.picks[i].window, picks, place, to);
    }
    if (plan.display) {
        table[P4D_DISPLAY] = static_cast<float>(plan.display_count);
        table[P4D_DISPLAY + 1] = static_cast<float>(result.grids.size());
        table[P4D_DISPLAY + 2] = plan.display_from;
        table[P4D_DISPLAY + 3] = plan.display_scale;
        result.grids.insert(result.grids.end(), plan.display, plan.display + plan.display_count);
    }
}

void add_cells(const CleanUp::Place& place, double amount, FrameTable& result) {
    static_assert(P4D_NOISE == static_cast<float>(kCleanUpNoise) && kCleanUpReach == 2 &&
                  P4D_FAINT == kCleanUpFaint && P4D_MOST == kCleanUpMost);
    const CleanUpCells cells = clean_up_cells(place);
    result.columns = cells.column2 - cells.column1;
    result.rows = cells.row2 - cells.row1;
    if (result.columns <= 0 || result.rows <= 0) {
        result.columns = result.rows = 0;
        return;
    }
    const auto offset = [](std::int64_t from, std::int64_t to) {
        return static_cast<double>(to - from);
    };
    const Area &window = place.drawn, &picture = place.picture, &source = cells.source;
    result.table[P4D_CLEAN] = static_cast<float>(amount);
    const double numbers[] = {
        static_cast<double>(result.columns),
        static_cast<double>(result.rows),
        static_cast<double>(place.cell_width),
        static_cast<double>(place.cell_height),
        offset(picture.x1 + std::int64_t{cells.column1} * place.cell_width, window.x1),
        offset(picture.y1 + std::int64_t{cells.row1} * place.cell_height, window.y1),
        offset(window.x1, source.x1),
        offset(window.y1, source.y1),
        offset(window.x1, source.x2),
        offset(window.y1, source.y2)};
    float* to = &result.table[P4D_CELLS];
    for (const double value : numbers) *to++ = static_cast<float>(value);
}

/// What moves colours: the edit, or a matte's reader. Null where nothing does.
const Recolourer* map_of(const Drawing& drawing) {
    const Recolourer* const map =
        drawing.options.is_matte() ? drawing.reader.get() : drawing.edit.get();
    return map && map->moves() ? map : nullptr;
}

/// Whether squares and products of the palette's lengths stay within single precision.
bool fits(const Recolourer& map) {
    constexpr double kRoom = 1e6;
    double size = 0;
    for (const std::vector<Vec3>* all : {&map.body().rgb(), &map.displacement()}) {
        for (const Vec3& value : *all) {
            for (const double v : value) size = std::max(size, std::abs(v));
        }
    }
    const bool point = map.body().rgb().size() == 1;
    return size < kRoom && (point || map.body().extent() > 1 / kRoom);
}

std::size_t table_size(const Recolourer& map) {
    const PaletteBody& body = map.body();
    const std::size_t faces = body.faces().size(), edges = faces * 3 / 2 + 1;
    return P4D_HEAD + faces * (P4D_FACE + P4D_TRIANGLE) + edges * P4D_SEGMENT +
           map.picks().picks.size() * P4D_PICK + P4D_GRID;
}

}  // namespace

std::string lacks(const Drawing& drawing) {
    const DrawingOptions& options = drawing.options;
    if (options.output == Output::kPalette) return "the palette in the picture";
    const Recolourer* const map = map_of(drawing);
    if (!map) return "";
    if (!fits(*map)) return "a palette beyond single precision";
    std::size_t size = table_size(*map);
    if (drawing.conversion) {
        if (!fits(*drawing.conversion)) return "a conversion beyond single precision";
        size += table_size(*drawing.conversion);
    }
    return size > kMostTable ? "a palette of that many handles" : "";
}

std::size_t FrameTable::scratch() const {
    return P4D_PLANES * static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
}

FrameTable frame_table(const Drawing& drawing, bool premultiplied, const CleanUp::Place* place) {
    const DrawingOptions& options = drawing.options;
    FrameTable result;
    std::vector<float>& table = result.table;
    result.grids.push_back(0);
    table.assign(P4D_HEAD, 0.0f);
    table[P4D_MODE] = options.output == Output::kOutside ? 2.0f : options.is_matte() ? 1.0f : 0.0f;
    table[P4D_STRENGTH] = static_cast<float>(options.strength);
    table[P4D_PREMULTIPLIED] = premultiplied ? 1.0f : 0.0f;
    table[P4D_KEEP] = static_cast<float>(options.keep);
    for (std::size_t c = 0; c < 3; ++c) {
        table[P4D_KEEP + 1 + c] = static_cast<float>(options.lightness[c]);
    }
    table[P4D_REACH] = kReach;
    table[P4D_MIX] = static_cast<float>(options.mix);
    table[P4D_MATTE] = options.in_alpha ? 1.0f : 0.0f;
    table[P4D_MATTE + 1] = static_cast<float>(1 / options.reach);
    const Recolourer* const map = map_of(drawing);
    if (!map) return result;
    const PaletteBody& body = map->body();
    if (map->palette_moves()) {
        Writer to(table);
        const int faces = add_faces(body, map->displacement(), to);
        const int triangles = add_triangles(body, map->displacement(), to);
        const int segments = add_segments(body, map->displacement(), to);
        table[P4D_FACES] = static_cast<float>(faces);
        table[P4D_TRIANGLES] = static_cast<float>(triangles);
        table[P4D_SEGMENTS] = static_cast<float>(segments);
        table[P4D_CONVEX] = body.convex() ? 1.0f : 0.0f;
        for (std::size_t c = 0; c < 3; ++c) {
            const auto smaller = [c](const Vec3& a, const Vec3& b) { return a[c] < b[c]; };
            const auto [low, high] =
                std::minmax_element(body.rgb().begin(), body.rgb().end(), smaller);
            table[P4D_LOW + c] = static_cast<float>((*low)[c]);
            table[P4D_HIGH + c] = static_cast<float>((*high)[c]);
            for (const double end : {(*low)[c], (*high)[c]}) {
                table[P4D_REACH] =
                    std::max(table[P4D_REACH], kReach * static_cast<float>(std::abs(end)));
            }
        }
    }
    add_picks(*map, place, result);
    if (drawing.conversion) add_conversion(*drawing.conversion, result);
    if (place && cleaned_map(drawing)) add_cells(*place, options.clean_up, result);
    return result;
}

}  // namespace palette4d::gpu
