// The kernel of loss_kernels.hpp for the width that lanes.hpp was included with.

namespace {

void fall(const palette4d::LossFacet* facets, const int* which, int count,
          const double* const* channels, double flat, palette4d::LossLeaf& leaf) {
    using Numbers = Lanes<double>;
    const Numbers zero = all(0.0), one = all(1.0), none = all(-1.0);
    for (int at = 0; at < palette4d::LossLeaf::kSize; at += Numbers::kCount) {
        const Numbers x = load(channels[0] + at), y = load(channels[1] + at),
                      z = load(channels[2] + at);
        Numbers highest = zero, on = none, height = zero, first = zero, second = zero;
        for (int i = 0; i < count; ++i) {
            const palette4d::LossFacet& f = facets[which[i]];
            const auto linear = [&](const double* slope, double start) {
                return ((all(slope[0]) * x + all(slope[1]) * y) + all(slope[2]) * z) + all(start);
            };
            const Numbers h = linear(f.normal, f.offset);
            highest = max(highest, h);
            const LaneMask<double> above = h > all(flat);
            if (!any(above)) continue;
            const Numbers b = linear(f.slope[0], f.start[0]), c = linear(f.slope[1], f.start[1]);
            const LaneMask<double> here =
                above & (b >= zero) & (c >= zero) & (b + c <= one) & (on < zero);
            on = select(here, all(static_cast<double>(which[i])), on);
            height = select(here, h, height);
            first = select(here, b, first);
            second = select(here, c, second);
        }
        store(leaf.highest + at, highest);
        store(leaf.facet + at, on);
        store(leaf.height + at, height);
        store(leaf.share[0] + at, first);
        store(leaf.share[1] + at, second);
    }
}

}  // namespace
