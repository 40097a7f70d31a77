// The search of gluing (section 5.2.2): which colours of two palettes belong together.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace palette4d {

/// Two palettes of n and m colours (at most 64): matrices in rows. All colours touch or not, in the
/// first palette (n x n) and the second (m x m); `allowed` pairs and their distances are n x m.
struct LinkProblem {
    int n, m;
    std::vector<double> distance;
    std::vector<std::uint8_t> allowed, near_first, near_second;
    std::vector<int> order;  ///< of the n colours, as they choose
    bool strict;             ///< whether topological rule 2 must hold
    double bound;            ///< only shorter solutions count
    double broken_cost;      ///< of a broken rule, if not strict
    int most_nodes;          ///< after so many the best solution so far is returned
};

struct ColourLinks {
    std::vector<std::pair<int, int>> links;  ///< empty without a solution
    int broken = 0;                          ///< edges that break topological rule 2
    bool complete = true;                    ///< whether every solution was seen
};

/// Branch and bound: each colour of the first palette chooses the one to three colours that it
/// links to, so that the sum of all distances is least. Throws std::invalid_argument for arrays of
/// wrong sizes.
ColourLinks find_links(const LinkProblem& problem);

}  // namespace palette4d
