/// Monte Carlo of the errors of poses that an ErrorStatement states: fiducials, reference, sensors.
/// What was measured is drawn by its stated covariance; the place at which the target is then shown
/// is compared with the true one. The statement is taken where nothing else errs, or as the
/// difference of the statements with and without the source.

#include "apps/live/error_statement.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "apps/live/monte_carlo.hpp"
#include "geometry/registration_covariance.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using test::BlockStatement;
using test::MeanSquare;
using test::NormalDraws;
using test::TargetBlock;
using test::TrackedFrames;

/// A block of 80 x 80 x 60 mm.
TargetBlock coarse_block(std::vector<Vector3> targets) {
    return {test::block({6, 6, 4}, {0.08, 0.08, 0.06}), std::move(targets)};
}

/// Displacements at the targets for those of single nodes, m/m, by one solve each. A static body
/// with small strain is linear: they add up to that by all of the nodes.
class SumOfNodes {
  public:
    SumOfNodes(const TargetBlock& block, std::vector<std::int32_t> nodes)
        : block_(block), nodes_(std::move(nodes)), of_node_(block.places.size()) {
        test::StaticBody body(block.scene, block.hierarchy);
        for (std::size_t k = 0; k < nodes_.size(); ++k) {
            std::vector<Eigen::Matrix3d> at_places(block.places.size());
            for (int axis = 0; axis < 3; ++axis) {
                std::vector<Vector3> values(nodes_.size(), Vector3::Zero());
                values[k] = 1e-3 * Vector3::Unit(axis);
                const auto u = body.sample(block.places, body.moved(nodes_, values));
                for (std::size_t i = 0; i < u.size(); ++i) at_places[i].col(axis) = 1e3 * u[i];
            }
            for (std::size_t i = 0; i < at_places.size(); ++i) of_node_[i].push_back(at_places[i]);
        }
    }
    /// At a target, while the first patch's nodes follow one sensor and the rest another one.
    Vector3 at(std::size_t target, std::size_t first, const SensorDrive& one,
               const SensorDrive& other) const {
        Vector3 u = Vector3::Zero();
        for (std::size_t k = 0; k < nodes_.size(); ++k)
            u += of_node_[target][k] *
                 (k < first ? one : other).displacement(block_.mesh().nodes[nodes_[k]]);
        return u;
    }

  private:
    const TargetBlock& block_;
    std::vector<std::int32_t> nodes_;
    std::vector<std::vector<Eigen::Matrix3d>> of_node_;
};

/// The pose (d, a) off: by the convention of PoseEstimate, that of which `pose` is the estimate.
template <class To, class From>
RigidTransform<To, From> true_pose(const RigidTransform<To, From>& pose,
                                   const Eigen::Matrix<double, 6, 1>& error) {
    return {rotation_of_vector(error.tail<3>()) * pose.rotation,
            pose.translation + error.head<3>()};
}

/// An error (d, a) of the registration shifts and turns the image on the organ. That registrations
/// err so is shown in the tests of registration_covariance.
TEST(ErrorStatementMonteCarlo, FiducialsErrAsStated) {
    const TargetBlock block = coarse_block({{0.01, 0.07, 0.05}, {0.06, 0.02, 0.01}});
    BlockStatement statement(block, {});
    const TrackedFrames frames;
    const auto& image_from_reference = frames.image_from_reference;
    NormalDraws draws(71);
    Eigen::Matrix<double, 6, 6> root;  // of a covariance with all its entries
    for (int row = 0; row < 6; ++row)
        root.row(row) = (row < 3 ? 4e-4 : 8e-3) * draws.vector<6>().transpose();
    const ExpectedRegistrationError registration{root * root.transpose(), true};
    const FrameStatement stated = statement(
        {.image_from_reference = image_from_reference, .registration = &registration}, {});
    std::vector<MeanSquare> found(block.places.size());
    for (int draw = 0; draw < 4000; ++draw) {
        const auto truth = true_pose(image_from_reference, root * draws.vector<6>());
        for (std::size_t i = 0; i < found.size(); ++i) {
            const Vector3& x = block.places[i];
            found[i].add(image_from_reference.rotation *
                         (truth.inverse() * x - image_from_reference.inverse() * x));
        }
    }
    for (std::size_t i = 0; i < found.size(); ++i)
        EXPECT_TRUE(found[i].is(stated.targets[i].covariance, 0.01)) << "target " << i;
}

/// Covariance of the reference's pose, along the tracker's axes. No axis is as another, and d and a
/// are correlated. At both sensors it has the mean square that a sensor's patch takes the
/// reference's share of its noise for, position_rms^2 + 2/3 rotation_rms^2 |l|^2, so the whole
/// error reaches the patch (k = 1). With n normal to both arms l and m to n, n m^T + m n^T adds
/// nothing to that.
Eigen::Matrix<double, 6, 6> reference_covariance(double position_rms, double rotation_rms,
                                                 const Vector3& arm, const Vector3& other_arm) {
    const Vector3 n = arm.cross(other_arm).normalized();
    const Vector3 m = n.cross(Vector3(1, 2, -1)).normalized();
    const Eigen::Matrix3d axes = rotation_of_vector({0.3, 1, -0.7});
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
    covariance.topLeftCorner<3, 3>() =
        std::pow(position_rms, 2) * axes * Vector3(0.7, 0.25, 0.05).asDiagonal() * axes.transpose();
    covariance.bottomRightCorner<3, 3>() =
        std::pow(rotation_rms, 2) / 3 *
        (Eigen::Matrix3d::Identity() + 0.6 * (n * m.transpose() + m * n.transpose()));
    covariance.topRightCorner<3, 3>() =
        0.06 * position_rms * rotation_rms *
        (axes.col(0) * axes.col(0).transpose() - axes.col(1) * axes.col(1).transpose());
    covariance.bottomLeftCorner<3, 3>() = covariance.topRightCorner<3, 3>().transpose();
    return covariance;
}

/// An error of the reference's pose shifts and turns the whole organ, and moves the patches of the
/// sensors that are seen relative to it. One target is near the first patch and far from the second
/// one: there the two cancel for the most part. The other is far from both.
TEST(ErrorStatementMonteCarlo, TheReferenceErrsAsStatedAndItsErrorCancelsNearAPatch) {
    constexpr double position_rms = 5e-4, rotation_rms = 0.6 * radians_per_degree;
    const TargetBlock block = coarse_block({{0.027, 0.028, 0.052}, {0.062, 0.02, 0.018}});
    const TrackedFrames frames;
    const std::array<Vector3, 2> at{Vector3(0.025, 0.03, 0.06), Vector3(0.055, 0.05, 0.06)};
    SensorPatchOptions options = test::prompt_patch(position_rms, rotation_rms);
    options.drive.base_window_s = 4;  // the bases' own error is next to none, and is not drawn
    SensorPatch one(options), other(one);
    test::place_at(one, at[0], frames, block.mesh());
    const double time_s = test::place_at(other, at[1], frames, block.mesh());
    BlockStatement statement(block, {&one, &other});
    std::vector<std::int32_t> nodes = one.nodes();
    nodes.insert(nodes.end(), other.nodes().begin(), other.nodes().end());
    const SumOfNodes body(block, nodes);

    const auto truth = frames.tracker_from_reference();
    std::array<Vector3, 2> arms;
    for (std::size_t s = 0; s < 2; ++s)
        arms[s] = frames.tracker_from_image * at[s] - truth.translation;
    PoseEstimate estimate;
    estimate.rotation = truth.rotation;
    estimate.translation = truth.translation;
    estimate.covariance = reference_covariance(position_rms, rotation_rms, arms[0], arms[1]);
    for (std::size_t s = 0; s < 2; ++s) {
        const double whole = point_covariance(estimate.covariance, arms[s]).trace();
        ASSERT_NEAR((s ? other : one).error().value().by_reference / whole, 1, 1e-3)
            << "k is not 1";
    }
    // at rest, so that neither patches nor model err; the sensors' own errors are in both
    const PoseErrors known{&estimate, frames.image_from_reference},
        unknown{nullptr, frames.image_from_reference};
    const FrameStatement with = statement(known, {&one, &other});
    const FrameStatement without = statement(unknown, {&one, &other});

    const Eigen::Matrix<double, 6, 6> root = test::root_of<6>(estimate.covariance);
    const Eigen::Matrix3d image_from_tracker = frames.tracker_from_image.rotation.transpose();
    NormalDraws draws(72);
    std::array<MeanSquare, 2> found, apart;
    for (int draw = 0; draw < 2000; ++draw) {
        // the estimate is off, not the truth: to first order the error's sign does not matter
        const auto shown = true_pose(truth, -root * draws.vector<6>());
        SensorPatch now[] = {one, other};
        for (std::size_t s = 0; s < 2; ++s)
            now[s].follow(time_s, frames.sensor_at(at[s]), shown, frames.image_from_reference);
        for (std::size_t i = 0; i < 2; ++i) {
            const auto from_image = frames.image_from_reference.inverse();
            const Vector3& x = block.places[i];
            const Vector3 u = body.at(i, one.nodes().size(), now[0].drive(), now[1].drive());
            const Vector3 true_place = truth * (from_image * x);
            found[i].add(image_from_tracker * (true_place - shown * (from_image * Vector3(x + u))));
            apart[i].add(image_from_tracker * (true_place - shown * (from_image * x)));
        }
    }
    for (std::size_t i = 0; i < 2; ++i)
        EXPECT_TRUE(found[i].is(with.targets[i].covariance - without.targets[i].covariance, 0.02))
            << "target " << i;
    EXPECT_LT(found[0].covariance().trace(), 0.5 * apart[0].covariance().trace()) << "cancels";
}

/// The sensor's noise now, and that of sensor and reference while the base was averaged, moves and
/// turns the patch. The reference's place now is known, as its error is another source; its turn is
/// not: the statement counts it as the sensor's. It is at the sensor's place, where its turn moves
/// nothing. A tracker's noise has no direction; the responses to it do.
TEST(ErrorStatementMonteCarlo, ASensorThatMovesAndTurnsItsPatchErrsAsStated) {
    constexpr double position_rms = 2e-4, rotation_rms = 3 * radians_per_degree;
    const TargetBlock block = coarse_block({{0.037, 0.033, 0.048}, {0.018, 0.021, 0.045}});
    const Vector3 at(0.025, 0.03, 0.06);
    TrackedFrames frames;
    frames.image_from_reference.translation = at;
    SensorPatchOptions options = test::prompt_patch(position_rms, rotation_rms);
    options.drive.motion = DriveMotion::rigid;
    SensorPatch patch(options);
    test::place_at(patch, at, frames, block.mesh());
    BlockStatement statement(block, {&patch});
    const SumOfNodes body(block, patch.nodes());
    const FrameStatement stated =
        statement({.image_from_reference = frames.image_from_reference}, {&patch});

    TrackerNoise of_sensor(position_rms, rotation_rms, 73);
    TrackerNoise of_reference(position_rms, rotation_rms, 74), of_its_turn(0, rotation_rms, 75);
    std::array<MeanSquare, 2> found;
    for (int draw = 0; draw < 1000; ++draw) {
        SensorPatch now(options);
        double time_s = 0;
        const auto follow = [&](TrackerNoise& reference_noise) {
            const auto reference = reference_noise(pose_of(frames.tracker_from_reference()));
            now.follow(time_s, of_sensor(frames.sensor_at(at)), tracker_from<Reference>(reference),
                       frames.image_from_reference);
            time_s += test::sample_s;
        };
        while (!now.awaits_placement() && time_s < 5) follow(of_reference);
        follow(of_its_turn);
        for (std::size_t i = 0; i < 2; ++i) found[i].add(body.at(i, 0, now.drive(), now.drive()));
    }
    for (std::size_t i = 0; i < 2; ++i)
        EXPECT_TRUE(found[i].is(stated.targets[i].covariance, 0.03)) << "target " << i;
}

}  // namespace
}  // namespace livetet
