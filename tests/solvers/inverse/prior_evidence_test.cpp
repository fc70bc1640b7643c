// The evidence of a prior's weight: against the marginal likelihood written out, and over draws.

#include "solvers/inverse/prior_evidence.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <cmath>
#include <numbers>
#include <random>

#include "base/error.hpp"

namespace livetet {
namespace {

Eigen::MatrixXd normal_matrix(Eigen::Index rows, Eigen::Index columns, std::mt19937_64& engine) {
    std::normal_distribution<double> normal(0, 1);
    Eigen::MatrixXd m(rows, columns);
    for (Eigen::Index j = 0; j < columns; ++j)
        for (Eigen::Index i = 0; i < rows; ++i) m(i, j) = normal(engine);
    return m;
}

Eigen::MatrixXd precision_of(Eigen::Index n, std::mt19937_64& engine) {
    const Eigen::MatrixXd m = normal_matrix(n, n + 2, engine);
    return m * m.transpose() + 0.1 * Eigen::MatrixXd::Identity(n, n);
}

/// y = G (p, m) + noise of unit variance.
struct LinearProblem {
    Eigen::MatrixXd g, shape, precision;
    Eigen::VectorXd y;

    LinearMisfit misfit() const { return {g.transpose() * g, g.transpose() * y, y.squaredNorm()}; }
    PriorEvidence evidence() const { return {misfit(), shape, precision}; }
    /// ln N(y; 0, I + G_p E0 R^-1 G_p^T + G_m P^-1 G_m^T) + N/2 ln 2 pi.
    double marginal(double energy) const {
        const Eigen::Index n = shape.rows(), others = precision.rows();
        Eigen::MatrixXd c = Eigen::MatrixXd::Identity(y.size(), y.size()) +
                            energy * g.leftCols(n) * shape.inverse() * g.leftCols(n).transpose();
        if (others > 0)
            c += g.rightCols(others) * precision.inverse() * g.rightCols(others).transpose();
        return -(y.dot(c.llt().solve(y)) + std::log(c.determinant())) / 2;
    }
};

LinearProblem random_problem(Eigen::Index others, std::uint64_t seed) {
    constexpr Eigen::Index n = 5, observations = 9;
    std::mt19937_64 engine(seed);
    return {normal_matrix(observations, n + others, engine), precision_of(n, engine),
            others ? precision_of(others, engine) : Eigen::MatrixXd(),
            3 * normal_matrix(observations, 1, engine)};
}

TEST(PriorEvidence, IsTheMarginalLikelihood) {
    for (const Eigen::Index others : {0, 2})
        for (const std::uint64_t seed : {1, 2, 3}) {
            const LinearProblem problem = random_problem(others, seed);
            const PriorEvidence evidence = problem.evidence();
            for (const double energy : {1e-3, 0.1, 1.0, 30.0, 1e4})
                EXPECT_NEAR(evidence.log_evidence(energy), problem.marginal(energy), 1e-8)
                    << others << " others, seed " << seed << ", E0 = " << energy;
        }
}

/// The integral over one coefficient, by the trapezoidal rule.
TEST(PriorEvidence, IsTheIntegralOverTheUnknown) {
    LinearProblem problem{Eigen::Vector3d(1, -0.5, 2),
                          Eigen::MatrixXd::Constant(1, 1, 3),
                          {},
                          Eigen::Vector3d(0.7, 0.2, 1.1)};
    const double energy = 2, variance = energy / 3, h = 1e-3;
    double integral = 0;
    for (double p = -12; p <= 12; p += h)
        integral +=
            h * std::exp(-(problem.y - problem.g * p).squaredNorm() / 2 - p * p / (2 * variance)) /
            std::sqrt(2 * std::numbers::pi * variance);
    EXPECT_NEAR(problem.evidence().log_evidence(energy), std::log(integral), 1e-6);
}

TEST(PriorEvidence, BestIsTheMaximumAndAFixedPointOfMacKays) {
    const LinearProblem problem = random_problem(2, 4);
    const PriorWeight best = problem.evidence().best();
    ASSERT_FALSE(best.at_bound);
    for (const double factor : {1e-3, 0.1, 0.9, 1.1, 10.0, 1e3})
        EXPECT_GT(problem.marginal(best.energy), problem.marginal(factor * best.energy));
    Eigen::MatrixXd hessian = problem.misfit().information;
    hessian.topLeftCorner(5, 5) += problem.shape / best.energy;
    hessian.bottomRightCorner(2, 2) += problem.precision;
    const Eigen::VectorXd p = hessian.ldlt().solve(problem.misfit().projected).head(5);
    EXPECT_NEAR(p.dot(problem.shape * p), best.determined * best.energy, 1e-3 * best.energy);
}

TEST(PriorEvidence, RecoversTheWeightThatForcesWereDrawnWith) {
    constexpr Eigen::Index n = 24, observations = 60;
    constexpr int draws = 400;
    constexpr double energy = 7;
    int within_two = 0;
    double sum = 0, sum_of_spreads = 0;
    for (int seed = 1; seed <= draws; ++seed) {
        std::mt19937_64 engine(static_cast<std::uint64_t>(seed));
        LinearProblem problem{normal_matrix(observations, n + 2, engine), precision_of(n, engine),
                              precision_of(2, engine), Eigen::VectorXd()};
        const auto drawn = [&](const Eigen::MatrixXd& precision) -> Eigen::VectorXd {
            return precision.llt().matrixU().solve(normal_matrix(precision.rows(), 1, engine));
        };
        Eigen::VectorXd q(n + 2);
        q << std::sqrt(energy) * drawn(problem.shape), drawn(problem.precision);
        problem.y = problem.g * q + normal_matrix(observations, 1, engine);
        const PriorWeight best = problem.evidence().best();
        const double off = std::log(best.energy / energy) / best.log_spread;
        within_two += std::abs(off) < 2;
        sum += off / draws;
        sum_of_spreads += best.log_spread / draws;
    }
    EXPECT_GT(within_two, 0.92 * draws);
    EXPECT_LT(within_two, 0.99 * draws);  // the spread is not too large either
    EXPECT_LT(std::abs(sum), 0.2);
    EXPECT_LT(sum_of_spreads, 0.45);
}

TEST(PriorEvidence, OfResidualsWithoutSignalIsSmall) {
    LinearProblem problem = random_problem(0, 5);
    problem.y.setZero();
    EXPECT_TRUE(problem.evidence().best().at_bound);
    EXPECT_LT(problem.evidence().best().determined, 3);
}

TEST(PriorEvidence, RefusesSizesThatDoNotFitAndImproperPriors) {
    LinearProblem problem = random_problem(2, 6);
    EXPECT_THROW(PriorEvidence(problem.misfit(), problem.shape, Eigen::MatrixXd()), Error);
    EXPECT_THROW(PriorEvidence(problem.misfit(), -problem.shape, problem.precision), Error);
    problem.g.leftCols(5).setZero();
    EXPECT_THROW(problem.evidence(), Error);
}

}  // namespace
}  // namespace livetet
