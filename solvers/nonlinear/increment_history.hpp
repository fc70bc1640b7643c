#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "solvers/linear/linear_solver.hpp"

namespace livetet {

/// The increments of the last two steps, newest first: what a linear solve's start is combined
/// from.
class IncrementHistory {
  public:
    void clear() { count_ = 0; }
    /// `dp`: of the pressures; null in the displacement form.
    void push(Vec du, Vec dp) {
        keep(previous_, du);
        if (dp) keep(previous_p_, dp);
        count_ = std::min(count_ + 1, previous_.size());
        for (std::size_t i = 0; i < guesses_.size(); ++i)
            guesses_[i] = {previous_[i].get(), dp ? previous_p_[i].get() : nullptr};
    }
    /// Valid until the next push.
    std::span<const Unknowns> guesses() const { return {guesses_.data(), count_}; }

  private:
    using Previous = std::array<PetscHandle<Vec>, 2>;
    static void keep(Previous& previous, Vec increment) {
        for (PetscHandle<Vec>& v : previous)
            if (!v) LIVETET_PETSC(VecDuplicate(increment, v.out()));
        std::swap(previous[0], previous[1]);
        LIVETET_PETSC(VecCopy(increment, previous[0].get()));
    }

    Previous previous_, previous_p_;
    std::array<Unknowns, 2> guesses_{};
    std::size_t count_ = 0;
};

}  // namespace livetet
