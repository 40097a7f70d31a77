// A lattice whose making runs out of memory, once, at each allocation in turn: nothing of it is
// waited for afterwards, and its picture is right.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <new>

#include "check.hpp"
#include "images.hpp"
#include "lattice/lattice.hpp"
#include "shapes.hpp"

namespace {

std::atomic<long> g_left{-1};  ///< allocations until the one that fails

}  // namespace

// Not inlined: compilers that see one of a pair alone take the two for strangers.
[[gnu::noinline]] void* operator new(std::size_t bytes) {
    if (g_left > 0 && --g_left == 0) {
        g_left = -1;
        throw std::bad_alloc();
    }
    if (void* const memory = std::malloc(bytes ? bytes : 1)) return memory;
    throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

using namespace palette4d;
using namespace images;
using namespace shapes;

namespace {

/// How many allocations there are, all of which were refused once.
int refuse_each(const Mesh& mesh) {
    Random random(3);
    std::vector<Vec3> colours = mesh.rgb;
    for (Vec3& colour : colours) colour[0] += 0.1 * random.uniform();
    colours[0][1] += 0.3;
    const auto recolourer = std::make_shared<const Recolourer>(mesh.rgb, colours, mesh.faces);
    Image image(64, 10, 3);
    for (float& value : image.data) value = static_cast<float>(random.uniform(0, 1));
    Image expected(64, 10, 3), found(64, 10, 3);
    recolourer->apply(image.in(), expected.out(), {});
    for (int refused = 1;; ++refused) {
        const Lattice lattice(recolourer);
        g_left = refused;
        bool thrown = false;
        try {
            lattice.apply(image.in(), found.out(), {});
        } catch (const std::bad_alloc&) {
            thrown = true;
        }
        if (g_left > 0) {  // there were fewer
            g_left = -1;
            return refused - 1;
        }
        if (thrown) lattice.apply(image.in(), found.out(), {});
        double worst = 0;
        for (std::size_t i = 0; i < found.data.size(); ++i) {
            const double exact = expected.data[i];
            worst =
                std::max(worst, std::abs(found.data[i] - exact) / std::max(std::abs(exact), 0.1));
        }
        CHECK(worst <= Lattice::kTolerance);
    }
}

}  // namespace

TEST(what_a_refused_allocation_leaves_undone_is_computed_exactly) {
    Random random(3);
    CHECK(refuse_each(random_convex(random, 9)) > 40);
    CHECK(refuse_each(tetrahedron()) > 40);
}

int main() { return check::run_all(); }
