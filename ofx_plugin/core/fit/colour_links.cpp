#include "fit/colour_links.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <tuple>

namespace palette4d {
namespace {

using Colours = std::uint64_t;  // a set: bit u is colour u of the second palette
constexpr int kMostColours = 64;
constexpr int kMostLinks = 3;  // of one colour

/// A set of colours that one colour may link to.
struct Choice {
    double cost;
    std::array<int, kMostLinks> group;  // padded by -1
    int size;
    Colours bits, around;  // the colours, and those with their neighbours
};

void check_problem(const LinkProblem& p) {
    const auto size = [](int a, int b) {
        return static_cast<std::size_t>(a) * static_cast<std::size_t>(b);
    };
    if (p.n < 1 || p.m < 1 || std::max(p.n, p.m) > kMostColours)
        throw std::invalid_argument("found palettes of " + std::to_string(p.n) + " and " +
                                    std::to_string(p.m) + " colours, expected 1 to 64");
    std::vector<int> sorted = p.order;
    std::sort(sorted.begin(), sorted.end());
    bool whole = static_cast<int>(sorted.size()) == p.n;
    for (int i = 0; whole && i < p.n; ++i) whole = sorted[i] == i;
    if (!whole || p.distance.size() != size(p.n, p.m) || p.allowed.size() != size(p.n, p.m) ||
        p.near_first.size() != size(p.n, p.n) || p.near_second.size() != size(p.m, p.m))
        throw std::invalid_argument(
            "links need matrices that fit the palettes and an order of all "
            "colours of the first");
}

class Search {
public:
    explicit Search(const LinkProblem& p)
        : p_(p),
          around_(p.m),
          linked_(p.n, 0),
          choices_(p.n),
          before_(p.n),
          rest_(p.n + 1, 0.0),
          chosen_(p.n, nullptr),
          users_(p.m),
          best_(p.bound) {
        for (int u = 0; u < p.m; ++u) {
            around_[u] = bit(u);
            for (int w = 0; w < p.m; ++w)
                if (near_second(u, w)) around_[u] |= bit(w);
        }
        for (int v = 0; v < p.n; ++v) list_choices(v);
        for (int at = p.n - 1; at >= 0; --at) {
            const int v = p.order[at];
            for (int i = 0; i < at; ++i)
                if (near_first(v, p.order[i])) before_[at].push_back(p.order[i]);
            // The least cost of all later colours.
            rest_[at] =
                rest_[at + 1] + (choices_[v].empty() ? std::numeric_limits<double>::infinity()
                                                     : choices_[v][0].cost);
        }
    }

    ColourLinks run() {
        if (std::isfinite(rest_[0])) descend(0, 0, 0);
        return std::move(found_);
    }

private:
    static Colours bit(int u) { return Colours{1} << u; }
    bool near_first(int v, int w) const { return p_.near_first[v * p_.n + w]; }
    bool near_second(int u, int w) const { return p_.near_second[u * p_.m + w]; }

    /// Lists the sets whose colours all touch (topological rule 1), cheapest first.
    void list_choices(int v) {
        const auto may = [&](int u) { return p_.allowed[v * p_.m + u] != 0; };
        for (int a = 0; a < p_.m; ++a) {
            if (!may(a)) continue;
            add_choice(v, {a, -1, -1}, 1);
            for (int b = a + 1; b < p_.m; ++b) {
                if (!may(b) || !near_second(a, b)) continue;
                add_choice(v, {a, b, -1}, 2);
                for (int c = b + 1; c < p_.m; ++c)
                    if (may(c) && near_second(a, c) && near_second(b, c))
                        add_choice(v, {a, b, c}, 3);
            }
        }
        std::sort(choices_[v].begin(), choices_[v].end(), [](const Choice& a, const Choice& b) {
            return std::tie(a.cost, a.group) < std::tie(b.cost, b.group);
        });
    }

    void add_choice(int v, const std::array<int, kMostLinks>& group, int size) {
        Choice choice{0, group, size, 0, 0};
        for (int i = 0; i < size; ++i) {
            choice.cost += p_.distance[v * p_.m + group[i]];
            choice.bits |= bit(group[i]);
            choice.around |= around_[group[i]];
        }
        choices_[v].push_back(choice);
    }

    bool fits(int v, const Choice& choice) const {
        for (int i = 0; i < choice.size; ++i)
            for (const int w : users_[choice.group[i]]) {
                // Inter-degree rule 2: a merging vertex, whose partners must not split.
                if (choice.size > 1 || chosen_[w]->size > 1) return false;
                if (!near_first(v, w)) return false;  // topological rule 1
            }
        return true;
    }

    /// The number of edges of the second palette that break topological rule 2.
    int broken_back() const {
        int broken = 0;
        for (int a = 0; a < p_.m; ++a)
            for (int b = a + 1; b < p_.m; ++b) broken += near_second(a, b) && !users_touch(a, b);
        return broken;
    }

    bool users_touch(int a, int b) const {
        for (const int v : users_[a])
            for (const int w : users_[b])
                if (v == w || near_first(v, w)) return true;
        return false;
    }

    void descend(int at, double cost, int broken) {
        ++nodes_;
        if (nodes_ > p_.most_nodes &&
            (!found_.links.empty() || nodes_ - p_.most_nodes > p_.most_nodes)) {
            found_.complete = false;
            return;
        }
        if (at == p_.n) return finish(cost, broken);
        const int v = p_.order[at];
        for (const Choice& choice : choices_[v]) {
            if (cost + choice.cost + rest_[at + 1] >= best_) break;
            if (!fits(v, choice)) continue;
            // Topological rule 2 for the edges to the colours that have chosen.
            int wrong = 0;
            for (const int w : before_[at]) wrong += !(choice.around & linked_[w]);
            if (p_.strict && wrong) continue;
            chosen_[v] = &choice;
            linked_[v] = choice.bits;
            for (int i = 0; i < choice.size; ++i) users_[choice.group[i]].push_back(v);
            descend(at + 1, cost + choice.cost + p_.broken_cost * wrong, broken + wrong);
            for (int i = 0; i < choice.size; ++i) users_[choice.group[i]].pop_back();
        }
    }

    void finish(double cost, int broken) {
        for (const std::vector<int>& users : users_)
            if (users.empty()) return;  // inter-degree rule 1
        const int back = broken_back();
        if (p_.strict && back) return;
        const double total = cost + p_.broken_cost * back;
        if (total >= best_) return;
        best_ = total;
        found_.broken = broken + back;
        found_.links.clear();
        for (int v = 0; v < p_.n; ++v)
            for (int i = 0; i < chosen_[v]->size; ++i)
                found_.links.emplace_back(v, chosen_[v]->group[i]);
    }

    const LinkProblem& p_;
    std::vector<Colours> around_, linked_;
    std::vector<std::vector<Choice>> choices_;
    std::vector<std::vector<int>> before_;
    std::vector<double> rest_;
    std::vector<const Choice*> chosen_;
    std::vector<std::vector<int>> users_;  ///< of each colour of the second palette
    double best_;
    int nodes_ = 0;
    ColourLinks found_;
};

}  // namespace

ColourLinks find_links(const LinkProblem& problem) {
    check_problem(problem);
    return Search(problem).run();
}

}  // namespace palette4d
