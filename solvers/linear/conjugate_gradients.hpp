#pragma once

#include <vector>

#include "base/petsc.hpp"
#include "base/thread_team.hpp"
#include "solvers/linear/earlier_solves.hpp"
#include "solvers/linear/single_system.hpp"
#include "solvers/linear/stopping_test.hpp"

namespace livetet {

/// Conjugate gradients for A x = b on a team of threads of one rank (Saad 2003, algorithm 9.1):
///
///     z = M r,   beta = r . z / last r . z,   p = z + beta p,   q = A p,
///     alpha = r . z / p . q,   x = x + alpha p,   r = r - alpha q.
///
/// x and sums are in double precision; residual and directions in single precision, as the products
/// are, so that a vector costs half of what PETSc's do. To use it:
///
///     begin(b, earlier);         // or begin(b)
///     run(x, stopping, ksp);
///     renew_residual(b, x);      // if A is another operator now; then run again
///     image(b, y);
class ConjugateGradients {
  public:
    /// Of `n` components. System and team must outlive this.
    ConjugateGradients(SingleSystem& system, std::size_t n, ThreadTeam& team);

    /// From zero, or, where it is of use, from the start that `earlier` has.
    void begin(Vec b, EarlierSolves* earlier = nullptr);
    bool has_start() const { return start_scale_ != 0; }
    /// Iterates until `stopping`, or a direction along which the energy does not fall, ends it:
    /// KSP_DIVERGED_INDEFINITE_MAT, _PC. Writes x. A second call goes on from the x of the first
    /// one, with new directions. The monitors of `monitored`, if there is one, are told of each
    /// residual.
    KSPConvergedReason run(Vec x, StoppingTest& stopping, KSP monitored = nullptr);
    /// r = b - A x, by a product.
    void renew_residual(Vec b, Vec x);
    /// y = b - r, which is A x.
    void image(Vec b, Vec y) const;

    int iterations() const { return iterations_; }  ///< of all runs since begin
    double residual() const { return residual_; }   ///< |r|

  private:
    KSPConvergedReason iterate(Vec x, StoppingTest& stopping, KSP monitored);
    void find_direction(bool is_first);
    void advance(double alpha, Vec x);
    /// x = the start, where no step has been taken.
    void write_start(Vec x);
    void find_norm();

    SingleSystem& system_;
    ThreadTeam& team_;
    std::size_t n_;
    std::vector<float> r_, z_, p_, q_;
    std::vector<float> start_;
    double start_scale_ = 0;  ///< x_0 = start_scale_ start_
    double rz_ = 0;           ///< r . z
    double residual_ = 0;
    int iterations_ = 0;
};

}  // namespace livetet
