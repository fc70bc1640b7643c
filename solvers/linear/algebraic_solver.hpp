#pragma once

#include "solvers/linear/displacement_solver.hpp"

namespace livetet {

/// Conjugate gradients on the finest mesh alone, preconditioned by what needs no coarser mesh:
/// BoomerAMG, GAMG, a factorisation (MUMPS), or what PETSc's options say.
class AlgebraicSolver : public DisplacementSolver {
  public:
    /// `kind`: boomeramg, gamg, direct or petsc.
    AlgebraicSolver(const DistributedHierarchy& mesh, const ElasticModel& model, SolverKind kind,
                    Role role);

    SolverKind kind() const override { return kind_; }
    void set_constrained(std::span<const std::uint8_t> components) override;
    void set_springs(std::span<const double> stiffness) override;

  private:
    RenewalExtent renew(const Configuration& at, const OperatorTerms& terms,
                        RenewalExtent wanted) override;
    void configure(PC pc) override;

    SolverKind kind_;
};

}  // namespace livetet
