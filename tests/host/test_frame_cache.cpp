// What is prepared for a frame is prepared once, whoever asks and however often. Sees the node's
// cache from inside: the bundle itself shows no more than its pictures.
#include <atomic>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "../../ofx_plugin/node/sidecar_cache.hpp"
#include "harness.hpp"

using palette4d::Recolourer;
using palette4d::node::load_sidecar;
using palette4d::node::LoadedSidecar;
using palette4d::node::SidecarResult;

TEST(threads_and_tiles_share_what_is_prepared_for_a_frame) {
    const std::string path = test::sidecar();
    constexpr int kThreads = 8, kTiles = 50, kFrames = 5;
    // Kept alive: the address of a second one built for a frame could not be that of the first.
    std::vector<std::shared_ptr<const Recolourer>> seen[kThreads][kFrames];
    std::atomic<int> ready{0};
    std::vector<std::thread> threads;
    for (int t = 0; t < kThreads; ++t) {
        threads.emplace_back([&, t] {
            for (++ready; ready < kThreads;) std::this_thread::yield();
            for (int tile = 0; tile < kTiles; ++tile) {
                for (int f = 0; f < kFrames; ++f) {
                    const SidecarResult result = load_sidecar(path);
                    if (!result.loaded) return;
                    seen[t][f].push_back(result.loaded->recolourer_at(11.25 + f));
                }
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    std::set<const Recolourer*> all;
    for (int f = 0; f < kFrames; ++f) {
        std::set<const Recolourer*> built;
        for (int t = 0; t < kThreads; ++t) {
            CHECK(seen[t][f].size() == kTiles);
            for (const auto& recolourer : seen[t][f]) built.insert(recolourer.get());
        }
        EXPECT(built.size() == 1, "prepared " + std::to_string(built.size()) + " times, not once");
        all.insert(built.begin(), built.end());
    }
    // Edits of the host are of a frame's essence, whichever way they were put together.
    using palette4d::node::AppliedEdits;
    const auto loaded = load_sidecar(path).loaded;
    const auto red = loaded->recolourer_at(11.25, AppliedEdits{true, {{3, {1, 0, 0}}}});
    CHECK(red == loaded->recolourer_at(11.25, AppliedEdits{true, {{3, {1, 0, 0}}}}));
    std::set<const Recolourer*> different = {red.get(), seen[0][0][0].get()};
    for (const AppliedEdits& edits :
         {AppliedEdits{false, {}}, AppliedEdits{false, {{3, {1, 0, 0}}}},
          AppliedEdits{true, {{4, {1, 0, 0}}}}, AppliedEdits{true, {{3, {1, 0, 1e-9}}}},
          AppliedEdits{true, {{3, {1, 0, 0}}, {4, {1, 0, 0}}}}}) {
        different.insert(loaded->recolourer_at(11.25, edits).get());
    }
    CHECK(different.size() == 7);
    CHECK(loaded->recolourer_at(11.25) == seen[0][0][0]);
    // Frames do not share, and a purge forgets.
    CHECK(all.size() == kFrames);
    palette4d::node::purge_sidecars();
    CHECK(load_sidecar(path).loaded->recolourer_at(11.25).get() != seen[0][0][0].get());
}

TEST(frames_with_many_picks_are_dropped_by_their_bytes) {
    std::string picks;
    for (int i = 0; i < 100; ++i) {
        picks += std::string(i ? "," : "") + "{\"id\": \"q" + std::to_string(i) +
                 "\", \"kind\": \"pick\", \"frame\": 12, \"rgb\": [0.75, 0.25, 0.25], \"to\": [0." +
                 std::to_string(100 + i) + ", 0.5, 0.75]}";
    }
    std::string text = test::sidecar_text();
    text.insert(text.find("\"edits\": {") + 10, "\"picks\": [" + picks + "], ");
    // Two files: all sidecars of the process share the memory.
    const auto one = load_sidecar(test::write("one.p4d.json", text)).loaded;
    const auto two = load_sidecar(test::write("two.p4d.json", text + "\n")).loaded;
    CHECK(one && two && one != two);
    std::vector<std::weak_ptr<const Recolourer>> seen;
    const std::size_t mattes = 100 * palette4d::MatteGrid::kSize * sizeof(float);
    for (int i = 0; i < 12; ++i) {
        const auto made = (i % 2 ? one : two)->recolourer_at(10 + 0.5 * i);
        CHECK(made->picks().picks.size() == 100);
        CHECK(made->bytes() >= mattes);
        seen.push_back(made);
    }
    std::size_t kept = 0;
    for (const auto& frame : seen) {
        if (const auto alive = frame.lock()) kept += alive->bytes();
    }
    test::figure(std::to_string(kept >> 20) + " MiB of frames kept");
    EXPECT(kept <= palette4d::node::kMaxKeptBytes, std::to_string(kept) + " bytes are kept");
    // The last ones are still there.
    CHECK(two->recolourer_at(15) == seen[10].lock());
    CHECK(one->recolourer_at(15.5) == seen[11].lock());
}
