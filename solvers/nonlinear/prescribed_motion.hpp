#pragma once

#include <span>
#include <vector>

#include "mechanics/constraints.hpp"
#include "solvers/assembly/level_assembler.hpp"

namespace livetet {

/// Where a body's constrained components are to go: Dirichlet values on the nodes that this rank
/// owns.
class PrescribedMotion {
  public:
    /// The level must outlive this.
    explicit PrescribedMotion(const LevelAssembler& level);

    /// The level has other constraints now: finds their nodes; all values become zero.
    void find_nodes();
    /// Values of all constrained nodes; `constraints`: of the local nodes.
    void set_values(const Constraints& constraints);
    /// New values, m, at local nodes; ghosts and those that are not constrained are passed over.
    void move(std::span<const std::int32_t> nodes, std::span<const Vector3> values);

    /// increment() = value - u at constrained components, zero elsewhere. Collective.
    void find_increment(Vec u);
    Vec increment() const { return increment_.get(); }
    /// u += increment()
    void add_increment(Vec u) const;
    /// Largest component of increment() in size, m: 0 where all are there already, infinity if a
    /// value is not finite. The same on all ranks.
    double increment_size() const { return increment_size_; }

  private:
    const LevelAssembler& level_;
    std::vector<std::int32_t> nodes_;  ///< owned nodes with constrained components
    std::vector<Vector3> values_;      ///< of these, m
    std::vector<std::int32_t> at_;     ///< of each owned node: its place in nodes_, or -1
    PetscHandle<Vec> increment_;
    double increment_size_ = 0;  ///< m
};

}  // namespace livetet
