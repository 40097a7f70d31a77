// A palette and its edit in the form that mvc_kernels.hpp needs.
#pragma once

#include <vector>

#include "recolour/frame_picks.hpp"
#include "recolour/mvc.hpp"
#include "recolour/mvc_kernels.hpp"

namespace palette4d {

/// The memory that a Plan points to.
template <class T>
class PlanMemory {
public:
    PlanMemory(const PaletteBody& body, const std::vector<Vec3>& displacement);
    PlanMemory(const PlanMemory&) = delete;
    PlanMemory& operator=(const PlanMemory&) = delete;

    const Plan<T>& plan() const { return plan_; }
    /// Whether squares and products of the palette's lengths stay within the range of T. True
    /// where no vertex moves: plan() then has no movers, and nothing else.
    bool usable() const { return usable_; }
    std::size_t bytes() const {
        return vector_bytes(vertices_, movers_, edges_, faces_, segments_, triangles_);
    }

private:
    void add_inside(const PaletteBody& body);
    void add_surface(const PaletteBody& body, const std::vector<Vec3>& displacement);

    std::vector<typename Plan<T>::Vertex> vertices_;
    std::vector<typename Plan<T>::Mover> movers_;
    std::vector<typename Plan<T>::Edge> edges_;
    std::vector<typename Plan<T>::Face> faces_;
    std::vector<typename Plan<T>::Segment> segments_;
    std::vector<typename Plan<T>::Triangle> triangles_;
    Plan<T> plan_{};
    bool usable_ = false;
};

extern template class PlanMemory<float>;
extern template class PlanMemory<double>;

/// What scratch memory for kernels is made of: numbers that one register holds at most.
template <class T>
struct alignas(64) ScratchPart {
    T numbers[kStride<T>];
};

/// The plans of one palette and edit in one precision.
template <class T>
struct PlanOf {
    PlanMemory<T> palette;
    PickMemory<T> picks;
};

/// The plans of one palette and edit in both precisions.
struct RecolourPlan {
    RecolourPlan(const PaletteBody& body, const std::vector<Vec3>& displacement,
                 const FramePicks& picks, const std::vector<Vec3>& done)
        : single{{body, displacement}, {picks, done}},
          twofold{{body, displacement}, {picks, done}} {}
    PlanOf<float> single;
    PlanOf<double> twofold;
};

}  // namespace palette4d
