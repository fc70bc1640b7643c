#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "solvers/parallel/partitioned_mesh.hpp"

namespace livetet {

/// The displacement increments of the last two steps, newest first: what a linear solve's start is
/// combined from.
class IncrementHistory {
  public:
    void clear() { count_ = 0; }
    void push(Vec increment) {
        for (PetscHandle<Vec>& v : previous_)
            if (!v) LIVETET_PETSC(VecDuplicate(increment, v.out()));
        std::swap(previous_[0], previous_[1]);
        LIVETET_PETSC(VecCopy(increment, previous_[0].get()));
        count_ = std::min(count_ + 1, previous_.size());
        guesses_ = {previous_[0].get(), previous_[1].get()};
    }
    /// Valid until the next push.
    std::span<const Vec> guesses() const { return {guesses_.data(), count_}; }

  private:
    std::array<PetscHandle<Vec>, 2> previous_;
    std::array<Vec, 2> guesses_{};
    std::size_t count_ = 0;
};

}  // namespace livetet
