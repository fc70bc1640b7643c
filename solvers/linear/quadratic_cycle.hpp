#pragma once

#include <span>
#include <vector>

#include "solvers/linear/matrix_free_smoother.hpp"
#include "solvers/linear/node_transfer.hpp"
#include "solvers/linear/single_precision_multigrid.hpp"

namespace livetet {

/// A multigrid cycle for tets of ten nodes: a MatrixFreeSmoother on the finest level around a
/// SinglePrecisionMultigrid of the tets with four nodes that they were made from.
class QuadraticCycle {
  public:
    /// All must outlive this. `map` places the nodes of the ten-node tets in those with four;
    /// `linear_level`: the finest of `multigrid`.
    QuadraticCycle(MatrixFreeOperator& fine, LevelAssembler& linear_level,
                   SinglePrecisionMultigrid& multigrid, const BarycentricMap& map,
                   int smoothing_steps, ThreadTeam& team);

    /// Constraints are new.
    void set_constrained() { smoother_.forget_bound(); }
    /// Renews the multigrid below for the displacement of `at`; `fine` was updated before. See
    /// SinglePrecisionMultigrid::update.
    RenewalExtent update(const ElementRotations& at, double s, double m, RenewalExtent wanted);
    /// z = one symmetric V-cycle for A z = r from zero; r and z zero at constrained components.
    void cycle(std::span<const double> r, std::span<double> z);

    double bytes_of_cycle() const {
        return 2 * smoothing_steps_ * fine_.bytes_of_multiply() + multigrid_.bytes_of_cycle();
    }

  private:
    void correct_by_linear_tets();

    MatrixFreeOperator& fine_;
    LevelAssembler& linear_level_;
    SinglePrecisionMultigrid& multigrid_;
    const BarycentricMap& map_;
    TransposedMap restriction_;
    std::vector<std::int32_t> corner_of_;  ///< of each node of four-node tets: the same of the fine
    int smoothing_steps_;
    MatrixFreeSmoother smoother_;
    ThreadTeam& team_;
    ElementRotations linear_rotations_;
    std::vector<float> r_;
    std::vector<double> coarse_r_, coarse_z_;
};

}  // namespace livetet
