#pragma once

#include <vector>

#include "base/petsc.hpp"
#include "base/thread_team.hpp"
#include "solvers/linear/earlier_solves.hpp"
#include "solvers/linear/single_system.hpp"
#include "solvers/linear/stopping_test.hpp"

namespace livetet {

/// Conjugate gradients for A x = b on a team of threads of one rank. x and sums are in double
/// precision; residual and directions in single precision, as the products are, so that a vector
/// costs half of what PETSc's do, and each is read no more often than it has to be:
///
///     z = M r,   p = z + (r . z / last r . z) p,   q = A p,   a = r . z / p . q,
///     x = x + a p,   r = r - a q                            (Saad 2003, algorithm 9.1).
///
/// To use it:
///
///     begin(b, earlier);      // or begin(b)
///     run(x, stopping);       // again, after another reason, if the operator is another one
///     image(b, x, y);
class ConjugateGradients {
  public:
    /// `n` components. All must outlive this.
    ConjugateGradients(SingleSystem& system, std::size_t n, ThreadTeam& team);

    /// From zero, or, where it is of use, from the start that `earlier` has. Returns |b - A x_0|.
    void begin(Vec b, EarlierSolves* earlier = nullptr);
    bool has_start() const { return of_start_ != 0; }
    /// Iterates until `stopping`, or a direction that does not reduce the energy, ends it:
    /// KSP_DIVERGED_INDEFINITE_MAT, _PC. Writes x. A second call goes on from the x and the
    /// residual of the first one, with new directions.
    KSPConvergedReason run(Vec x, StoppingTest& stopping);
    /// y = A x of the last x: b - r; by a product where `run` was called more than once.
    void image(Vec b, Vec x, Vec y);

    int iterations() const { return iterations_; }  ///< of all runs since begin
    double residual() const { return residual_; }   ///< |r|

  private:
    void find_direction(bool is_first);
    void advance(double length, Vec x);
    /// x = the start, where no step has been taken.
    void write_start(Vec x);

    SingleSystem& system_;
    ThreadTeam& team_;
    std::size_t n_;
    std::vector<float> r_, z_, p_, q_;
    std::vector<float> start_;
    double of_start_ = 0;  ///< x_0 = of_start_ start_
    double rz_ = 0;        ///< r . z
    double residual_ = 0;
    int iterations_ = 0, runs_ = 0;
};

}  // namespace livetet
