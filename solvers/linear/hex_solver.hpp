#pragma once

#include "solvers/linear/displacement_solver.hpp"
#include "solvers/linear/hex_multigrid.hpp"

namespace livetet {

/// Conjugate gradients for a grid of hexahedra around nested multigrid, without a matrix: the
/// finest operator is the law's tangent at the quadrature points, or for small strain the
/// multigrid's own. The multigrid is that of Hooke's law turned by each cell's rotation, in the
/// mixed form (see LevelAssembler) with each cell's own dilation. On one rank.
class HexSolver : public DisplacementSolver {
  public:
    /// Throws Error for an explicit kind other than multigrid, or for several ranks.
    HexSolver(DistributedHierarchy mesh, const ElasticModel& model, const SolverOptions& options);

    SolverKind kind() const override { return SolverKind::multigrid; }
    std::string preconditioner_name() const override;
    int level_count() const override { return static_cast<int>(multigrid_->level_count()); }
    void set_constrained(std::span<const std::uint8_t> components) override;
    void set_springs(std::span<const double> stiffness) override;

    /// The operator and its preconditioner, on the displacements' components.
    void multiply(std::span<const double> x, std::span<double> y);
    void cycle(std::span<const double> r, std::span<double> z) { multigrid_->cycle(r, z); }

  private:
    RenewalExtent renew(const Configuration& at, const OperatorTerms& terms,
                        RenewalExtent wanted) override;
    void configure(PC pc) override;
    bool change_preconditioner(KSPConvergedReason reason) override {
        return reason == KSP_DIVERGED_INDEFINITE_PC && multigrid_->take_surer_bounds();
    }
    Mat matrix() const override { return shell_.get(); }

    std::unique_ptr<HexMultigrid> multigrid_;
    PetscHandle<Mat> shell_;
    Configuration at_;
    OperatorTerms terms_;
    std::vector<double> diagonal_;  ///< mass and springs of each node, N/m; empty: none
};

}  // namespace livetet
