#include "apps/verification/closed_forms.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

// Tables marked (T) are rows of reference/closed_forms.txt, made by an independent script.
namespace livetet::verification {
namespace {

using std::numbers::pi;
using Field = std::function<FieldPoint(const Vector3&)>;

/// (i, j): the derivative of f_i along x_j, by central differences.
Matrix3d gradient(const std::function<Vector3(const Vector3&)>& f, const Vector3& x) {
    constexpr double h = 1e-5;
    Matrix3d g;
    for (int j = 0; j < 3; ++j)
        g.col(j) = (f(x + h * Vector3::Unit(j)) - f(x - h * Vector3::Unit(j))) / (2 * h);
    return g;
}

/// The stress is Hooke's of the displacement's gradient, and in equilibrium without a body force.
void expect_equilibrium(const Field& field, const Isotropic& m, const Vector3& x) {
    const Matrix3d H = gradient([&](const Vector3& y) { return field(y).u; }, x);
    const Matrix3d hooke =
        m.mu() * (H + H.transpose()) + m.lambda() * H.trace() * Matrix3d::Identity();
    EXPECT_LT((field(x).stress - hooke).norm(), 1e-8 * field(x).stress.norm());
    for (int i = 0; i < 3; ++i) {
        const Matrix3d row =
            gradient([&](const Vector3& y) -> Vector3 { return field(y).stress.row(i); }, x);
        EXPECT_NEAR(row.trace(), 0, 1e-8 * m.E);
    }
}

/// -mu lap u - (lambda + mu) grad div u = rho (2 pi f)^2 u, at one point, by second differences.
void expect_mode(const std::function<Vector3(const Vector3&)>& u, const Isotropic& m, double f,
                 const Vector3& x) {
    constexpr double h = 1e-3;
    const Vector3 inertia = m.rho * std::pow(2 * pi * f, 2) * u(x);
    Vector3 force = Vector3::Zero();
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            const Vector3 a = h * Vector3::Unit(i), b = h * Vector3::Unit(j);
            const Vector3 second =
                (u(x + a + b) - u(x + a - b) - u(x - a + b) + u(x - a - b)) / (4 * h * h);
            if (i == j) force -= m.mu() * second;
            force[i] -= (m.lambda() + m.mu()) * second[j];
        }
    EXPECT_LT((force - inertia).norm(), 1e-4 * inertia.norm());
}

TEST(ClosedForms, ThickSphereIsTheTable) {
    const double rows[][3] = {{0, 0.000714285714, 0.000428571429},  // (T) nu, u(a), u(b)
                              {0.3, 0.0008, 0.0003},
                              {0.4999, 0.000857114286, 0.000214328571}};
    for (const auto& [nu, inside, outside] : rows) {
        const Isotropic m{1000, nu};
        EXPECT_NEAR(thick_sphere(m, 1, 2, 1, 1).u, inside, 1e-12);
        EXPECT_NEAR(thick_sphere(m, 1, 2, 1, 2).u, outside, 1e-12);
        EXPECT_NEAR(thick_sphere(m, 1, 2, 1, 1).sigma_theta, 0.714286, 1e-6);
        EXPECT_NEAR(thick_sphere(m, 1, 2, 1, 1).sigma_r, -1, 1e-14);
        EXPECT_NEAR(thick_sphere(m, 1, 2, 1, 2).sigma_r, 0, 1e-14);
    }
}

TEST(ClosedForms, ThickCylinderIsTheTable) {
    const double rows[][4] = {{0, 0.00166666667, 0.00133333333, 0},  // (T) nu, u(a), u(b), sigma_z
                              {0.3, 0.00190666667, 0.00121333333, 0.2},
                              {0.4999, 0.00199996666, 0.00100013332, 0.333267}};
    for (const auto& [nu, inside, outside, along] : rows) {
        const RadialState a = thick_cylinder({1000, nu}, 1, 2, 1, 1),
                          b = thick_cylinder({1000, nu}, 1, 2, 1, 2);
        EXPECT_NEAR(a.u, inside, 1e-11);
        EXPECT_NEAR(b.u, outside, 1e-11);
        EXPECT_NEAR(a.sigma_theta, 5.0 / 3, 1e-12);
        EXPECT_NEAR(a.sigma_z, along, 1e-6);
        EXPECT_NEAR(a.sigma_r, -1, 1e-14);
        EXPECT_NEAR(b.sigma_r, 0, 1e-14);
    }
}

TEST(ClosedForms, FieldsAreInEquilibrium) {
    const Isotropic m{1000, 0.3};
    const Vector3 x(0.7, 1.1, -0.4);
    expect_equilibrium([&](const Vector3& y) { return kirsch(m, 0.8, 2, y); }, m, x);
    expect_equilibrium([&](const Vector3& y) { return pure_bending(m, 0.01, y); }, m, x);
    expect_equilibrium([&](const Vector3& y) { return torsion(m, 0.01, y); }, m, x);
    for (const bool sphere : {true, false})
        expect_equilibrium(
            [&](const Vector3& y) -> FieldPoint {  // the radial states as fields of x, y, z
                const Vector3 axis = sphere ? y : Vector3(y.x(), y.y(), 0);
                const double r = axis.norm();
                const Vector3 n = axis / r;
                const RadialState s =
                    sphere ? thick_sphere(m, 1, 2, 5, r) : thick_cylinder(m, 1, 2, 5, r);
                Matrix3d stress = s.sigma_theta * Matrix3d::Identity() +
                                  (s.sigma_r - s.sigma_theta) * n * n.transpose();
                if (!sphere) stress(2, 2) = s.sigma_z;
                return {s.u * n, stress};
            },
            m, x);
}

TEST(ClosedForms, KirschTriplesTheStressAtAFreeHole) {
    const Isotropic m{1, 0.3};
    EXPECT_NEAR(kirsch(m, 1, 1, {0, 1, 0}).stress(0, 0), 3, 1e-12);
    EXPECT_NEAR(kirsch(m, 1, 1, {1, 0, 0}).stress(1, 1), -1, 1e-12);
    EXPECT_NEAR(kirsch(m, 1, 1, {200, 0, 0}).stress(0, 0), 0.99994, 1e-5);  // (T)
    const Vector3 n(std::cos(0.7), std::sin(0.7), 0);
    EXPECT_LT((kirsch(m, 2, 1, 2 * n).stress * n).norm(), 1e-12);
}

TEST(ClosedForms, ElasticaIsTheTable) {
    const double rows[][4] = {{0.2, 0.00265, 0.06636, 0.09964},  // (T) K, 1 - x, w, angle
                              {1, 0.05643, 0.30172, 0.46135},
                              {4, 0.32894, 0.66996, 1.12124},
                              {10, 0.55500, 0.81061, 1.43029}};
    for (const auto& [K, shorter, w, angle] : rows) {
        const Tip tip = elastica(K, 0);
        EXPECT_NEAR(1 - tip.x, shorter, 5.1e-6);
        EXPECT_NEAR(tip.w, w, 5.1e-6);
        EXPECT_NEAR(tip.angle, angle, 5.1e-6);
    }
    const double heavy[][4] = {
        {1, 0.00875, 0.12347, 9.460},  // (T) Gamma, 1 - x, w, angle in degrees
        {5, 0.15334, 0.49591, 39.935},
        {30, 0.65724, 0.87309, 82.972}};
    for (const auto& [Gamma, shorter, w, angle] : heavy) {
        const Tip tip = elastica(0, Gamma);
        EXPECT_NEAR(1 - tip.x, shorter, 5.1e-6);
        EXPECT_NEAR(tip.w, w, 5.1e-6);
        EXPECT_NEAR(tip.angle * 180 / pi, angle, 5.1e-4);
    }
}

/// Bisshopp and Drucker's elliptic integrals: with k^2 = (1 + sin angle) / 2 and tan(phi) = 1 /
/// sqrt(sin angle), sqrt K = F(pi/2, k) - F(phi, k), x = sqrt(2 sin(angle) / K), w = 1 - 2 / sqrt K
/// (E(pi/2, k) - E(phi, k)).
TEST(ClosedForms, ElasticaIsEllipticIntegralsToTenDigits) {
    for (const double K : {0.01, 0.5, 2.0, 10.0, 40.0, 100.0}) {
        const Tip tip = elastica(K, 0);
        const double sine = std::sin(tip.angle), k = std::sqrt((1 + sine) / 2),
                     phi = std::atan2(1, std::sqrt(sine));
        EXPECT_NEAR(std::comp_ellint_1(k) - std::ellint_1(k, phi), std::sqrt(K), 1e-8);
        EXPECT_NEAR(tip.x, std::sqrt(2 * sine / K), 1e-10);
        EXPECT_NEAR(tip.w, 1 - 2 / std::sqrt(K) * (std::comp_ellint_2(k) - std::ellint_2(k, phi)),
                    1e-10);
    }
}

TEST(ClosedForms, SmallLoadsOfAnElasticaAreABeams) {
    EXPECT_NEAR(elastica(1e-3, 0).w, 1e-3 / 3, 1e-9);
    EXPECT_NEAR(elastica(0, 1e-3).w, 1e-3 / 8, 1e-9);
    EXPECT_NEAR(elastica(1e-3, 2e-3).w, 1e-3 / 3 + 2e-3 / 8, 1e-9);
}

TEST(ClosedForms, EndMomentRollsARodUp) {
    const double rows[][3] = {
        {0.1, 0.06451, 0.30396}, {0.5, 1, 0.63662}, {0.75, 1.21221, 0.21221}, {1, 1, 0}};
    for (const auto& [turns, shorter, w] : rows) {  // (T)
        const Tip tip = end_moment(2 * pi * turns);
        EXPECT_NEAR(1 - tip.x, shorter, 5.1e-6);
        EXPECT_NEAR(tip.w, w, 5.1e-6);
    }
}

TEST(ClosedForms, TimoshenkoIsTheTable) {
    const double rows[][4] = {
        {4, 0, 265.6, 1.05}, {4, 0.3, 268.24, 1.06375}, {20, 0.45, 32067.8, 1.00283}};
    for (const auto& [L, nu, end, ratio] :
         rows) {  // (T) L/h, nu, end load, uniform load's ratio to Euler-Bernoulli
        EXPECT_NEAR(timoshenko_end_load({1, nu}, L, 1, 1), end, 1e-3);
        EXPECT_NEAR(timoshenko_uniform_load({1, nu}, L, 1, 1) / (12 * std::pow(L, 4) / 8), ratio,
                    5.1e-6);
    }
}

TEST(ClosedForms, BeamsAndBarsHaveTheTablesFrequencies) {
    const double clamped[] = {1.8751040687119178, 4.694091132974175, 7.854757438237325};  // (T)
    const double free[] = {4.730040744862704, 7.853204624095503, 10.995607838001671};
    const double bending[] = {2.01925, 12.65443, 35.43277};
    const Isotropic m{1e5, 0, 1000};
    for (int n = 1; n <= 3; ++n) {
        EXPECT_NEAR(beam_root(n, Ends::clamped_free), clamped[n - 1], 1e-12);
        EXPECT_NEAR(beam_root(n, Ends::free_free), free[n - 1], 1e-12);
        EXPECT_NEAR(beam_frequency(m, 0.2, 0.05, n, Ends::clamped_free), bending[n - 1], 5.1e-6);
    }
    EXPECT_NEAR(bar_frequency(m, 0.2, 1, Ends::clamped_free), 12.5, 1e-12);
    EXPECT_NEAR(bar_frequency(m, 0.2, 2, Ends::clamped_free), 37.5, 1e-12);
    EXPECT_NEAR(bar_frequency(m, 0.2, 1, Ends::free_free), 25, 1e-12);
}

TEST(ClosedForms, SolidModesSolveTheEquationOfMotion) {
    const Isotropic m{1000, 0.3, 2};
    const Vector3 x(0.31, 0.77, 0.52);
    expect_mode([](const Vector3& y) { return lame_mode(1.5, y); }, m, lame_frequency(m, 1.5), x);
    expect_mode([](const Vector3& y) { return swinging_cube_mode(1.5, y); }, m,
                swinging_cube_frequency(m, 1.5), x);
}

TEST(ClosedForms, LameModeLeavesFacesFree) {
    for (const double s : {0.0, 1.5}) {
        const Matrix3d H =
            gradient([](const Vector3& y) { return lame_mode(1.5, y); }, {s, 0.4, 0.2});
        EXPECT_NEAR(H(0, 0), 0, 1e-9);
        EXPECT_NEAR(H(0, 1) + H(1, 0), 0, 1e-9);
        EXPECT_NEAR(H.trace(), 0, 1e-9);
    }
}

/// NAFEMS took modes 4 to 7 of FV52 from thick-plate theory.
TEST(ClosedForms, MindlinsPlateIsFV52) {
    const Isotropic steel{200e9, 0.3, 8000};
    const int modes[][2] = {{1, 1}, {1, 2}, {2, 1}, {2, 2}};
    for (int n = 0; n < 4; ++n) {
        const auto& [i, j] = modes[n];
        EXPECT_NEAR(mindlin_plate_frequency(steel, 10, 1, i, j, pi * pi / 12), fv52_frequencies[n],
                    5e-3);
        EXPECT_NEAR(lamb_plate_frequency(steel, 10, 1, i, j) / fv52_frequencies[n], 1, 6e-3);
    }
}

TEST(ClosedForms, LambsPlateIsThatOfSrinivas) {
    const Isotropic m{2.6, 0.3};  // mu = 1
    // h / a = 0.1: omega h sqrt(rho / mu) of Srinivas, Joga Rao and Rao (1970)
    EXPECT_NEAR(2 * pi * lamb_plate_frequency(m, 10, 1, 1, 1), 0.0932, 5.1e-5);
    EXPECT_NEAR(2 * pi * lamb_plate_frequency(m, 10, 1, 1, 2), 0.2226, 5.1e-5);
    EXPECT_NEAR(2 * pi * lamb_plate_frequency(m, 10, 1, 2, 2), 0.3421, 5.1e-5);
    EXPECT_NEAR(2 * pi * lamb_plate_frequency(m, 10, 1, 1, 3), 0.4171, 5.1e-5);
    const double kirchhoff =
        pi / 1e4 * std::sqrt(m.E / (12 * (1 - m.nu * m.nu)));  // a thin plate, (1, 1): a = 100
    EXPECT_NEAR(lamb_plate_frequency(m, 100, 1, 1, 1) / kirchhoff, 1, 1e-3);
}

TEST(ClosedForms, NewmarkIsTheTable) {
    const double rows[][6] = {
        {0.25, 0.5, 2, 1, 0, 0.273240},  // (T) beta, gamma, Omega, radius, damping, elongation
        {1.0 / 6, 0.5, 5, 2.426613, -0.271575, 0.591549},
        {0.276, 0.55, 1, 0.980212, 0.021562, 0.079045},
        {0.3025, 0.6, 1e6, 0.818182, 0.063746, 318309.295571},
        {0.36, 0.7, 5, 0.707107, 0.145525, 1.122066},
        {0.5, 1, 2, 0.577350, 0.330097, 0.273240},
        {0.5, 1, 5, 0.666667, 0.128002, 0.591549},
        {1, 1.5, 0.5, 0.894427, 0.233960, 0.078405}};
    for (const auto& [beta, gamma, Omega, radius, damping, elongation] : rows) {
        const SchemeResponse r = response({0, 0, beta, gamma}, Omega);
        EXPECT_NEAR(r.spectral_radius, radius, 1e-6) << beta << " " << Omega;
        EXPECT_NEAR(r.damping, damping, 1e-6) << beta << " " << Omega;
        EXPECT_NEAR(r.period_elongation, elongation, 1e-6 * std::max(1.0, elongation))
            << beta << " " << Omega;
    }
}

TEST(ClosedForms, ResponseIsThatOfTheAmplificationMatrix) {
    for (const AlphaScheme& scheme :
         {AlphaScheme{}, AlphaScheme{0, 0, 0.36, 0.7}, generalized_alpha(0.8)})
        for (const double Omega : {0.1, 1.0, 7.0}) {
            const Eigen::Vector3cd z = amplification(scheme, Omega).eigenvalues();
            EXPECT_NEAR(response(scheme, Omega).spectral_radius, z.cwiseAbs().maxCoeff(), 1e-9);
        }
}

TEST(ClosedForms, ImplicitEulerHasTheEigenvaluesOfANewmark) {
    for (const double Omega : {0.1, 1.0, 10.0}) {
        const SchemeResponse r = response({0, 0, 1, 1.5}, Omega);
        EXPECT_NEAR(r.spectral_radius, 1 / std::hypot(1, Omega), 1e-12);
        EXPECT_NEAR(r.period_elongation, Omega / std::atan(Omega) - 1, 1e-10);
    }
}

/// Chung and Hulbert's design: second order, radius 1 at low and rho_inf at high frequencies, no
/// less in between; rho_inf = 1 is the trapezoidal rule's radius, 1 everywhere.
TEST(ClosedForms, GeneralizedAlphaDampsAsDesigned) {
    for (const double rho : {0.0, 0.5, 0.8, 1.0}) {
        const AlphaScheme scheme = generalized_alpha(rho);
        EXPECT_NEAR(response(scheme, 1e-3).spectral_radius, 1, 1e-8);
        EXPECT_NEAR(response(scheme, 1e7).spectral_radius, rho, 1e-3);
        double before = 1;
        for (double Omega = 0.1; Omega < 1e3; Omega *= 1.3) {
            const double radius = response(scheme, Omega).spectral_radius;
            EXPECT_LE(radius, before + 1e-7) << rho << " " << Omega;
            before = radius;
        }
        const double elongation = response(scheme, 0.02).period_elongation;
        EXPECT_NEAR(elongation / response(scheme, 0.01).period_elongation, 4, 0.01);
    }
}

}  // namespace
}  // namespace livetet::verification
