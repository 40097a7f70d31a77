// The node's mode: exact, or by a lattice of which the node says how much it errs.
#include <cmath>
#include <cstring>
#include <set>
#include <thread>
#include <utility>

#include "../../ofx_plugin/node/sidecar_cache.hpp"
#include "harness.hpp"
#include "lattice/lattice.hpp"

using namespace strict;
using namespace test;
using palette4d::Lattice;

namespace {

struct NodeInRows : Ready {
    /// A render in windows of so many rows.
    std::vector<unsigned char> render(const Picture& source, double time, int rows = 1000) {
        Picture output(source.layout());
        const OfxRectI& all = source.layout().bounds;
        for (int y = all.y1; y < all.y2; y += rows) {
            const OfxRectI window = rect(all.x1, y, all.x2, std::min(y + rows, all.y2));
            CHECK(instance->render(time, &source, output, window) == kOfxStatOK);
        }
        return output.pixels(all);
    }
};

enum { kAuto, kExact, kLattice };

/// What the two modes make of a picture; not the same.
auto exact_and_lattice(NodeInRows& node, const Picture& source) {
    node.instance->set("mode", kExact);
    auto exact = node.render(source, 2);
    node.instance->set("mode", kLattice);
    auto lattice = node.render(source, 2);
    CHECK(lattice != exact);
    return std::pair(std::move(exact), std::move(lattice));
}

Layout layout(int channels, Depth depth = Depth::kFloat) {
    Layout made;
    made.bounds = rect(-3, 5, 157, 66);
    made.channels = channels;
    made.depth = depth;
    return made;
}

/// Largest |a - b| / max(|b|, 0.1) of float pixels; those that are no numbers have the same bits.
double difference(const std::vector<unsigned char>& a, const std::vector<unsigned char>& b) {
    double worst = 0;
    CHECK(a.size() == b.size());
    for (std::size_t i = 0; i + 4 <= a.size(); i += 4) {
        float x, y;
        std::memcpy(&x, &a[i], 4);
        std::memcpy(&y, &b[i], 4);
        if (std::memcmp(&x, &y, 4) == 0) continue;
        const double exact = y;
        CHECK(std::isfinite(x) && std::isfinite(y));
        worst = std::max(worst, std::abs(x - exact) / std::max(std::abs(exact), 0.1));
    }
    return worst;
}

}  // namespace

TEST(the_lattice_is_near_the_exact_picture_and_the_same_in_every_tile) {
    NodeInRows node;
    for (const int channels : {3, 4}) {
        Picture source(layout(channels));
        fill(source);
        node.instance->set("mode", kExact);
        const auto exact = node.render(source, 1.25);
        CHECK(exact == recoloured(palette4d::read_sidecar(node.path), 11.25, source,
                                  source.layout().bounds));
        node.instance->set("mode", kLattice);
        const auto lattice = node.render(source, 1.25);
        CHECK(lattice != exact);
        CHECK(difference(lattice, exact) <= Lattice::kTolerance);
        for (const int rows : {1, 7}) CHECK(node.render(source, 1.25, rows) == lattice);
        // Rebuilt after other frames, in another order.
        for (int t = 0; t < 10; ++t) node.render(source, 0.3 + t, 13);
        CHECK(node.plugin.call(kOfxActionPurgeCaches, &node.instance->effect(), nullptr, nullptr) ==
              kOfxStatOK);
        CHECK(node.render(source, 1.25, 5) == lattice);
        // The same road where more is done to the picture afterwards.
        node.instance->set("mix", 0.5);
        const auto mixed = node.render(source, 1.25);
        node.instance->set("mode", kExact);
        const auto exactly_mixed = node.render(source, 1.25);
        CHECK(mixed != exactly_mixed);
        CHECK(difference(mixed, exactly_mixed) <= 2 * Lattice::kTolerance);
        node.instance->set("mix", 1.0);
    }
}

TEST(bytes_are_a_level_off_at_most) {
    NodeInRows node;
    Picture source(layout(4, Depth::kByte));
    fill(source);
    node.instance->set("mode", kExact);
    const auto exact = node.render(source, 3);
    node.instance->set("mode", kLattice);
    const auto lattice = node.render(source, 3);
    int differ = 0;
    for (std::size_t i = 0; i < exact.size(); ++i) {
        CHECK(std::abs(int(exact[i]) - int(lattice[i])) <= 1);
        differ += exact[i] != lattice[i];
    }
    CHECK(differ < static_cast<int>(exact.size()) / 20);
}

TEST(auto_interpolates_only_where_the_host_tells_that_somebody_watches) {
    NodeInRows node;
    Layout tile = layout(4);
    tile.definition = rect(-960, 0, 960, 1080);
    Picture source(tile);
    fill(source);
    const std::map<std::string, Value> watched{{kOfxImageEffectPropInteractiveRenderStatus, 1}},
        draft{{kOfxImageEffectPropRenderQualityDraft, 1}},
        final_render{{kOfxImageEffectPropRenderQualityDraft, 0}};
    const auto [exact, lattice] = exact_and_lattice(node, source);
    node.instance->set("mode", kAuto);
    CHECK(node.render(source, 2) == exact);
    node.instance->extra_arguments = final_render;
    CHECK(node.render(source, 2) == exact);
    for (const auto& arguments : {watched, draft}) {
        node.instance->extra_arguments = arguments;
        CHECK(node.render(source, 2) == lattice);
        node.instance->set("mode", kExact);
        CHECK(node.render(source, 2) == exact);
        // A number that is no option is the default.
        node.instance->set("mode", 7);
        CHECK(node.render(source, 2) == lattice);
        node.instance->set("mode", kAuto);
    }
    // A host that has neither property renders exactly.
    node.instance->extra_arguments.clear();
    Config silent;
    silent.missing_properties = {kOfxImageEffectPropInteractiveRenderStatus,
                                 kOfxImageEffectPropRenderQualityDraft};
    Host::get().configure(silent);
    CHECK(node.render(source, 2) == exact);
    Host::get().configure({});
}

TEST(auto_is_exact_for_pictures_that_the_lattice_is_not_faster_for) {
    NodeInRows node;
    node.instance->extra_arguments = {{kOfxImageEffectPropInteractiveRenderStatus, 1}};
    const auto interpolates = [&](const Layout& shape) {
        Picture source(shape);
        fill(source);
        const auto [exact, lattice] = exact_and_lattice(node, source);
        node.instance->set("mode", kAuto);
        const auto found = node.render(source, 2);
        CHECK(found == exact || found == lattice);
        return found == lattice;
    };
    Layout tile = layout(4);
    CHECK(!interpolates(tile));
    for (const auto& [picture, large] :
         {std::pair{rect(-100, -3, 1819, 1077), false}, std::pair{rect(-100, -3, 1820, 1077), true},
          std::pair{rect(-100, -3, 980, 1916), false}, std::pair{rect(-3, 5, 157, 12964), false},
          std::pair{rect(-3, 5, 157, 12965), true},
          std::pair{rect(-2147483647, -2147483647, 2147483647, 2147483647), true}}) {
        tile.definition = picture;
        CHECK(interpolates(tile) == large);
    }
    // A host that does not tell of the whole picture.
    Config silent;
    silent.missing_properties = {kOfxImagePropRegionOfDefinition};
    Host::get().configure(silent);
    CHECK(!interpolates(tile));
    Host::get().configure({});
    // A whole picture, and the same at half its size, as hosts show it while it plays.
    Layout whole;
    whole.bounds = rect(0, 0, 1920, 1080);
    whole.channels = 3;
    CHECK(interpolates(whole));
    whole.bounds = rect(0, 0, 960, 540);
    whole.scale = 0.5;
    CHECK(!interpolates(whole));
}

TEST(handles_keyframes_and_a_change_of_mode_meet_their_own_lattices) {
    NodeInRows node;
    Picture source(layout(4));
    fill(source);
    const auto each_mode = [&](double time) {
        node.instance->set("mode", kExact);
        const auto exact = node.render(source, time);
        node.instance->set("mode", kLattice);
        const auto lattice = node.render(source, time, 9);
        CHECK(difference(lattice, exact) <= Lattice::kTolerance);
        return std::pair{exact, lattice};
    };
    const auto before = each_mode(2);
    node.instance->set("handle02", Colour{0.9, 0.2, 0.1});
    node.instance->set("handle02On", 1);
    const auto edited = each_mode(2);
    CHECK(edited.first != before.first && edited.second != before.second);
    const auto later = each_mode(6);
    CHECK(later.first != edited.first && later.second != edited.second);
    // Another time of the clip at the same time of the host.
    node.instance->set("frameOffset", 4.0);
    const auto offset = each_mode(2);
    CHECK(offset == later);
    node.instance->set("frameOffset", 0.0);
    node.instance->set("handle02On", 0);
    CHECK(each_mode(2) == before);
    // Outputs that are drawn from the same palette.
    node.instance->set("output", 2);
    each_mode(2);
    node.instance->set("output", 0);
    node.instance->set("strength", 0.35);
    each_mode(2);
    node.instance->set("strength", 1.0);
    for (const int output : {1, 3}) {  // mattes are exact
        node.instance->set("output", output);
        const auto matte = each_mode(2);
        CHECK(matte.first == matte.second);
    }
}

TEST(the_status_says_the_largest_error_of_the_frame_that_is_shown) {
    NodeInRows node;
    Picture source(layout(4));
    fill(source);
    const auto error_said = [&](double time) {
        node.instance->shown_time = time;
        node.instance->changed("mode");
        const std::string text = node.instance->text("status"), words = "largest error measured ";
        const std::size_t at = text.find(words);
        return at == std::string::npos ? -1.0 : std::stod(text.substr(at + words.size()));
    };
    node.instance->set("mode", kLattice);
    CHECK(error_said(4) == -1);  // nothing measured yet
    node.render(source, 4);
    const double said = error_said(4);
    CHECK(said > 0 && said <= Lattice::kTolerance);
    CHECK(error_said(5) == -1);
    node.instance->set("mode", kExact);
    CHECK(error_said(4) == -1);
    // By itself: of a frame that is watched, and not of one that was rendered for good.
    node.instance->set("mode", kAuto);
    Layout tile = layout(4);
    tile.definition = rect(0, 0, 1920, 1080);
    Picture part(tile);
    fill(part);
    node.render(part, 6);
    CHECK(error_said(6) == -1);
    node.instance->extra_arguments = {{kOfxImageEffectPropInteractiveRenderStatus, 1}};
    node.render(part, 6);
    CHECK(error_said(6) > 0 && error_said(6) <= Lattice::kTolerance);
}

TEST(threads_and_tiles_share_a_lattice) {
    const auto loaded = palette4d::node::load_sidecar(sidecar()).loaded;
    CHECK(loaded->ready_lattice_at(12) == nullptr);
    // Kept alive: the address of a second one could not be that of the first.
    std::vector<std::shared_ptr<const Lattice>> seen(8);
    std::vector<std::thread> threads;
    for (auto& one : seen) {
        threads.emplace_back([&] { one = loaded->lattice_at(12); });
    }
    for (std::thread& thread : threads) thread.join();
    CHECK(std::set<std::shared_ptr<const Lattice>>(seen.begin(), seen.end()).size() == 1);
    CHECK(&seen[0]->recolourer() == loaded->recolourer_at(12).get());
    CHECK(loaded->ready_lattice_at(12) == seen[0]);
    // Edits of the host make another one.
    using palette4d::node::AppliedEdits;
    CHECK(loaded->lattice_at(12, AppliedEdits{true, {{3, {1, 0, 0}}}}) != seen[0]);
    // Tiles of as many frames as there is room for, in turn; and what is used in between stays.
    const auto most = static_cast<int>(palette4d::node::LoadedSidecar::most_lattices());
    CHECK(most >= static_cast<int>(std::thread::hardware_concurrency()));
    std::vector<std::shared_ptr<const Lattice>> frames;
    for (int i = 0; i < most; ++i) frames.push_back(loaded->lattice_at(12 + i / 512.0));
    for (int i = most - 1; i >= 0; --i) CHECK(loaded->lattice_at(12 + i / 512.0) == frames[i]);
    CHECK(frames[0] == seen[0]);
    for (int i = 0; i < most; ++i) {
        loaded->lattice_at(14 + i / 512.0);
        CHECK(loaded->lattice_at(12) == seen[0]);
    }
    // Those that were used long ago make room.
    CHECK(loaded->ready_lattice_at(12 + 1 / 512.0) == nullptr);
}
