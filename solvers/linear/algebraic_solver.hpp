#pragma once

#include "solvers/linear/displacement_solver.hpp"

namespace livetet {

/// Conjugate gradients on the finest mesh alone, preconditioned by what needs no coarser mesh:
/// BoomerAMG, GAMG, a factorisation (MUMPS), or what PETSc's options say.
class AlgebraicSolver : public DisplacementSolver {
  public:
    /// `kind`: boomeramg, gamg, direct, petsc, or automatic: then the first matrix decides between
    /// a factorisation and GAMG, unless PETSc's options choose.
    AlgebraicSolver(DistributedHierarchy mesh, const ElasticModel& model, SolverKind kind,
                    Role role);

    SolverKind kind() const override { return kind_; }
    void set_constrained(std::span<const std::uint8_t> components) override;
    void set_springs(std::span<const double> stiffness) override;

  private:
    RenewalExtent renew(const Configuration& at, const OperatorTerms& terms,
                        RenewalExtent wanted) override;
    void configure(PC pc) override;
    /// Takes the factorisation in place of GAMG where the matrix says that it is as quick.
    void choose_factorisation();

    SolverKind kind_;
    bool is_chosen_;  ///< kind_ is final
};

}  // namespace livetet
