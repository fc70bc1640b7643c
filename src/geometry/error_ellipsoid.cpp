#include "geometry/error_ellipsoid.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.hpp"

namespace livetet {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double allowed_asymmetry = 1e-9;  // and negative eigenvalue, of the largest eigenvalue
constexpr double normal_95 = 1.959963984540054;  // P(|z| <= x) = 0.95 in one dimension
constexpr double ball_95 = 2.795483482915108;    // the same in three dimensions

// Distribution of |e| at a radius.
struct RadialDistribution {
    double probability = 0, density = 0;
};

// See `probability_within`; s descending, s[0] > 0, r > 0. d/dr brings a factor r / g.
RadialDistribution radial_distribution(const Vector3d& s, double r) {
    constexpr int nodes = 16;  // midpoints of (0, pi/2), the quarter that repeats
    const double a = r / (std::numbers::sqrt2 * s[2]);
    RadialDistribution result{std::erf(a), 0};
    for (int j = 0; j < nodes; ++j) {
        const double cos2 = 0.5 + 0.5 * std::cos(std::numbers::pi * (j + 0.5) / nodes);
        const double g = s[0] * s[0] * cos2 + s[1] * s[1] * (1 - cos2);
        const double k = std::sqrt(std::max(0.0, 1 - s[2] * s[2] / g));
        const double across = a * k > 1e-8 ? std::erf(a * k) / k : 2 * a * std::numbers::inv_sqrtpi;
        const double term = std::exp(-r * r / (2 * g)) * across / nodes;
        result.probability -= term;
        result.density += r / g * term;
    }
    return result;
}

// Newton's method in units of s[0]. The density falls beyond the 95 % radius in one dimension, so
// that the radii grow towards the solution.
double radius_95_of(const Vector3d& s) {
    if (!(s[0] > 0)) return 0;
    double r = normal_95;
    for (double step = 1; step > 1e-7;) {
        const RadialDistribution at = radial_distribution(s / s[0], r);
        step = (0.95 - at.probability) / at.density;
        r += step;
    }
    return r * s[0];
}

template <int n>
using Square = Eigen::Matrix<double, n, n>;

// An entry of a covariance of lengths and, from the fourth place on, angles.
struct CovarianceUnit {
    double per_SI = 1;
    const char* name = "";
};

CovarianceUnit unit_at(Eigen::Index row, Eigen::Index column) {
    const int angles = (row >= 3) + (column >= 3);
    if (angles == 0) return {1e6, "mm^2"};
    return angles == 1 ? CovarianceUnit{1e3, "mm rad"} : CovarianceUnit{1, "rad^2"};
}

// Eigenvalues and vectors of c(i, j) / (scale[i] scale[j]). Throws Error if c is no covariance.
template <int n>
Eigen::SelfAdjointEigenSolver<Square<n>> checked_eigen(const Square<n>& c,
                                                       const Eigen::Matrix<double, n, 1>& scale,
                                                       std::string_view what) {
    if (!c.allFinite()) fail("{}: the covariance has an entry that is not finite", what);
    const Eigen::Matrix<double, n, 1> inverse = scale.cwiseInverse();
    const Square<n> scaled = inverse.asDiagonal() * c * inverse.asDiagonal();
    Eigen::SelfAdjointEigenSolver<Square<n>> eigen(scaled);
    const double smallest = eigen.eigenvalues().minCoeff();
    const double tolerance = allowed_asymmetry * eigen.eigenvalues().cwiseAbs().maxCoeff();
    const Square<n> skew = scaled - scaled.transpose();
    Eigen::Index row = 0, column = 0;
    if (skew.cwiseAbs().maxCoeff(&row, &column) > tolerance) {
        const auto [per_SI, unit] = unit_at(row, column);
        fail("{}: the covariance has {:.6g} {} at ({}, {}) and {:.6g} at ({}, {}), expected equal",
             what, per_SI * c(row, column), unit, row + 1, column + 1, per_SI * c(column, row),
             column + 1, row + 1);
    }
    if (smallest >= -tolerance) return eigen;
    if constexpr (n == 3)
        fail("{}: the covariance has the eigenvalue {:.6g} mm^2, expected none below 0", what,
             1e6 * smallest);
    else
        fail(
            "{}: the covariance, scaled to correlations, has the eigenvalue {:.6g}, expected none "
            "below 0",
            what, smallest);
}

struct PrincipalDeviations {
    Vector3d deviations;  // descending
    Matrix3d axes;
};

PrincipalDeviations principal_deviations(const Matrix3d& covariance, std::string_view what) {
    const auto eigen = checked_eigen<3>(covariance, Vector3d::Ones(), what);
    PrincipalDeviations result{eigen.eigenvalues().cwiseMax(0).cwiseSqrt().reverse(),
                               eigen.eigenvectors().rowwise().reverse()};
    if (result.axes.determinant() < 0) result.axes.col(2) *= -1;
    return result;
}

}  // namespace

ErrorEllipsoid error_ellipsoid(const Matrix3d& covariance) {
    const auto [deviations, axes] = principal_deviations(covariance, "error ellipsoid");
    return {ball_95 * deviations, axes, radius_95_of(deviations)};
}

double probability_within(const Matrix3d& covariance, double radius) {
    const Vector3d s = principal_deviations(covariance, "error ellipsoid").deviations;
    if (!(radius > 0)) return 0;
    return s[0] > 0 ? radial_distribution(s, radius).probability : 1;
}

void check_covariance(const Matrix3d& covariance, std::string_view what) {
    checked_eigen<3>(covariance, Vector3d::Ones(), what);
}

void check_covariance(const Eigen::Matrix<double, 6, 6>& covariance, std::string_view what) {
    Eigen::Matrix<double, 6, 1> scale = covariance.diagonal().cwiseAbs().cwiseSqrt();
    for (int i = 0; i < 6; ++i) {
        // Without a variance a row must be 0: any other becomes of order 1 and is found.
        if (!(scale[i] > 0)) scale[i] = covariance.row(i).cwiseAbs().maxCoeff();
        if (!(scale[i] > 0)) scale[i] = 1;
    }
    checked_eigen<6>(covariance, scale, what);
}

}  // namespace livetet
