#pragma once

#include <memory>
#include <span>
#include <vector>

#include "mesh/hierarchy.hpp"
#include "solvers/assembly/level_assembler.hpp"
#include "solvers/linear/coarse_body.hpp"

namespace livetet {

/// Carries constraints and springs of the finest mesh down to the coarser levels of a hierarchy.
class CoarseConstraints {
  public:
    using Levels = std::span<const std::unique_ptr<LevelAssembler>>;

    /// `levels`: all of the hierarchy's. On one rank its transfers must outlive this; of the rest
    /// nothing is kept. Collective.
    CoarseConstraints(const MeshHierarchy& hierarchy, Levels levels);

    /// Between levels l and l + 1.
    const TransferRows& rows(std::size_t l) const { return rows_[l]; }

    /// Tells every level which components are constrained, given those of this rank's own nodes of
    /// the finest (see CoarseBody). Collective.
    void set_constrained(Levels levels, std::span<const std::uint8_t> components);

    /// Tells every level its springs, N/m, given those of this rank's own nodes of the finest: a
    /// coarse node gets from each fine one its share by the interpolation's weight. Empty on all
    /// ranks: none. Collective.
    void set_springs(Levels levels, std::span<const double> stiffness) const;

  private:
    std::vector<TransferRows> rows_;  ///< by the finer level
    std::vector<CoarseBody> bodies_;  ///< by level, from the second
};

}  // namespace livetet
