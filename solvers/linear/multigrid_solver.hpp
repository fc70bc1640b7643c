#pragma once

#include "solvers/linear/coarse_constraints.hpp"
#include "solvers/linear/displacement_solver.hpp"

namespace livetet {

/// Conjugate gradients preconditioned by geometric multigrid over the mesh hierarchy (PCMG), with
/// coarse operators that are either assembled on each coarse mesh or Galerkin products P^T A P.
///
/// A cycle smooths by Chebyshev steps on 3x3 block Jacobi. Its coarse equation is solved by
/// `cycles_below` cycles of the next level, accelerated by Chebyshev's polynomial: a plain W-cycle
/// would diverge where a coarse mesh is too soft or too stiff. The polynomial is fixed, so that
/// conjugate gradients stay exact.
class MultigridSolver : public DisplacementSolver {
  public:
    MultigridSolver(const DistributedHierarchy& mesh, const ElasticModel& model,
                    const SolverOptions& options, Role role);
    ~MultigridSolver() override;

    SolverKind kind() const override { return SolverKind::multigrid; }
    std::string preconditioner_name() const override;
    void set_constrained(std::span<const std::uint8_t> components) override;
    void set_springs(std::span<const double> stiffness) override;
    void find_mass() override;

  private:
    static constexpr int cycles_below = 2;

    /// What a coarse level has beside its assembler.
    struct CoarseLevel {
        std::unique_ptr<Transfer> transfer;  ///< to the next finer level
        PetscHandle<Vec> u;                  ///< its displacement, for its rotations
        ElementRotations rotations;
        PetscHandle<Mat> galerkin;  ///< P^T A P, where that is its operator
    };

    RenewalExtent renew(const Configuration& at, const OperatorTerms& terms,
                        RenewalExtent wanted) override;
    void configure(PC pc) override { configure_cycle(pc, 0); }
    /// Level l and those below it.
    void configure_cycle(PC pc, std::size_t l);
    void configure_coarsest(KSP coarse, PC pc);
    void set_prefix(KSP ksp, const std::string& name) const;
    Mat level_matrix(std::size_t l) const;
    void assemble_levels(const Configuration& at, const OperatorTerms& terms);
    void form_galerkin_product(std::size_t l);
    void set_level_operators();
    /// Chebyshev's intervals from the largest eigenvalues; false if one was out of range and a
    /// usual value replaces it.
    bool set_bounds();

    CoarseOperator coarse_;
    int smoothing_steps_;
    std::vector<CoarseLevel> coarse_levels_;  ///< from the second level
    CoarseConstraints constraints_;
    std::vector<KSP> smoothers_, coarse_solves_;  ///< of krylov_, from the finest level down
    bool bounds_known_ = false;
};

}  // namespace livetet
