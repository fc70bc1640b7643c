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

    /// Finds the bound of the eigenvalues, the first time that it is called: the largest one of
    /// D^-1 A without mass, springs and constraints, which only lower it (for constraints: Cauchy's
    /// interlacing theorem); see lanczos_bound. Turns of the cells change it little. Overwrites b
    /// and x.
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
    struct Gradients;
    /// x . y of all ranks.
    double dot(std::span<const float> x, std::span<const float> y) const;

    MatrixFreeOperator& A_;
    int steps_;
    double lowest_;
    std::vector<float> b_, x_, d_;
    double bound_ = 1;
    bool is_bound_known_ = false;
};

}  // namespace livetet
