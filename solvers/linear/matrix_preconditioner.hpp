#pragma once

#include <string>

#include "base/petsc.hpp"

namespace livetet {

/// L D L^T by MUMPS: an exact tangent need not be positive.
void configure_factorisation(PC pc);

/// MUMPS's estimates for L D L^T, from its analysis of the pattern; of all ranks together.
struct FactorisationEstimate {
    double operations = 0;  ///< floating-point operations of the elimination
    double bytes = 0;       ///< memory
};
/// `A`: of scalars, symmetric. Collective.
FactorisationEstimate estimate_factorisation(Mat A);
/// Operations for each nonzero of the matrix that L D L^T may take to be worth as much as algebraic
/// multigrid (docs/theory/multigrid.md has the measurements).
enum class FactorisationLimit {
    as_quick_as_aggregation = 6'000,   ///< of 26 to 100 iterations of GAMG
    rather_than_slow_cycles = 20'000,  ///< some 100 iterations of a multigrid that does not fit
};
/// Whether L D L^T of `A` is within the limit, and half of the machine's memory holds it. Thin
/// bodies are within both at any size that memory holds, organs only where small. Collective.
bool is_affordable(Mat A, const FactorisationEstimate& estimate, FactorisationLimit limit);

/// A preconditioner that is made from the matrix alone.
enum class MatrixMethod {
    factorisation,  ///< L D L^T
    aggregation,    ///< smoothed aggregation (GAMG): W-cycles of six smoothing steps
};

/// Preconditions in the place of another: what a PC applied before, a MatrixMethod applies from
/// then on. Everything that holds the PC goes on holding it.
class MatrixPreconditioner {
  public:
    /// `place` becomes a PCSHELL that refers to this object. PETSc's options of the method have the
    /// prefix `prefix`.
    MatrixPreconditioner(PC place, MatrixMethod method, const std::string& prefix);
    MatrixPreconditioner(const MatrixPreconditioner&) = delete;
    MatrixPreconditioner& operator=(const MatrixPreconditioner&) = delete;

    /// The matrix of scalars that is preconditioned, with rigid motions as its near null space;
    /// before each set-up of `place`.
    void set_matrix(Mat A);
    MatrixMethod method() const { return method_; }

  private:
    void set_up(PC place);

    MatrixMethod method_;
    PetscHandle<PC> pc_;
    bool has_cycle_ = false;  ///< aggregation: cycle and smoothing steps are set
};

/// "cholesky (MUMPS)", "gamg".
std::string name_of(MatrixMethod method);

}  // namespace livetet
