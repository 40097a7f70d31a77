#include "threads/share_rows.hpp"

#include <atomic>
#include <stdexcept>
#include <vector>

#include "check.hpp"

using namespace palette4d;

TEST(each_number_is_handed_out_once) {
    for (const int count : {0, 1, 3, 1000}) {
        for (const int threads : {0, 1, 2, 40}) {
            std::vector<std::atomic<int>> seen(static_cast<std::size_t>(count));
            share_rows(count, threads, [&](const NextRow& next) {
                for (int i = next(); i >= 0; i = next()) ++seen[static_cast<std::size_t>(i)];
            });
            for (const std::atomic<int>& times : seen) CHECK_EQUAL(times.load(), 1);
        }
    }
}

TEST(the_first_exception_ends_the_work_and_is_thrown_again) {
    std::atomic<int> done{0};
    bool thrown = false;
    try {
        share_rows(1000000, 2, [&](const NextRow& next) {
            for (int i = next(); i >= 0; i = next()) {
                if (i == 100) throw std::runtime_error("row 100");
                ++done;
            }
        });
    } catch (const std::runtime_error&) {
        thrown = true;
    }
    CHECK(thrown);
    CHECK(done < 1000000 - 1);
}
