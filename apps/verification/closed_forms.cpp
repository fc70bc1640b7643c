#include "apps/verification/closed_forms.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

namespace livetet::verification {
namespace {

using std::numbers::pi;

/// State of a rod at the distance s from its tip: angle, its derivative, and the position relative
/// to the tip along x and w.
using RodState = Eigen::Vector4d;

/// Integrates the rod from its tip, turned by `tip_angle`, to its clamp. Stops if the angle falls
/// below zero.
RodState integrate_rod(double K, double Gamma, double tip_angle) {
    constexpr int steps = 2000;
    constexpr double h = 1.0 / steps;
    const auto slope = [&](double s, const RodState& y) {
        return RodState(y[1], -(K + Gamma * s) * std::cos(y[0]), std::cos(y[0]), std::sin(y[0]));
    };
    RodState y(tip_angle, 0, 0, 0);
    for (int i = 0; i < steps && y[0] >= 0; ++i) {
        const double s = i * h;
        const RodState k1 = slope(s, y), k2 = slope(s + h / 2, y + h / 2 * k1),
                       k3 = slope(s + h / 2, y + h / 2 * k2), k4 = slope(s + h, y + h * k3);
        y += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
    return y;
}

/// The x between low and high at which `above(x)` turns from false to true, to rounding error.
template <class Above>
double bisect(double low, double high, Above&& above) {
    for (int i = 0; i < 60; ++i) {
        const double middle = (low + high) / 2;
        (above(middle) ? high : low) = middle;
    }
    return high;
}

}  // namespace

RadialState thick_sphere(const Isotropic& m, double a, double b, double p, double r) {
    const double c = p * a * a * a / (b * b * b - a * a * a), q = std::pow(b / r, 3);
    const double hoop = c * (1 + q / 2);
    return {c * r / m.E * ((1 - 2 * m.nu) + (1 + m.nu) * q / 2), c * (1 - q), hoop, hoop};
}

RadialState thick_cylinder(const Isotropic& m, double a, double b, double p, double r) {
    const double c = p * a * a / (b * b - a * a), q = b * b / (r * r);
    return {c * (1 + m.nu) / m.E * r * ((1 - 2 * m.nu) + q), c * (1 - q), c * (1 + q),
            2 * m.nu * c};
}

FieldPoint kirsch(const Isotropic& m, double a, double S, const Vector3& x) {
    const double r = std::hypot(x.x(), x.y()), t = std::atan2(x.y(), x.x());
    const double q = a / r, q2 = q * q, q4 = q2 * q2, kappa = 3 - 4 * m.nu;
    const double rr = S / 2 * ((1 - q2) + (1 - 4 * q2 + 3 * q4) * std::cos(2 * t));
    const double tt = S / 2 * ((1 + q2) - (1 + 3 * q4) * std::cos(2 * t));
    const double rt = -S / 2 * (1 + 2 * q2 - 3 * q4) * std::sin(2 * t);
    Matrix3d polar, Q;
    polar << rr, rt, 0, rt, tt, 0, 0, 0, m.nu * (rr + tt);
    Q << std::cos(t), -std::sin(t), 0, std::sin(t), std::cos(t), 0, 0, 0, 1;
    const double cubic = 2 * q * (1 - q2);
    const Vector3 u((1 + kappa) * (1 / q + 2 * q) * std::cos(t) + cubic * std::cos(3 * t),
                    ((kappa - 3) / q + 2 * q * (1 - kappa)) * std::sin(t) + cubic * std::sin(3 * t),
                    0);
    return {S * a / (8 * m.mu()) * u, Q * polar * Q.transpose()};
}

FieldPoint pure_bending(const Isotropic& m, double kappa, const Vector3& x) {
    const double bow = x.x() * x.x() + m.nu * (x.z() * x.z() - x.y() * x.y());
    FieldPoint point{kappa * Vector3(x.x() * x.z(), -m.nu * x.y() * x.z(), -bow / 2),
                     Matrix3d::Zero()};
    point.stress(0, 0) = m.E * kappa * x.z();
    return point;
}

FieldPoint torsion(const Isotropic& m, double tau, const Vector3& x) {
    FieldPoint point{tau * Vector3(-x.y() * x.z(), x.x() * x.z(), 0), Matrix3d::Zero()};
    point.stress(0, 2) = point.stress(2, 0) = -m.mu() * tau * x.y();
    point.stress(1, 2) = point.stress(2, 1) = m.mu() * tau * x.x();
    return point;
}

Tip elastica(double K, double Gamma) {
    // If the tip is turned too little the angle falls below zero before the clamp; on the first
    // branch it never does.
    const double angle =
        bisect(0, pi / 2, [&](double tip) { return integrate_rod(K, Gamma, tip)[0] >= 0; });
    const RodState clamp = integrate_rod(K, Gamma, angle);
    return {clamp[2], clamp[3], angle};
}

Tip end_moment(double phi) {
    if (phi == 0) return {1, 0, 0};
    return {std::sin(phi) / phi, (1 - std::cos(phi)) / phi, phi};
}

double cowper_rectangle(double nu) { return 10 * (1 + nu) / (12 + 11 * nu); }

double timoshenko_end_load(const Isotropic& m, double L, double h, double P) {
    const double A = h * h, I = A * A / 12;
    return P * L * L * L / (3 * m.E * I) + P * L / (cowper_rectangle(m.nu) * m.mu() * A);
}

double timoshenko_uniform_load(const Isotropic& m, double L, double h, double q) {
    const double A = h * h, I = A * A / 12;
    return q * std::pow(L, 4) / (8 * m.E * I) +
           q * L * L / (2 * cowper_rectangle(m.nu) * m.mu() * A);
}

double bar_frequency(const Isotropic& m, double L, int n, Ends ends) {
    const double c = std::sqrt(m.E / m.rho);
    return ends == Ends::clamped_free ? (2 * n - 1) * c / (4 * L) : n * c / (2 * L);
}

double beam_root(int n, Ends ends) {
    // cos(x) - sign / cosh(x) has one zero between two multiples of pi.
    const double sign = ends == Ends::clamped_free ? -1 : 1;
    const int half_wave = ends == Ends::clamped_free ? n - 1 : n;
    const double side = half_wave % 2 == 0 ? 1 : -1;
    return bisect(half_wave * pi, (half_wave + 1) * pi,
                  [&](double x) { return side * (std::cos(x) - sign / std::cosh(x)) < 0; });
}

double beam_frequency(const Isotropic& m, double L, double h, int n, Ends ends) {
    return std::pow(beam_root(n, ends) / L, 2) / (2 * pi) * h * std::sqrt(m.E / (12 * m.rho));
}

double lame_frequency(const Isotropic& m, double a) {
    return std::sqrt(m.mu() / m.rho) / (std::sqrt(2) * a);
}

Vector3 lame_mode(double a, const Vector3& x) {
    const double p = pi * x.x() / a, q = pi * x.y() / a;
    return {std::cos(p) * std::sin(q), -std::sin(p) * std::cos(q), 0};
}

double swinging_cube_frequency(const Isotropic& m, double a) {
    return std::sqrt(3 * (m.lambda() + 2 * m.mu()) / m.rho) / (4 * a);
}

Vector3 swinging_cube_mode(double a, const Vector3& x) {
    const Eigen::Array3d s = (pi / (2 * a) * x).array().sin(), c = (pi / (2 * a) * x).array().cos();
    return {s[0] * c[1] * c[2], c[0] * s[1] * c[2], c[0] * c[1] * s[2]};
}

double lamb_plate_frequency(const Isotropic& m, double a, double h, int i, int j) {
    const double k2 = pi * pi * (i * i + j * j) / (a * a);
    // With s = omega^2 / (c_s k)^2. s = 0 is a spurious root, so start from a tenth of Kirchhoff's
    // plate.
    const double kirchhoff = k2 * h * h / (6 * (1 - m.nu)),
                 slow = m.mu() / (m.lambda() + 2 * m.mu());
    const double s = bisect(1e-2 * std::min(kirchhoff, 1.0), 1, [&](double t) {
        const double p = std::sqrt(1 - slow * t), q = std::sqrt(1 - t),
                     half = std::sqrt(k2) * h / 2;
        return 4 * p * q * std::tanh(q * half) < std::pow(1 + q * q, 2) * std::tanh(p * half);
    });
    return std::sqrt(s * k2 * m.mu() / m.rho) / (2 * pi);
}

double mindlin_plate_frequency(const Isotropic& m, double a, double h, int i, int j, double kappa) {
    const double k2 = pi * pi * (i * i + j * j) / (a * a),
                 D = m.E * h * h * h / (12 * (1 - m.nu * m.nu));
    const double S = kappa * m.mu() * h, mass = m.rho * h, inertia = m.rho * h * h * h / 12;
    // mass inertia w^4 - (mass (D k^2 + S) + inertia S k^2) w^2 + S D k^4 = 0, solved for w^2
    // without cancellation.
    const double b = mass * (D * k2 + S) + inertia * S * k2, c = S * D * k2 * k2;
    return std::sqrt(2 * c / (b + std::sqrt(b * b - 4 * mass * inertia * c))) / (2 * pi);
}

AlphaScheme generalized_alpha(double rho_inf) {
    const double alpha_m = (2 * rho_inf - 1) / (rho_inf + 1), alpha_f = rho_inf / (rho_inf + 1);
    return {alpha_m, alpha_f, std::pow(1 - alpha_m + alpha_f, 2) / 4, 0.5 - alpha_m + alpha_f};
}

Matrix3d amplification(const AlphaScheme& s, double Omega) {
    const double W = Omega * Omega;
    Matrix3d next, now;
    next << 1, 0, -s.beta, 0, 1, -s.gamma, W * (1 - s.alpha_f), 0, 1 - s.alpha_m;
    now << 1, 1, 0.5 - s.beta, 0, 1, 1 - s.gamma, -W * s.alpha_f, 0, -s.alpha_m;
    return next.partialPivLu().solve(now);
}

SchemeResponse response(const AlphaScheme& s, double Omega) {
    // det(z next - now) of the amplification matrix over 1 + Omega^2, which stays well scaled for
    // any Omega:
    //   (z - 1)^2 (m1 z + m0) / (1 + Omega^2) + (k1 z + k0) (q2 z^2 + q1 z + q0) Omega^2 / (1 +
    //   Omega^2)
    const double e = 1 / (1 + Omega * Omega), w = 1 - e;
    const double m1 = 1 - s.alpha_m, m0 = s.alpha_m, k1 = 1 - s.alpha_f, k0 = s.alpha_f;
    const double q2 = s.beta, q1 = 0.5 - 2 * s.beta + s.gamma, q0 = 0.5 + s.beta - s.gamma;
    const double c3 = e * m1 + w * k1 * q2, c2 = e * (m0 - 2 * m1) + w * (k0 * q2 + k1 * q1),
                 c1 = e * (m1 - 2 * m0) + w * (k0 * q1 + k1 * q0), c0 = e * m0 + w * k0 * q0;
    Matrix3d companion;
    companion << -c2 / c3, -c1 / c3, -c0 / c3, 1, 0, 0, 0, 1, 0;
    const Eigen::Vector3cd z = companion.eigenvalues();
    const auto weight = [](const std::complex<double>& x) {
        return std::pair(x.imag() != 0, std::abs(x));
    };
    const std::complex<double> main = *std::max_element(
        z.begin(), z.end(), [&](auto x, auto y) { return weight(x) < weight(y); });
    const double arg = std::abs(std::arg(main)), log = std::log(std::abs(main));
    return {z.cwiseAbs().maxCoeff(), -log / std::hypot(arg, log), Omega / arg - 1};
}

}  // namespace livetet::verification
