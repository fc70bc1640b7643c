// Forces and displacements from points of the surface.

#include "solvers/inverse/surface_registration.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <tuple>

#include "base/error.hpp"
#include "solvers/inverse/block_fixture.hpp"

namespace livetet {
namespace {

/// A neo-Hookean block whose top is seen while a zone of it is pulled up and aside.
class SurfaceRegistrationTest : public testing::Test {
  protected:
    std::vector<Vector3> truth(const Eigen::Vector3d& force) {
        return block.equilibrium(uniform, force);
    }
    double rms_error(const SurfaceRegistration& found, const std::vector<Vector3>& x) const {
        double squares = 0;
        for (std::size_t n = 0; n < x.size(); ++n)
            squares += (rest()[n] + found.displacement()[n] - x[n]).squaredNorm();
        return std::sqrt(squares / static_cast<double>(x.size()));
    }
    const std::vector<Vector3>& rest() const { return block.mesh().nodes; }

    test::PulledBlock block{"neohookean"};
    const ForceBasis uniform = uniform_forces(block.zone);
    const Eigen::Vector3d pull{0.5, 0.2, 1.6};  // N
};

TEST_F(SurfaceRegistrationTest, FindsAUniformForceAndTheWholeDisplacement) {
    const std::vector<Vector3> x = truth(pull);
    EXPECT_GT((x[block.zone.front()] - rest()[block.zone.front()]).norm(), 0.009);
    SurfaceRegistration registration(block.body, rest(), block.surface, uniform, {});
    const SurfaceRegistrationReport report = registration.fit(block.points_on_top(x, 0));
    EXPECT_TRUE(report.converged) << report.reason;
    EXPECT_LT((report.total_force_N - pull).norm(), 0.02 * pull.norm());
    EXPECT_LT(rms_error(registration, x), 0.0001);
    EXPECT_LT(report.rms_m, 0.0001);
    EXPECT_GT(report.rms_before_m, 0.002);
}

TEST_F(SurfaceRegistrationTest, OutliersDoNotPull) {
    const std::vector<Vector3> x = truth(pull);
    std::vector<Vector3> points = block.points_on_top(x, 0);
    for (std::size_t i = 0; i < points.size(); i += 8) points[i].z() += 0.03;
    SurfaceRegistration registration(block.body, rest(), block.surface, uniform, {});
    const SurfaceRegistrationReport report = registration.fit(points);
    EXPECT_TRUE(report.converged) << report.reason;
    EXPECT_EQ(report.outliers, (points.size() + 7) / 8);
    EXPECT_LT((report.total_force_N - pull).norm(), 0.03 * pull.norm());
    EXPECT_LT(rms_error(registration, x), 0.0002);
}

TEST_F(SurfaceRegistrationTest, FindsForcesWhosePlaceIsNotKnown) {
    const std::vector<Vector3> x = truth(pull);
    const auto top =
        test::nodes_where(block.mesh(), [](const Vector3& r) { return r.z() > 0.0399; });
    SurfaceRegistration registration(block.body, rest(), block.surface,
                                     smooth_forces(rest(), top, 16), {});
    const SurfaceRegistrationReport report = registration.fit(block.points_on_top(x, 0));
    EXPECT_TRUE(report.converged) << report.reason;
    EXPECT_LT(report.rms_m, 0.0004);
    EXPECT_NEAR(report.total_force_N.z(), pull.z(), 0.1 * pull.z());
    // A flat face does not show how far it slid.
    double squares = 0;
    for (std::size_t n = 0; n < x.size(); ++n)
        squares += std::pow(rest()[n].z() + registration.displacement()[n].z() - x[n].z(), 2);
    EXPECT_LT(std::sqrt(squares / static_cast<double>(x.size())), 0.0007);
}

/// Two zones of three patterns each: after the first iterations the forces of a zone are still
/// alike, and at the end they are not.
TEST_F(SurfaceRegistrationTest, MovesEachZoneAsAWholeAtFirst) {
    const auto side = [&](double from, double to) {
        return test::nodes_where(block.mesh(), [&](const Vector3& r) {
            return r.z() > 0.0399 && r.x() > from && r.x() < to;
        });
    };
    ForceBasis zones = smooth_forces(rest(), side(-1, 0.03), 3);
    zones.add(smooth_forces(rest(), side(0.05, 1), 3));
    const Eigen::MatrixXd whole = zones.of_whole_zones();
    ASSERT_EQ(whole.rows(), 18);
    ASSERT_EQ(whole.cols(), 6);
    EXPECT_EQ(whole.sum(), 18);
    const std::vector<Vector3> points = block.points_on_top(truth(pull), 0);
    const auto spread = [&](int iterations) {
        SurfaceRegistration registration(block.body, rest(), block.surface, zones,
                                         {.max_iterations = iterations, .starts_whole = true});
        (void)registration.fit(points);
        const Eigen::VectorXd p = registration.coefficients();
        EXPECT_GT(p.norm(), 0);
        const Eigen::VectorXd mean = whole * (whole.transpose() * p / 3);
        return (p - mean).norm() / p.norm();
    };
    EXPECT_LT(spread(1), 1e-12);
    EXPECT_GT(spread(30), 0.05);
}

TEST_F(SurfaceRegistrationTest, FollowsASequenceFromFrameToFrame) {
    SurfaceRegistration registration(block.body, rest(), block.surface, uniform, {});
    std::vector<std::vector<Vector3>> frames;
    for (const double share : {0.8, 0.9, 1.0}) frames.push_back(truth(share * pull));
    std::vector<int> iterations;
    for (const auto& x : frames) {
        const SurfaceRegistrationReport report = registration.fit(block.points_on_top(x, 0));
        EXPECT_TRUE(report.converged) << report.reason;
        EXPECT_LT(rms_error(registration, x), 0.0002);
        iterations.push_back(report.iterations);
    }
    EXPECT_LT(iterations[1], iterations[0]);
    EXPECT_LT(iterations[2], iterations[0]);
}

/// phi / nu + p^T R p / (2 E0) has the minimum of phi + p^T R p nu / (2 E0), and nu times the
/// covariance.
TEST_F(SurfaceRegistrationTest, PointsThatShareAnErrorWeighLess) {
    const std::vector<Vector3> points = block.points_on_top(truth(pull), 0.0004);
    const auto fitted = [&](double shared_m, double energy_J) {
        SurfaceRegistration registration(block.body, rest(), block.surface, uniform,
                                         {.shared_error_m = shared_m,
                                          .prior_energy_J = energy_J,
                                          .tolerance_m = 1e-5,
                                          .equilibrium_tolerance = 1e-6});
        const SurfaceRegistrationReport report = registration.fit(points);
        EXPECT_TRUE(report.converged) << report.reason;
        return std::tuple(report.sharing_points, registration.coefficients(),
                          registration.posterior().covariance);
    };
    const double energy_J = 1e-4;
    const auto [nu, p, c] = fitted(0.02, energy_J);
    EXPECT_GT(nu, 5);
    EXPECT_LT(nu, static_cast<double>(points.size()));
    const auto [one, alone, spread] = fitted(0, energy_J / nu);
    EXPECT_EQ(one, 1);
    EXPECT_LT((p - alone).norm(), 1e-3 * p.norm());
    EXPECT_LT((c - nu * spread).norm(), 0.01 * c.norm());
    const auto [same, freely, narrow] = fitted(0, energy_J);
    EXPECT_GT((p - freely).norm(), 0.01 * p.norm());
}

TEST_F(SurfaceRegistrationTest, ChoosesTheEnergyOfThePriorByTheEvidence) {
    test::PulledBlock linear("linear");
    const std::vector<Vector3> x = linear.equilibrium(uniform, 0.5 * pull);
    const auto top =
        test::nodes_where(block.mesh(), [](const Vector3& r) { return r.z() > 0.0399; });
    SurfaceRegistration registration(linear.body, rest(), linear.surface,
                                     smooth_forces(rest(), top, 6), {});
    const SurfaceRegistrationReport report = registration.fit(linear.points_on_top(x, 0));
    EXPECT_TRUE(report.converged) << report.reason;
    ASSERT_FALSE(report.prior.at_bound);
    // MacKay's fixed point: what the forces store is the energy of the directions determined.
    const double stored = 2 * linear.body.strain_energy();
    const double expected = report.prior.determined * report.prior.energy;
    EXPECT_NEAR(std::log(stored / expected), 0, 0.3);
    EXPECT_LT(report.prior.log_spread, 1);

    // It scales with the modulus, as forces and energies do; the displacement does not change.
    test::PulledBlock stiff("linear", Formulation::displacement, 10);
    SurfaceRegistration harder(stiff.body, rest(), stiff.surface, smooth_forces(rest(), top, 6),
                               {});
    const SurfaceRegistrationReport other = harder.fit(linear.points_on_top(x, 0));
    EXPECT_NEAR(other.prior.energy, 10 * report.prior.energy, 0.3 * other.prior.energy);
    EXPECT_LT(rms_error(harder, x), 1.1 * rms_error(registration, x) + 1e-5);
}

/// By Newton's decrement a fit ends a tenth of a standard deviation from the optimum, RMS.
TEST_F(SurfaceRegistrationTest, EndsWhereLittleIsLeftByTheSpread) {
    const std::vector<Vector3> points = block.points_on_top(truth(pull), 0);
    const auto fitted = [&](double spread_share) {
        auto fit = std::make_unique<SurfaceRegistration>(
            block.body, rest(), block.surface, uniform,
            SurfaceRegistrationOptions{.point_error_m = 0.002,
                                       .prior_energy_J = 0.01,
                                       .tolerance_m = 1e-7,
                                       .spread_share = spread_share});
        const SurfaceRegistrationReport report = fit->fit(points);
        EXPECT_EQ(std::string(report.reason) == "what is left is small to the spread",
                  spread_share > 0)
            << report.reason;
        return std::pair(std::move(fit), report.iterations);
    };
    const auto [coarse, few] = fitted(0.1);
    const Eigen::VectorXd found = coarse->coefficients();
    const auto [fine, many] = fitted(0);
    EXPECT_LT(few, many);
    const Eigen::VectorXd left = found - fine->coefficients();
    EXPECT_LT(left.dot(fine->posterior().covariance.ldlt().solve(left)), 0.01 * 3);
}

TEST_F(SurfaceRegistrationTest, SaysThatItDidNotConverge) {
    SurfaceRegistration registration(block.body, rest(), block.surface, uniform,
                                     {.max_iterations = 1});
    const SurfaceRegistrationReport report = registration.fit(block.points_on_top(truth(pull), 0));
    EXPECT_FALSE(report.converged);
    EXPECT_STREQ(report.reason, "the iterations allowed are used up");
    EXPECT_LT(report.rms_m, report.rms_before_m);
}

/// The next tangent is of the pressures, too.
TEST(SurfaceRegistrationMixed, ARefusedStepLeavesTheBodyInEquilibrium) {
    test::PulledBlock block{"neohookean", Formulation::mixed};
    const ForceBasis uniform = uniform_forces(block.zone);
    const std::vector<Vector3> x = block.equilibrium(uniform, Eigen::Vector3d(0.5, 0.2, 1.6));  // N
    SurfaceRegistration registration(block.body, block.mesh().nodes, block.surface, uniform,
                                     {.tolerance_m = 1e-30, .spread_share = 0});
    const SurfaceRegistrationReport report = registration.fit(block.points_on_top(x, 0));
    ASSERT_STREQ(report.reason, "no step along the Gauss-Newton direction lowers the misfit");
    const std::vector<double> found = block.body.gather_state().pressure;
    const StepReport again = block.body.solve(0, {.tolerance = 1e-6, .linear_tolerance = 1e-8});
    ASSERT_TRUE(again.converged) << again.reason;
    const std::vector<double> exact = block.body.gather_state().pressure;
    ASSERT_FALSE(exact.empty());
    double largest = 0, off = 0;
    for (std::size_t n = 0; n < exact.size(); ++n) {
        largest = std::max(largest, std::abs(exact[n]));
        off = std::max(off, std::abs(found[n] - exact[n]));
    }
    EXPECT_GT(largest, 0);
    EXPECT_LT(off, 0.1 * largest);
}

TEST_F(SurfaceRegistrationTest, RefusesPointsInAnotherUnit) {
    SurfaceRegistration registration(block.body, rest(), block.surface, uniform, {});
    std::vector<Vector3> points = block.points_on_top(rest(), 0);
    for (Vector3& c : points) c *= 1000;
    EXPECT_THROW((void)registration.fit(points), Error);
}

TEST_F(SurfaceRegistrationTest, RefusesForcesThatMoveNothingAndBadOptions) {
    const auto fixed =
        test::nodes_where(block.mesh(), [](const Vector3& r) { return r.z() < 1e-9; });
    EXPECT_THROW(SurfaceRegistration(block.body, rest(), block.surface, uniform_forces(fixed), {}),
                 Error);
    EXPECT_THROW(SurfaceRegistration(block.body, rest(), block.surface, ForceBasis(), {}), Error);
    EXPECT_THROW(
        SurfaceRegistration(block.body, rest(), block.surface, uniform, {.point_error_m = 0}),
        Error);
}

/// Of the same block: points of its whole free surface, seen from a frame that is turned and moved.
class SurfaceRegistrationPoseTest : public SurfaceRegistrationTest {
  protected:
    std::vector<Vector3> points_all_over(const std::vector<Vector3>& x) const {
        std::vector<Vector3> points;
        for (const Triangle& t : block.surface)
            if (rest()[t[0]].z() + rest()[t[1]].z() + rest()[t[2]].z() > 1e-9)
                points.push_back((x[t[0]] + x[t[1]] + x[t[2]]) / 3);
        return points;
    }
    const PointPose moved{Vector3(0.04, 0.04, 0.02), Vector3(0.003, -0.002, 0.001),
                          Vector3(0.02, -0.03, 0.02)};
    const SurfaceRegistrationOptions with_pose{
        .tolerance_m = 0.0001, .pose_error_m = 0.005, .pose_error_rad = 0.05};
};

TEST_F(SurfaceRegistrationPoseTest, FindsTheRigidMotionWithTheForces) {
    const std::vector<Vector3> x = truth(pull);
    std::vector<Vector3> points = points_all_over(x);
    for (Vector3& c : points) c = moved.inverse(c);
    SurfaceRegistration registration(block.body, rest(), block.surface, uniform, with_pose);
    const SurfaceRegistrationReport report = registration.fit(points);
    EXPECT_TRUE(report.converged) << report.reason;
    EXPECT_LT(rms_error(registration, x), 0.0002);
    EXPECT_LT((report.total_force_N - pull).norm(), 0.04 * pull.norm());
    for (std::size_t i = 0; i < points.size(); i += 7)
        EXPECT_LT((registration.pose() * points[i] - moved * points[i]).norm(), 0.0003);

    SurfaceRegistration fixed(block.body, rest(), block.surface, uniform, {});
    (void)fixed.fit(points);
    EXPECT_GT(rms_error(fixed, x), 2 * rms_error(registration, x));
}

TEST_F(SurfaceRegistrationPoseTest, LandmarksPullTheirPlacesToWhereTheyAre) {
    const std::vector<Vector3> x = truth(pull);
    const std::vector<BodyPlace> places = places_in(
        block.mesh(), std::vector<Vector3>{rest()[block.zone.front()], Vector3(0.04, 0.04, 0.03)});
    std::vector<Landmark> landmarks;
    for (const BodyPlace& place : places) landmarks.push_back({place, place.of(x)});
    const auto top =
        test::nodes_where(block.mesh(), [](const Vector3& r) { return r.z() > 0.0399; });
    const auto error_with = [&](std::span<const Landmark> given) {
        SurfaceRegistration registration(block.body, rest(), block.surface,
                                         smooth_forces(rest(), top, 16),
                                         {.landmark_error_m = 0.0005});
        const SurfaceRegistrationReport report = registration.fit(block.points_on_top(x, 0), given);
        EXPECT_TRUE(report.converged) << report.reason;
        EXPECT_LT(report.rms_m, 0.0005);
        double squares = 0;
        for (const BodyPlace& place : places)
            squares += (place.of(rest()) + place.of(registration.displacement()) - place.of(x))
                           .squaredNorm();
        const double error = std::sqrt(squares / 2);
        if (!given.empty()) {
            EXPECT_NEAR(report.landmark_rms_m, error, 1e-9);
        }
        return error;
    };
    const double without = error_with({});
    EXPECT_LT(error_with(landmarks), 0.7 * without);
}

/// One linear problem of one force: the posterior is a number that can be written down.
TEST_F(SurfaceRegistrationPoseTest, PosteriorOfALinearBodyIsThatOfLeastSquares) {
    test::PulledBlock linear("linear");
    SurfaceRegistration registration(
        linear.body, rest(), linear.surface, uniform,
        {.point_error_m = 0.001, .prior_energy_J = 1e-3, .tolerance_m = 0.001});
    const std::vector<Vector3> points = block.points_on_top(rest(), 0);
    ASSERT_TRUE(registration.fit(points).converged);
    const SurfacePosterior posterior = registration.posterior();
    ASSERT_EQ(posterior.covariance.rows(), 3);
    EXPECT_EQ(posterior.pose_ratio.size(), 0);
    // The same by finite differences of the displacement that a force of 1 N makes.
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    std::vector<std::vector<Vector3>> u;
    for (int j = 0; j < 3; ++j) {
        u.push_back(linear.equilibrium(uniform, Eigen::Vector3d::Unit(j)));
        for (std::size_t n = 0; n < rest().size(); ++n) u[j][n] -= rest()[n];
    }
    const SurfaceMatches matches = SurfaceMisfit(linear.surface, points).match(rest(), 0.001);
    for (const SurfaceMatch& m : matches.points) {
        Eigen::Vector3d row = Eigen::Vector3d::Zero();
        for (int j = 0; j < 3; ++j)
            for (int k = 0; k < 3; ++k)
                row[j] += m.weights[k] * m.direction.dot(u[j][m.nodes[k]]) / 0.001;
        information += row * row.transpose();
    }
    for (int j = 0; j < 3; ++j)
        for (int k = 0; k < 3; ++k)
            information(j, k) += uniform.project(test::as_column(u[k]))(j, 0) / 1e-3;  // R / E0
    const Eigen::Matrix3d expected = information.inverse();
    EXPECT_LT((posterior.covariance - expected).norm(), 1e-3 * expected.norm());
    // A flat face says more of forces across it than of those along it.
    EXPECT_LT(posterior.force_ratio[2], 0.5);
    EXPECT_GT(posterior.force_ratio[0], 1.5 * posterior.force_ratio[2]);

    const BodyPlace place = places_in(linear.mesh(), std::vector{Vector3(0.04, 0.04, 0.03)})[0];
    const Eigen::MatrixXd rows = registration.place_rows(place);
    for (int j = 0; j < 3; ++j)
        EXPECT_LT((rows.col(j) - place.of(u[j])).norm(), 1e-3 * place.of(u[j]).norm());
}

}  // namespace
}  // namespace livetet
