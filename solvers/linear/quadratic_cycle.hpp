#pragma once

#include <memory>
#include <span>
#include <vector>

#include "solvers/linear/matrix_free_smoother.hpp"
#include "solvers/linear/node_transfer.hpp"
#include "solvers/linear/single_precision_multigrid.hpp"

namespace livetet {

/// The cycle of tets of ten nodes: a MatrixFreeSmoother on the finest level around the cycle of the
/// tets with four nodes that they were made from.
class QuadraticCycle final : public LiveCycle {
  public:
    /// All but `multigrid` must outlive this. `map` places the nodes of the ten-node tets in those
    /// with four; `linear_level`: the finest of `multigrid`.
    QuadraticCycle(MatrixFreeOperator& fine, LevelAssembler& linear_level,
                   std::unique_ptr<SinglePrecisionMultigrid> multigrid, const BarycentricMap& map,
                   int smoothing_steps, ThreadTeam& team);

    void set_constrained() override { multigrid_->set_constrained(); }
    /// `fine` was updated before. See SinglePrecisionMultigrid::update.
    RenewalExtent update(const ElementRotations& at, double s, double m,
                         RenewalExtent wanted) override;
    void cycle(std::span<const double> r, std::span<double> z) override { apply(r, z); }
    void cycle(std::span<const float> r, std::span<float> z) override { apply(r, z); }

    double bytes_of_update() const override { return multigrid_->bytes_of_update(); }
    double bytes_of_cycle() const override {
        return 2 * smoothing_steps_ * fine_.bytes_of_multiply() + multigrid_->bytes_of_cycle();
    }

  private:
    template <class Scalar>
    void apply(std::span<const Scalar> r, std::span<Scalar> z);
    void correct_by_linear_tets();

    MatrixFreeOperator& fine_;
    LevelAssembler& linear_level_;
    std::unique_ptr<SinglePrecisionMultigrid> multigrid_;
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
