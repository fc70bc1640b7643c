#pragma once

#include "solvers/linear/coarse_constraints.hpp"
#include "solvers/linear/displacement_solver.hpp"
#include "solvers/linear/matrix_free_level.hpp"
#include "solvers/linear/matrix_preconditioner.hpp"
#include "solvers/linear/scalar_copy.hpp"
#include "solvers/linear/transfer.hpp"

namespace livetet {

/// Conjugate gradients preconditioned by geometric multigrid over the mesh hierarchy (PCMG), with
/// coarse operators that are either assembled on each coarse mesh or Galerkin products P^T A P.
///
/// A cycle smooths by Chebyshev steps on 3x3 block Jacobi. Its coarse equation is solved by
/// `cycles_below` cycles of the next level, accelerated by Chebyshev's polynomial: a plain W-cycle
/// would diverge where a coarse mesh is too soft or too stiff. The polynomial is fixed, so that
/// conjugate gradients stay exact.
///
/// The finest level has no matrix where its kernels can do without (see finest_is_matrix_free and
/// MatrixFreeLevel); its smoother is then in single precision, on the diagonal.
///
/// Coarse levels that do not fit the body (thin branches, poor meshes) make the cycle slow or
/// indefinite. The solves themselves tell (`is_too_slow`, or PETSc's reason why one ended), at no
/// cost to those that go well. Such a solve goes on from where it is with the next of these, which
/// stays: a factorisation where that is affordable, Galerkin products, aggregation. An explicit
/// SolverKind::multigrid allows Galerkin products alone, an explicit CoarseOperator forbids those.
class MultigridSolver : public DisplacementSolver {
  public:
    MultigridSolver(DistributedHierarchy mesh, const ElasticModel& model,
                    const SolverOptions& options, Role role);
    ~MultigridSolver() override;

    /// Whether the finest level goes without a matrix, unless PETSc's options want one: linear or
    /// corotated tets by displacements, with coarse operators of their own.
    static bool finest_is_matrix_free(const ElasticModel& model, const SolverOptions& options);

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

    void make_coarse_levels(DistributedHierarchy& mesh);
    RenewalExtent renew(const Configuration& at, const OperatorTerms& terms,
                        RenewalExtent wanted) override;
    Mat matrix() const override {
        return matrix_free_ ? matrix_free_->matrix() : levels_.front()->matrix();
    }
    void configure(PC pc) override;
    /// Whether PETSc's options ask for another smoother on the finest of so many levels, or for
    /// another preconditioner.
    bool options_want_matrix(std::size_t levels) const;
    /// The finest level's matrix in scalars, for what takes nothing else: made when it is first
    /// asked for where the level goes without.
    Mat scalar_matrix();
    bool has_cycle() const { return matrix_free_ ? !substitute_ : preconditions_by(PCMG); }
    bool change_preconditioner(KSPConvergedReason reason) override;
    enum class Change { none, factorisation, galerkin, aggregation };
    /// What is taken next. Analyses the matrix if it may be factored.
    Change next_change();
    void make_change(Change change);
    bool galerkin_is_left() const {
        return coarse_ == CoarseOperator::rediscretised &&
               asked_coarse_ == CoarseOperator::automatic;
    }
    /// Whether solves end early where the cycle is too slow: there is something else to take.
    bool is_watched() const {
        return is_cycle_ && !substitute_ &&
               (asked_kind_ == SolverKind::automatic || galerkin_is_left());
    }
    std::string cycle_name() const;
    /// Level l and those below it.
    void configure_cycle(PC pc, std::size_t l);
    /// The solver of level l + 1.
    void configure_coarse(KSP coarse, std::size_t l);
    /// Of PETSc's options for a PCMG, those that the cycle of this class overrides.
    void warn_of_idle_options() const;
    void configure_coarsest(KSP coarse, PC pc);
    void set_prefix(KSP ksp, const std::string& name) const;
    Mat level_matrix(std::size_t l) const;
    void assemble_levels(const Configuration& at, const OperatorTerms& terms);
    void form_galerkin_product(std::size_t l);
    void set_level_operators();
    /// Chebyshev's intervals from the largest eigenvalues; false if one was out of range and a
    /// usual value replaces it.
    bool set_bounds();

    SolverKind asked_kind_;
    CoarseOperator asked_coarse_;
    CoarseOperator coarse_;
    int smoothing_steps_;
    std::vector<CoarseLevel> coarse_levels_;  ///< from the second level
    std::optional<CoarseConstraints> constraints_;
    /// Of krylov_, from the finest level down; the first smoother is null if that is matrix-free.
    std::vector<KSP> smoothers_, coarse_solves_;
    PetscHandle<KSP> first_coarse_;  ///< the first of coarse_solves_, of a matrix-free finest level
    std::unique_ptr<MatrixFreeLevel> matrix_free_;  ///< null: the finest level has a matrix
    bool bounds_known_ = false;
    bool is_cycle_ = false;  ///< a solver that PETSc's options leave the cycle configured here
    bool may_be_negative_ = true;                       ///< the operator assembled last
    ScalarCopy scalars_;                                ///< of the finest level
    std::unique_ptr<MatrixPreconditioner> substitute_;  ///< in place of the cycle
    std::string replaced_;  ///< the name before the last change; empty: none
};

}  // namespace livetet
