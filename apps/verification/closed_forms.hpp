#pragma once

#include <Eigen/Core>

#include <array>

#include "mesh/tet_mesh.hpp"

/// Reference values of linear elasticity, slender rods, vibrations and time schemes, as formulas or
/// short numerical solutions. Any consistent set of units, such as metres, newtons, kilograms,
/// seconds.
namespace livetet::verification {

using Eigen::Matrix3d;

/// An isotropic material: Young's modulus, Poisson's ratio, density.
struct Isotropic {
    double E = 1, nu = 0.3, rho = 1;

    double lambda() const { return E * nu / ((1 + nu) * (1 - 2 * nu)); }
    double mu() const { return E / (2 * (1 + nu)); }
};

// ---- Fields of small strain

/// Radial displacement and stresses at one radius.
struct RadialState {
    double u, sigma_r, sigma_theta, sigma_z;
};

/// Hollow sphere a <= r <= b under inner pressure p (sigma_z: the other hoop stress, equal to
/// sigma_theta).
///   c = p a^3 / (b^3 - a^3),  u = c r / E ((1 - 2 nu) + (1 + nu) b^3 / (2 r^3)),
///   sigma_r = c (1 - b^3 / r^3),  sigma_theta = c (1 + b^3 / (2 r^3)).
/// Source: Lame; Timoshenko and Goodier, Theory of Elasticity (3rd edition), section 136.
RadialState thick_sphere(const Isotropic& m, double a, double b, double p, double r);

/// Tube a <= r <= b under inner pressure p, in plane strain (u_z = 0).
///   c = p a^2 / (b^2 - a^2),  u = c (1 + nu) / E ((1 - 2 nu) r + b^2 / r),
///   sigma_r = c (1 - b^2 / r^2),  sigma_theta = c (1 + b^2 / r^2),  sigma_z = 2 nu c.
/// Source: Lame; Timoshenko and Goodier, section 28.
RadialState thick_cylinder(const Isotropic& m, double a, double b, double p, double r);

/// Displacement and stress at one point.
struct FieldPoint {
    Vector3 u;
    Matrix3d stress;
};

/// Circular hole of radius a about the z axis in an infinite body in plane strain, tension S along
/// x far away: sigma_xx(0, a) = 3 S. Source: Kirsch (1898); displacements after Kolosov with kappa
/// = 3 - 4 nu.
FieldPoint kirsch(const Isotropic& m, double a, double S, const Vector3& x);

/// Pure bending by the curvature kappa: u = kappa (x z, -nu y z, -(x^2 + nu (z^2 - y^2)) / 2),
/// sigma_xx = E kappa z, all else zero; no body force. Source: Timoshenko and Goodier, section 102.
FieldPoint pure_bending(const Isotropic& m, double kappa, const Vector3& x);

/// Torsion of a round bar about z by the twist tau per length: u = tau (-y z, x z, 0), sigma_xz =
/// -mu tau y, sigma_yz = mu tau x, all else zero; no body force. Source: Saint-Venant.
FieldPoint torsion(const Isotropic& m, double tau, const Vector3& x);

// ---- Slender rods

/// Tip of a rod of length 1 that is clamped along x: position (x, w), with w towards the load, and
/// rotation `angle`, rad.
struct Tip {
    double x, w, angle;
};

/// The elastica (inextensible, no shear) under dead loads across its first direction: K = P L^2 /
/// (E I) at the tip and Gamma = q L^3 / (E I) spread along the rod. Loads from 0 to 100. To 1e-10.
///   theta'' = -(K + Gamma (1 - s)) cos theta,  theta(0) = 0,  theta'(1) = 0.
/// Shooting from the tip: fourth-order Runge-Kutta, bisection on the tip's angle, on the branch
/// that grows from no load. Source: Bisshopp and Drucker (1945), Quart. Appl. Math. 3 (end load);
/// Rohde (1953), Quart. Appl. Math. 11.
Tip elastica(double K, double Gamma);

/// The rod under an end moment, phi = M L / (E I): an arc of angle phi.
Tip end_moment(double phi);

/// Cowper's shear coefficient of a rectangular section, 10 (1 + nu) / (12 + 11 nu). Source: Cowper
/// (1966), J. Appl. Mech. 33.
double cowper_rectangle(double nu);

/// Deflection of the tip of Timoshenko's cantilever of length L, square section h x h, under the
/// force P at its end: P L^3 / (3 E I) + P L / (k G A). Beam theory: a solid differs by what its
/// clamp does.
double timoshenko_end_load(const Isotropic& m, double L, double h, double P);

/// The same under the load q per length: q L^4 / (8 E I) + q L^2 / (2 k G A).
double timoshenko_uniform_load(const Isotropic& m, double L, double h, double q);

// ---- Vibrations: frequencies in Hz

enum class Ends { clamped_free, free_free };

/// Axial mode n = 1, 2, ... of a bar of length L: (2 n - 1) c / (4 L) clamped-free, n c / (2 L)
/// free-free, with c = sqrt(E / rho). Exact for a solid of nu = 0.
double bar_frequency(const Isotropic& m, double L, int n, Ends ends);

/// beta_n L of mode n = 1, 2, ... of an Euler-Bernoulli beam: cos(x) cosh(x) = -1 clamped-free, +1
/// free-free.
double beam_root(int n, Ends ends);

/// Bending mode n of an Euler-Bernoulli beam, square section h x h: (beta_n L)^2 / (2 pi L^2)
/// sqrt(E I / (rho A)).
double beam_frequency(const Isotropic& m, double L, double h, int n, Ends ends);

/// Lame's mode of a free block a x a x any: f = c_s / (sqrt(2) a), c_s = sqrt(mu / rho). Exact in
/// three dimensions, with no traction on any face, for any nu.
double lame_frequency(const Isotropic& m, double a);
/// Its shape on [0, a]^2: (cos(pi x / a) sin(pi y / a), -sin(pi x / a) cos(pi y / a), 0).
Vector3 lame_mode(double a, const Vector3& x);

/// The swinging cube of side a: f = sqrt(3) c_d / (4 a), c_d = sqrt((lambda + 2 mu) / rho), exact.
/// Held: u_x = 0 where x = 0, u_y = u_z = 0 where x = a, and so on around; no other traction.
double swinging_cube_frequency(const Isotropic& m, double a);
/// Its shape: with s_i, c_i the sine and cosine of pi x_i / (2 a), (s_x c_y c_z, c_x s_y c_z, c_x
/// c_y s_z).
Vector3 swinging_cube_mode(double a, const Vector3& x);

/// Bending mode (i, j) of a square plate a x a x h whose side faces move along their normals only
/// (u_y = u_z = 0 on the two across x, u_x = u_z = 0 on the two across y), top and bottom free:
/// exact in three dimensions, a standing Lamb wave. The lowest omega of the antisymmetric
/// Rayleigh-Lamb equation,
///   4 k^2 p q tanh(q h / 2) = (k^2 + q^2)^2 tanh(p h / 2),
///   k^2 = pi^2 (i^2 + j^2) / a^2,  p^2 = k^2 - omega^2 / c_d^2,  q^2 = k^2 - omega^2 / c_s^2.
/// Source: Lamb (1917); Srinivas, Joga Rao and Rao (1970), J. Sound Vib. 12, for the plate.
double lamb_plate_frequency(const Isotropic& m, double a, double h, int i, int j);

/// The same mode after Mindlin's plate theory, S = kappa mu h: the lower root in omega^2 of
///   (S k^2 - rho h omega^2) (D k^2 + S - rho h^3 omega^2 / 12) = S^2 k^2,  D = E h^3 / (12 (1 -
///   nu^2)).
/// Source: Mindlin (1951), J. Appl. Mech. 18.
double mindlin_plate_frequency(const Isotropic& m, double a, double h, int i, int j, double kappa);

/// NAFEMS FV52: square plate 10 x 10 x 1 m, E = 200 GPa, nu = 0.3, rho = 8000 kg/m^3, u_z = 0 along
/// the four edges of its lower face only. Three rigid modes (in its plane), then modes 4 to 10.
/// Source: NAFEMS, Selected benchmarks for natural frequency analysis (1987); values also in
/// Autodesk's and Altair's manuals. Modes 4 to 7 are Mindlin's plate (kappa = pi^2 / 12), not the
/// solid's: held on lines only, a solid has no limit to converge to (a line has no capacity in
/// three dimensions) and its mode 4 comes out low and falls slowly with the mesh; published runs
/// with quadratic solids have 44.6 to 44.8 Hz. For an order of convergence use
/// lamb_plate_frequency.
inline constexpr std::array<double, 7> fv52_frequencies{45.897, 109.44, 109.44, 167.89,
                                                        193.59, 206.19, 206.19};

// ---- Time schemes

/// The generalized-alpha family; Newmark's for alpha_m = alpha_f = 0.
///   M a_{n+1-alpha_m} + K u_{n+1-alpha_f} = f,  y_{n+1-alpha} = (1 - alpha) y_{n+1} + alpha y_n,
///   u_{n+1} = u_n + dt v_n + dt^2 ((1/2 - beta) a_n + beta a_{n+1}),
///   v_{n+1} = v_n + dt ((1 - gamma) a_n + gamma a_{n+1}).
struct AlphaScheme {
    double alpha_m = 0, alpha_f = 0, beta = 0.25, gamma = 0.5;
};

/// The scheme with the least damping at low frequencies for the spectral radius rho_inf at Omega =
/// infinity. Source: Chung and Hulbert (1993), J. Appl. Mech. 60.
AlphaScheme generalized_alpha(double rho_inf);

/// One step of an undamped oscillator: (u, dt v, dt^2 a)_{n+1} = A (u, dt v, dt^2 a)_n, Omega =
/// omega dt.
Matrix3d amplification(const AlphaScheme& scheme, double Omega);

/// What a scheme does to an oscillator, from an eigenvalue z of A: that of the complex pair where
/// there is one, else the largest; damping = -ln|z| / sqrt(arg(z)^2 + ln|z|^2), period_elongation =
/// Omega / |arg z| - 1. spectral_radius is over all eigenvalues. Implicit Euler has the eigenvalues
/// of Newmark with beta = 1 and gamma = 3/2, 1 / (1 +- i Omega). Source: Hughes, The Finite Element
/// Method, chapter 9.
struct SchemeResponse {
    double spectral_radius, damping, period_elongation;
};

SchemeResponse response(const AlphaScheme& scheme, double Omega);

}  // namespace livetet::verification
