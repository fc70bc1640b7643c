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
/// Whether L D L^T of `A` takes no longer than some 100 iterations of algebraic multigrid (20,000
/// operations for each nonzero), and half of the machine's memory holds it. Thin bodies are so at
/// any size that memory holds, organs up to some 100,000 tets. Collective.
bool is_affordable(Mat A, const FactorisationEstimate& estimate);

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
