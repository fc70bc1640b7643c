#include "mechanics/time_scheme.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

namespace livetet {
namespace {

constexpr double step_s = 0.02;

/// Displacement, velocity and acceleration.
using Motion = Eigen::Vector3d;

TimeOptions newmark(double beta, double gamma) {
    return {.scheme = TimeScheme::newmark, .beta = beta, .gamma = gamma};
}

TimeOptions generalized_alpha(double rho_inf) {
    return {.scheme = TimeScheme::generalized_alpha, .rho_inf = rho_inf};
}

/// The end of a step from `start` that moves by du.
Motion end_of_step(const TimeCoefficients& c, const Motion& start, double du) {
    return {start[0] + du, c.v_u * du + c.v_v * start[1] + c.v_a * start[2],
            c.a_u * du - c.a_v * start[1] - c.a_a * start[2]};
}

/// Spectral radius of a step of u'' = -omega^2 u, Omega = omega dt: of the matrix that takes
/// (u, v dt, a dt^2) from its start to its end, by the balance with h = -omega^2 u and M = 1.
double spectral_radius(const TimeOptions& time, double Omega) {
    const double dt = step_s, squared = Omega * Omega / (dt * dt);
    const TimeCoefficients c = time_coefficients(time, dt);
    const Motion units(1, dt, dt * dt);
    Eigen::Matrix3d A;
    for (int i = 0; i < 3; ++i) {
        const Motion start = Motion::Unit(i).cwiseQuotient(units);
        const double rest = c.a_v * start[1] + c.a_a * start[2];
        const double du = (-squared * start[0] + (1 - c.alpha_m) * rest - c.alpha_m * start[2]) /
                          ((1 - c.alpha_f) * squared + (1 - c.alpha_m) * c.a_u);
        A.col(i) = end_of_step(c, start, du).cwiseProduct(units);
    }
    return A.eigenvalues().cwiseAbs().maxCoeff();
}

TEST(TimeScheme, SecondOrderSchemesAreExactForConstantAcceleration) {
    const Motion start(0.3, -0.7, 9.81);
    const double du = start[1] * step_s + start[2] * step_s * step_s / 2;
    for (const TimeOptions& time : {newmark(0.25, 0.5), newmark(0.36, 0.7), newmark(1.0 / 6, 0.5),
                                    generalized_alpha(0), generalized_alpha(0.8)}) {
        const Motion end = end_of_step(time_coefficients(time, step_s), start, du);
        EXPECT_NEAR(end[1], start[1] + start[2] * step_s, 1e-12);
        EXPECT_NEAR(end[2], start[2], 1e-10);
    }
}

/// Euler's du = dt v1; its velocity is exact, whatever acceleration it starts from.
TEST(TimeScheme, EulersVelocityIsExactForConstantAcceleration) {
    const TimeCoefficients c = time_coefficients({.scheme = TimeScheme::implicit_euler}, step_s);
    const Motion start(0.3, -0.7, 123);
    const double v1 = start[1] + 9.81 * step_s;
    const Motion end = end_of_step(c, start, step_s * v1);
    EXPECT_NEAR(end[1], v1, 1e-12);
    EXPECT_NEAR(end[2], 9.81, 1e-10);
}

TEST(TimeScheme, EulersSpectralRadiusIsThatOfItsPole) {
    for (const double Omega : {0.1, 1.0, 10.0})
        EXPECT_NEAR(spectral_radius({.scheme = TimeScheme::implicit_euler}, Omega),
                    1 / std::hypot(1, Omega), 1e-12);
}

/// The trapezoidal rule neither damps nor grows. With gamma = 1/2 and beta < 1/4 the limit of
/// stability is Omega = 1 / sqrt(1/4 - beta); with gamma above 1/2 the determinant of complex poles
/// is 1 - (gamma - 1/2) Omega^2 / (1 + beta Omega^2), the radius its root.
TEST(TimeScheme, NewmarksSpectralRadiusIsThatOfTheory) {
    for (const double Omega : {0.1, 1.0, 10.0, 1000.0})
        EXPECT_NEAR(spectral_radius(newmark(0.25, 0.5), Omega), 1, 1e-9);
    EXPECT_NEAR(spectral_radius(newmark(1.0 / 6, 0.5), 0.99 * std::sqrt(12)), 1, 1e-9);
    EXPECT_GT(spectral_radius(newmark(1.0 / 6, 0.5), 1.01 * std::sqrt(12)), 1.1);
    for (const double Omega : {0.1, 1.0, 5.0}) {
        const double squared = Omega * Omega;
        EXPECT_NEAR(spectral_radius(newmark(0.36, 0.7), Omega),
                    std::sqrt(1 - 0.2 * squared / (1 + 0.36 * squared)), 1e-9);
    }
}

/// Chung and Hulbert's design: radius 1 at low frequencies and rho_inf at high ones.
TEST(TimeScheme, GeneralizedAlphaLeavesRhoInfOfTheHighestFrequencies) {
    for (const double rho_inf : {0.0, 0.5, 0.8, 1.0}) {
        EXPECT_NEAR(spectral_radius(generalized_alpha(rho_inf), 1e-3), 1, 1e-8);
        EXPECT_NEAR(spectral_radius(generalized_alpha(rho_inf), 1e6), rho_inf, 1e-3);
    }
}

TEST(TimeScheme, StaticHasNoInertia) {
    const TimeCoefficients c = time_coefficients({}, step_s);
    EXPECT_EQ(end_of_step(c, {0, 1, 2}, 3), Motion(3, 0, 0));
    EXPECT_EQ(c.error, 0);
}

}  // namespace
}  // namespace livetet
