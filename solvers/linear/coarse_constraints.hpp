#pragma once

#include <span>
#include <vector>

#include "mesh/hierarchy.hpp"
#include "solvers/assembly/level_assembler.hpp"
#include "solvers/linear/transfer.hpp"

namespace livetet {

/// Carries constraints and springs of the finest mesh down to the coarser levels of a hierarchy.
class CoarseConstraints {
  public:
    /// The hierarchy's transfers must outlive this; the hierarchy itself may be moved.
    explicit CoarseConstraints(const MeshHierarchy& hierarchy);

    /// Tells every level which components are constrained, given those of the finest whole mesh
    /// (see coarse_components).
    void set_constrained(std::span<const std::unique_ptr<LevelAssembler>> levels,
                         std::span<const std::uint8_t> components);
    /// Of a level's whole mesh, as they were set last.
    std::span<const std::uint8_t> components(std::size_t level) const { return components_[level]; }

    /// Tells every level its springs, N/m, given those of the finest whole mesh: a coarse node gets
    /// from each fine one its share by the interpolation's weight. Empty: none.
    void set_springs(std::span<const std::unique_ptr<LevelAssembler>> levels,
                     std::span<const double> stiffness) const;

  private:
    std::vector<const BarycentricMap*> maps_;            ///< by level, from the second
    std::vector<CoarseBody> bodies_;                     ///< by level, from the second
    std::vector<std::vector<std::uint8_t>> components_;  ///< by level
};

}  // namespace livetet
