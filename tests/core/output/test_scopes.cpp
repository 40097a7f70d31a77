// Counts of the scopes where a picture of few pixels gives them; tests/parity compares the rest.
#include "output/scopes.hpp"

#include <numeric>

#include "check.hpp"
#include "images.hpp"

using namespace palette4d;
using images::Image;

namespace {

ScopeCounts counted(const Image& image, int columns, int threads) {
    return count_scopes(image.in(), columns, 1, threads);
}

}  // namespace

TEST(every_pixel_counts_once_in_each_scope) {
    Image image(37, 23, 4);
    for (std::size_t i = 0; i < image.data.size(); ++i) {
        image.data[i] = static_cast<float>(i * 7919 % 1000) / 500 - 0.5F;
    }
    for (const int threads : {1, 4}) {
        const ScopeCounts counts = counted(image, 20, threads);
        CHECK_EQUAL(counts.columns, 20);
        const auto sum = [](const std::vector<std::uint32_t>& all) {
            return std::accumulate(all.begin(), all.end(), 0U);
        };
        CHECK_EQUAL(sum(counts.waveform), 37U * 23U * kScopeTraces);
        CHECK_EQUAL(sum(counts.vectors), 37U * 23U);
        CHECK(counts.waveform == counted(image, 20, 1).waveform);
    }
}
