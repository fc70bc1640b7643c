#pragma once

#include <span>
#include <vector>

#include "solvers/linear/matrix_free_operator.hpp"

namespace livetet {

/// Chebyshev smoothing of A x = b on the diagonal of a MatrixFreeOperator. A is Hooke's law turned
/// by the rotations, whatever the law: it is positive, and its eigenvalues over the diagonal do not
/// change as the body turns. Vectors are as MatrixFreeOperator has them. Collective.
class MatrixFreeSmoother {
  public:
    /// `A` must outlive this. `steps`: before or after a correction; `lowest`: see ChebyshevSteps.
    MatrixFreeSmoother(MatrixFreeOperator& A, int steps, double lowest = 0.1);

    /// Forgets the bound of the eigenvalues: constraints are new.
    void forget_bound() { bound_ = 0; }
    /// Finds it if it was forgotten: the largest eigenvalue of D^-1 A without mass and springs,
    /// which only lower it, from 20 steps of power iteration. Overwrites x.
    void find_bound();

    /// x += ChebyshevSteps for A x = b; `from_zero`: x is 0, whatever it holds.
    void smooth(bool from_zero);
    /// r = b - A x, zero at constrained components.
    void residual(std::span<float> r) {
        visit_residual([&](std::size_t i, float of_i) { r[i] = of_i; });
    }
    /// visit(i, r_i) of the same.
    template <class Visit>
    void visit_residual(Visit&& visit) {
        const auto free = A_.free();
        A_.visit_positive(x_, [&](std::size_t i, float Ax) { visit(i, free[i] * (b_[i] - Ax)); });
    }

    std::vector<float>& b() { return b_; }
    std::vector<float>& x() { return x_; }

  private:
    /// |x|^2 of all ranks.
    double squared_norm(std::span<const float> x) const;

    MatrixFreeOperator& A_;
    int steps_;
    double lowest_;
    std::vector<float> b_, x_, d_;
    double bound_ = 0;  ///< 0: to be found
};

}  // namespace livetet
