#pragma once

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace livetet {

/// Values of a rough vector between -0.5 and 0.5, the same in every run.
class RoughValues {
  public:
    double next() {
        state_ = state_ * 1664525u + 1013904223u;
        return static_cast<double>(state_) / 4294967296.0 - 0.5;
    }

  private:
    std::uint32_t state_ = 12345;
};

/// Steps after which the largest eigenvalue is known to a few hundredths.
inline constexpr int bound_steps = 14;

/// A lower estimate of the largest eigenvalue of B A, both symmetric and positive, by Lanczos'
/// method: the largest one of the tridiagonal matrix T that conjugate gradients for A,
/// preconditioned by B, imply,
///
///     T_kk = 1 / alpha_k + beta_{k-1} / alpha_{k-1},    T_k,k+1 = sqrt(beta_k) / alpha_k
///
/// (Saad 2003, Iterative Methods for Sparse Linear Systems, 6.7.3). An eigenvalue that stands
/// alone, as of a few odd cells, is found in a third of the steps that power iteration takes.
///
/// `cg` has the vectors, of which r begins rough and p is zero:
///
///     double residual();           // z = B r; returns r . z
///     void turn(double beta);      // p = z + beta p
///     double curvature();          // q = A p; returns p . q
///     void advance(double alpha);  // r -= alpha q
///
/// 0 if nothing can be said, as of an operator that is zero.
template <class Gradients>
double lanczos_bound(int steps, Gradients&& cg) {
    std::vector<double> diagonal, beside;
    double alpha = 0, before = 0, beta = 0;
    for (int k = 0; k < steps; ++k) {
        const double now = cg.residual();
        if (!(now > 0) || !std::isfinite(now)) break;
        beta = k > 0 ? now / before : 0;
        cg.turn(beta);
        const double curvature = cg.curvature();
        if (!(curvature > 0) || !std::isfinite(curvature)) break;
        if (k > 0) beside.push_back(std::sqrt(beta) / alpha);
        const double of_last = k > 0 ? beta / alpha : 0;
        alpha = now / curvature;
        diagonal.push_back(1 / alpha + of_last);
        cg.advance(alpha);
        before = now;
    }
    if (diagonal.empty()) return 0;
    const auto size = static_cast<Eigen::Index>(diagonal.size());
    const Eigen::Map<const Eigen::VectorXd> on(diagonal.data(), size), off(beside.data(), size - 1);
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
    solver.computeFromTridiagonal(on, off, Eigen::EigenvaluesOnly);
    return solver.eigenvalues().maxCoeff();
}

}  // namespace livetet
