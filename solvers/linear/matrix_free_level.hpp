#pragma once

#include <span>

#include "solvers/linear/matrix_free_smoother.hpp"
#include "solvers/linear/transfer.hpp"

namespace livetet {

/// The finest level of MultigridSolver without a matrix, on any number of ranks. Its operator is a
/// PETSc shell matrix, and its preconditioner a PETSc shell, a two-level cycle,
///
///     z = S(0, r),   z = z + P C (P^T (r - A_s z)),   z = S(z, r).
///
/// The operator is the tangent in double precision, element by element. S are Chebyshev steps of a
/// MatrixFreeSmoother in single precision, on A_s: Hooke's stiffness turned by the rotations, which
/// is positive whatever the tangent. C is a Krylov solver of the next level, P the interpolation
/// from it.
///
/// A product reads 60 bytes a tet in single precision, and 36 of its rotation; a row of an
/// assembled matrix in double precision 76 a block, some 190 a tet. It needs no assembly. Forces
/// below 1e-38 N are zero to the cycle.
class MatrixFreeLevel {
  public:
    /// `level`, of BothPrecisions, must outlive this. Collective, as all that follows.
    MatrixFreeLevel(LevelAssembler& level, int smoothing_steps);
    MatrixFreeLevel(const MatrixFreeLevel&) = delete;
    MatrixFreeLevel& operator=(const MatrixFreeLevel&) = delete;

    Mat matrix() const { return matrix_.get(); }
    /// Makes `pc` the cycle around `coarse`, a solver of the next level, to which `transfer` leads.
    /// Both must outlive this.
    void precondition(PC pc, KSP coarse, const Transfer& transfer);

    /// Takes up the level's constrained components.
    void set_constrained();
    /// Takes up its springs.
    void set_springs();
    /// Takes up where K is taken, and the factors. If the body turns, what `at` names must stay as
    /// it is while the operator is used.
    void update(const Configuration& at, const OperatorTerms& terms);
    const Configuration& at() const { return at_; }
    const OperatorTerms& terms() const { return terms_; }

  private:
    void multiply(std::span<const double> x, std::span<double> y);
    void cycle(std::span<const double> r, std::span<double> z);
    void correct();

    LevelAssembler& level_;
    MatrixFreeOperator positive_;
    MatrixFreeSmoother smoother_;
    Configuration at_;
    OperatorTerms terms_;
    ElementRotations rotations_;  ///< in single precision
    ElementRotations fixed_;      ///< in double precision, where the body does not turn
    PetscHandle<Vec> x_, f_;      ///< with ghosts
    PetscHandle<Vec> r_, coarse_r_, coarse_z_;
    PetscHandle<Mat> matrix_;
    PC pc_ = nullptr;
    KSP coarse_ = nullptr;
    const Transfer* transfer_ = nullptr;
};

}  // namespace livetet
