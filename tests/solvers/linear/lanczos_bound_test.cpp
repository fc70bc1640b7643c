// Bounds of eigenvalues for Chebyshev's smoothing.

#include "solvers/linear/lanczos_bound.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

namespace livetet {
namespace {

/// B A = diag(values), with B = diag(1, 2, 1, 2, ...).
struct DiagonalGradients {
    Eigen::VectorXd values, r, p, w;

    explicit DiagonalGradients(const Eigen::VectorXd& v) : values(v), r(v), p(v), w(v) {
        RoughValues rough;
        for (double& x : r) x = rough.next();
        p.setZero();
    }
    static double b(Eigen::Index i) { return 1.0 + static_cast<double>(i % 2); }
    double residual() {
        for (Eigen::Index i = 0; i < r.size(); ++i) w[i] = b(i) * r[i];
        return r.dot(w);
    }
    void turn(double beta) { p = w + beta * p; }
    double curvature() {
        for (Eigen::Index i = 0; i < r.size(); ++i) w[i] = values[i] / b(i) * p[i];
        return p.dot(w);
    }
    void advance(double alpha) { r -= alpha * w; }
};

/// 0.01 to 2.8 evenly, and 4.1: power iteration is at 2.9 after 14 steps. A smoother for that
/// amplifies what belongs to 4.1.
TEST(LanczosBound, FindsALoneEigenvalueInFewSteps) {
    constexpr Eigen::Index size = 20000;
    Eigen::VectorXd values = Eigen::VectorXd::LinSpaced(size, 0.01, 2.8);
    values[size / 3] = 4.1;
    DiagonalGradients gradients(values);
    const double found = lanczos_bound(bound_steps, gradients);
    EXPECT_GT(found, 4.1 / 1.05);
    EXPECT_LE(found, 4.1 * (1 + 1e-12)) << "it comes from below";
}

TEST(LanczosBound, OfNothingIsNothing) {
    DiagonalGradients gradients(Eigen::VectorXd::Zero(5));
    EXPECT_EQ(lanczos_bound(bound_steps, gradients), 0);
    DiagonalGradients three(Eigen::VectorXd::Constant(5, 3));
    EXPECT_NEAR(lanczos_bound(bound_steps, three), 3, 1e-12) << "all is said after one step";
}

}  // namespace
}  // namespace livetet
