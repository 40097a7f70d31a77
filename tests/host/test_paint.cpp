// The Paint context: the host's brush says where the grade shows.
#include <algorithm>
#include <cmath>

#include "harness.hpp"

using namespace strict;
using namespace test;

namespace {

Layout brush_layout(Depth depth, const OfxRectI& bounds) {
    Layout layout;
    layout.channels = 1;
    layout.depth = depth;
    layout.bounds = bounds;
    layout.padding = 4;
    return layout;
}

}  // namespace

TEST(the_grade_shows_where_the_brush_is) {
    Shown node(sidecar(), kOfxImageEffectContextPaint);
    for (const Layout& layout : layouts()) {
        const OfxRectI& b = layout.bounds;
        const Picture source = source_of(layout);
        const auto from = floats(layout, source.pixels(b));
        const auto graded = floats(layout, recoloured(node.parsed, 13, source, b));
        for (const Depth depth : kDepths) {
            // Smaller than the picture: outside of it there is no brush.
            const Layout strokes =
                brush_layout(depth, rect(b.x1 + 4, b.y1 - 3, b.x2 + 5, b.y2 - 6));
            Picture brush(strokes);
            std::vector<float> shares(from.size() / static_cast<std::size_t>(layout.channels), 0);
            for (int y = strokes.bounds.y1; y < strokes.bounds.y2; ++y) {
                for (int x = strokes.bounds.x1; x < strokes.bounds.x2; ++x) {
                    const float share = static_cast<float>((x * 5 + y * 3) % 9 + 9) / 16 - 0.1f;
                    const auto bytes = stored(strokes, {x % 4 ? share : 1.0f});
                    std::copy(bytes.begin(), bytes.end(), brush.at(x, y));
                    if (x >= b.x2 || y < b.y1) continue;
                    shares[static_cast<std::size_t>((y - b.y1) * layout.width() + x - b.x1)] =
                        std::min(1.0f, std::max(0.0f, floats(strokes, bytes)[0]));
                }
            }
            node.instance->brush = &brush;
            Picture output(layout);
            CHECK(node.instance->render(3, &source, output, b) == kOfxStatOK);
            const auto found = floats(layout, output.pixels(b));
            double worst = 0;
            for (std::size_t i = 0; i < found.size(); ++i) {
                if (!(std::abs(from[i]) < 100) || !(std::abs(graded[i]) < 100)) continue;
                const double share = shares[i / static_cast<std::size_t>(layout.channels)];
                const double wanted = from[i] + share * (graded[i] - from[i]);
                // Integers do not tell what lies beyond them.
                const bool integers = layout.depth == Depth::kByte || layout.depth == Depth::kShort;
                if (integers && (graded[i] == 0 || graded[i] == 1)) continue;
                const double limit = 2 * rounding(layout.depth, std::max(1.0, std::abs(wanted)));
                worst = std::max(worst, std::abs(found[i] - wanted) - limit);
            }
            EXPECT(worst <= 1e-5, "off by " + std::to_string(worst));
            CHECK(output.pixels(b) != source.pixels(b));
        }
    }
}

TEST(without_a_brush_nothing_is_painted) {
    Shown node(sidecar(), kOfxImageEffectContextPaint);
    CHECK(node.render(3) == node.unchanged());
    // In any other context a brush is nothing.
    Shown filter;
    Picture brush(brush_layout(Depth::kFloat, filter.layout.bounds), 0);
    filter.instance->brush = &brush;
    CHECK(filter.render(3) == filter.edited(13));
}
