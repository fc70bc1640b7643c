#include "solvers/inverse/prior_evidence.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <cmath>
#include <limits>
#include <numbers>

#include "base/error.hpp"

namespace livetet {

namespace {

Eigen::LLT<Eigen::MatrixXd> positive(const Eigen::MatrixXd& matrix, const char* name) {
    Eigen::LLT<Eigen::MatrixXd> factor(matrix);
    if (factor.info() != Eigen::Success)
        fail("prior evidence: {} is not positive definite, expected a proper prior", name);
    return factor;
}

double log_determinant(const Eigen::LLT<Eigen::MatrixXd>& factor) {
    return 2 * factor.matrixLLT().diagonal().array().log().sum();
}

}  // namespace

PriorEvidence::PriorEvidence(const LinearMisfit& misfit, const Eigen::MatrixXd& shape,
                             const Eigen::MatrixXd& precision) {
    const Eigen::Index n = shape.rows(), others = precision.rows();
    if (n == 0 || misfit.information.rows() != n + others || misfit.projected.size() != n + others)
        fail("prior evidence: found {} unknowns, expected {} of R and {} of P",
             misfit.information.rows(), n, others);
    Eigen::MatrixXd a = misfit.information.topLeftCorner(n, n);
    Eigen::VectorXd c = misfit.projected.head(n);
    constant_ = -misfit.squares / 2;
    if (others > 0) {
        const auto factor =
            positive(misfit.information.bottomRightCorner(others, others) + precision, "P");
        const Eigen::MatrixXd coupling = misfit.information.bottomLeftCorner(others, n);
        const Eigen::VectorXd b = misfit.projected.tail(others);
        a -= coupling.transpose() * factor.solve(coupling);
        c -= coupling.transpose() * factor.solve(b);
        constant_ += (b.dot(factor.solve(b)) + log_determinant(positive(precision, "P")) -
                      log_determinant(factor)) /
                     2;
    }
    (void)positive(shape, "R");
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
        (a + a.transpose()) / 2, (shape + shape.transpose()) / 2);
    lambda_ = eigen.eigenvalues().cwiseMax(0);  // round-off may leave small negative ones
    squares_ = (eigen.eigenvectors().transpose() * c).cwiseAbs2();
    if (!(lambda_.maxCoeff() > 0) || !std::isfinite(lambda_.maxCoeff()))
        fail("prior evidence: the residuals do not depend on the unknowns, expected that some do");
}

double PriorEvidence::log_evidence(double energy) const {
    const double a = 1 / energy;
    double sum = 0;
    for (Eigen::Index k = 0; k < lambda_.size(); ++k)
        sum += (squares_[k] / (lambda_[k] + a) - std::log1p(lambda_[k] * energy)) / 2;
    return constant_ + sum;
}

double PriorEvidence::determined(double energy) const {
    return (lambda_.array() * energy / (1 + lambda_.array() * energy)).sum();
}

PriorWeight PriorEvidence::best() const {
    constexpr double range = 1e6;
    constexpr int scanned = 73;  // six a factor of 3.2: the evidence may have several maxima
    constexpr int narrowings = 40;
    const double low = std::log(1 / lambda_.maxCoeff()), width = std::log(range);
    const auto at = [&](double t) { return log_evidence(std::exp(t)); };
    const double step = width / (scanned - 1);
    int best = 0;
    for (int i = 1; i < scanned; ++i)
        if (at(low + i * step) > at(low + best * step)) best = i;

    // Golden section between the neighbours of the largest.
    constexpr double share = 1 / std::numbers::phi;
    double left = low + std::max(best - 1, 0) * step;
    double right = low + std::min(best + 1, scanned - 1) * step;
    for (int k = 0; k < narrowings; ++k) {
        const double inner = right - share * (right - left), outer = left + share * (right - left);
        (at(inner) > at(outer) ? right : left) = at(inner) > at(outer) ? outer : inner;
    }
    const double t = (left + right) / 2;
    constexpr double h = 1e-2;  // of ln E0
    const double curvature = -(at(t + h) - 2 * at(t) + at(t - h)) / (h * h);
    return {.energy = std::exp(t),
            .log_spread =
                curvature > 0 ? 1 / std::sqrt(curvature) : std::numeric_limits<double>::infinity(),
            .at_bound = best == 0 || best == scanned - 1,
            .determined = determined(std::exp(t))};
}

}  // namespace livetet
