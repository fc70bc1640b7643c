#include "geometry/registration_error.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

#include "geometry/point_moments.hpp"

namespace livetet {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Points = std::span<const Vector3d>;

constexpr double outlier_probability = 0.01;
constexpr double min_outlier = 0.0005;  // metres; smaller errors are ordinary localisation errors

double unknowns(Scaling scaling) { return scaling == Scaling::similarity ? 7 : 6; }

std::vector<double> without(std::size_t i, std::span<const double> weights, std::size_t count) {
    std::vector<double> others(weights.begin(), weights.end());
    if (weights.empty()) others.assign(count, 1.0);
    others[i] = 0;
    return others;
}

// Fit of the others; nothing if they do not determine one.
std::optional<PointFit> fit_without(Points from, Points to, Scaling scaling,
                                    std::span<const double> others) {
    if (used_points(others, from.size()) < 3) return std::nullopt;
    if (!degeneracy(from, others).empty() || !degeneracy(to, others).empty()) return std::nullopt;
    return fit_points(from, to, scaling, others);
}

}  // namespace

double fle_from_fre(double fre, std::size_t fiducials, Scaling scaling,
                    std::span<const double> weights) {
    const std::size_t used = used_points(weights, fiducials);
    if (used < 3) fail("localisation error from FRE: {} fiducials, expected at least 3", used);
    return fre * std::sqrt(total_weight(weights, fiducials) /
                           (static_cast<double>(used) - unknowns(scaling) / 3));
}

double expected_tre(Points points, double fle, const Vector3d& target, Scaling scaling,
                    std::span<const double> weights) {
    const PointMoments m = checked_moments(points, points, weights);
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(m.to_from_covariance);
    const Vector3d d = eigen.eigenvectors().transpose() * (target - m.mean_to);
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
        const double d2 = d.squaredNorm() - d[k] * d[k];
        const double f2 = eigen.eigenvalues().sum() - eigen.eigenvalues()[k];
        sum += d2 / f2;
    }
    if (scaling == Scaling::similarity) sum += d.squaredNorm() / m.variance_to;
    return fle * std::sqrt((1 + sum / 3) / total_weight(weights, points.size()));
}

std::vector<std::optional<double>> leave_one_out(Points from, Points to, Scaling scaling,
                                                 std::span<const double> weights) {
    checked_moments(from, to, weights);
    std::vector<std::optional<double>> errors(from.size());
    for (std::size_t i = 0; i < from.size(); ++i)
        if (const auto fit = fit_without(from, to, scaling, without(i, weights, from.size())))
            errors[i] = fit->residuals[i].norm();
    return errors;
}

std::optional<Outlier> find_outlier(Points from, Points to, Scaling scaling,
                                    std::span<const double> weights) {
    const PointFit all = fit_points(from, to, scaling, weights);
    const double squares = all.fre * all.fre * total_weight(weights, from.size());
    const auto used = static_cast<double>(used_points(weights, from.size()));
    const double freedom = 3 * (used - 1) - unknowns(scaling);
    std::optional<Outlier> worst;
    for (std::size_t i = 0; i < from.size(); ++i) {
        if (weight_of(weights, i) == 0) continue;
        const std::vector<double> others = without(i, weights, from.size());
        const auto fit = fit_without(from, to, scaling, others);
        if (!fit) continue;
        const double left = fit->fre * fit->fre * total_weight(others, from.size());
        const double f = (squares - left) / 3 / std::max(left / freedom, 1e-20);
        const double probability = std::min(1.0, used * f_survival(f, 3, freedom));
        if (!worst || probability < worst->probability)
            worst = {i, fit->residuals[i].norm(), probability, *fit, others};
    }
    if (!worst || worst->probability > outlier_probability || worst->leave_one_out < min_outlier)
        return std::nullopt;
    return worst;
}

// P(F > f) = I_x(n/2, m/2) with x = n / (n + m f). The substitution x = sin^2 t makes the integrand
// of the incomplete beta function smooth; Simpson's rule integrates it.
double f_survival(double f, double m, double n) {
    if (!(f > 0)) return 1;
    constexpr int steps = 400;
    const double end = std::asin(std::sqrt(n / (n + m * f)));
    const auto density = [&](double t) {
        return std::pow(std::sin(t), n - 1) * std::pow(std::cos(t), m - 1);
    };
    double sum = density(0) + density(end);
    for (int i = 1; i < steps; ++i) sum += (i % 2 ? 4 : 2) * density(end * i / steps);
    return std::min(1.0, 2 * sum * end / (3 * steps) / std::beta(n / 2, m / 2));
}

}  // namespace livetet
