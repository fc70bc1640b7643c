#pragma once

#include <memory>
#include <span>
#include <vector>

#include "solvers/assembly/level_assembler.hpp"
#include "solvers/linear/distributed_hierarchy.hpp"

namespace livetet {

/// Carries constraints and springs of the finest mesh down to the coarser levels of a hierarchy.
class CoarseConstraints {
  public:
    using Levels = std::span<const std::unique_ptr<LevelAssembler>>;

    /// `between`: all of the hierarchy's. On one rank its transfers must outlive this.
    explicit CoarseConstraints(std::vector<DistributedHierarchy::Between> between)
        : between_(std::move(between)) {}

    /// Between levels l and l + 1.
    const TransferRows& rows(std::size_t l) const { return between_[l].rows; }

    /// Tells every level which components are constrained, given those of this rank's own nodes of
    /// the finest (see CoarseBody). Collective.
    void set_constrained(Levels levels, std::span<const std::uint8_t> components);

    /// Tells every level its springs, N/m, given those of this rank's own nodes of the finest: a
    /// coarse node gets from each fine one its share by the interpolation's weight. Empty on all
    /// ranks: none. Collective.
    void set_springs(Levels levels, std::span<const double> stiffness) const;

  private:
    std::vector<DistributedHierarchy::Between> between_;  ///< by the finer level
};

}  // namespace livetet
