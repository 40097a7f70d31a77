// What is prepared for a frame is prepared once, whoever asks and however often. Sees the node's
// cache from inside: the bundle itself shows no more than its pictures.
#include <atomic>
#include <set>
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
