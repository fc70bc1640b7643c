#pragma once

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <cmath>
#include <random>

#include "apps/live/error_statement.hpp"
#include "apps/scene/body_factory.hpp"
#include "mesh/hierarchy.hpp"
#include "mesh/quadratic.hpp"
#include "support/shapes.hpp"
#include "tracking/poses.hpp"

/// What the Monte Carlo tests of an ErrorStatement share: draws, real bodies, tracked sensors.
namespace livetet::test {

/// A root L of a covariance, which may be singular: L L^T is the covariance.
template <int n>
Eigen::Matrix<double, n, n> root_of(const Eigen::Matrix<double, n, n>& covariance) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, n, n>> eigen(covariance);
    return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
}

/// Normally distributed numbers.
class NormalDraws {
  public:
    explicit NormalDraws(std::uint64_t seed) : engine_(seed) {}
    double operator()() { return normal_(engine_); }
    template <int n>
    Eigen::Matrix<double, n, 1> vector() {
        Eigen::Matrix<double, n, 1> v;
        for (double& x : v) x = (*this)();
        return v;
    }

  private:
    std::mt19937_64 engine_;
    std::normal_distribution<double> normal_;
};

/// Mean square of the errors that were drawn.
class MeanSquare {
  public:
    void add(const Vector3& error) {
        sum_ += error * error.transpose();
        ++draws_;
    }
    Eigen::Matrix3d covariance() const { return sum_ / draws_; }

    /// Whether it is the stated covariance C. The entry ij of a mean square of n Gaussian errors
    /// scatters by sqrt((C_ii C_jj + C_ij^2) / n): four times that, and `slack` of the trace for
    /// what the statement leaves out by intent.
    ::testing::AssertionResult is(const Eigen::Matrix3d& stated, double slack) const {
        const Eigen::Matrix3d found = covariance();
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                const double scatter =
                    std::sqrt((stated(i, i) * stated(j, j) + stated(i, j) * stated(i, j)) / draws_);
                if (!(std::abs(found(i, j) - stated(i, j)) <= 4 * scatter + slack * stated.trace()))
                    return ::testing::AssertionFailure() << "entry " << i << j << " [m^2]; found\n"
                                                         << found << "\nstated\n"
                                                         << stated;
            }
        return ::testing::AssertionSuccess();
    }

  private:
    Eigen::Matrix3d sum_ = Eigen::Matrix3d::Zero();
    double draws_ = 0;
};

/// A block on a table, with targets in it.
struct TargetBlock {
    MeshHierarchy hierarchy;
    std::vector<Vector3> places;  ///< of the targets, m
    Scene scene;

    TargetBlock(TetMesh mesh, std::vector<Vector3> targets)
        : hierarchy(make_hierarchy({std::move(mesh)}, "a block")), places(std::move(targets)) {
        scene.fix.emplace_back().half_space_mm = {0, 0, 0.1, 0, 0, 1};
        scene.solver.threads = 1;
        scene.materials = {{.young_Pa = 3000, .poisson = 0.4}};
        scene.track.emplace();
        for (const Vector3& place : places) {
            TargetOptions& target = scene.track->targets.emplace_back();
            target.name = "Target " + std::to_string(scene.track->targets.size());
            target.point_mm = 1e3 * place;
        }
    }
    const TetMesh& mesh() const { return hierarchy.levels.front(); }
};

/// The body of a block in static equilibrium, solved directly, with nodes that are moved.
class StaticBody {
  public:
    StaticBody(Scene scene, const MeshHierarchy& hierarchy, const ModelChoice& strain = "linear")
        : body_(make_body(PETSC_COMM_SELF, as_static(scene, strain), hierarchy, Use::solve)),
          held_(SceneConstraints(scene, body_.mesh()).constraints()) {}

    const TetMesh& mesh() const { return body_.mesh(); }
    /// Displacements of all nodes where corners are moved by their values.
    std::vector<Vector3> moved(std::span<const std::int32_t> corners,
                               std::span<const Vector3> values) {
        Constraints constraints = held_;
        for (std::size_t k = 0; k < corners.size(); ++k)
            constraints.prescribe(corners.subspan(k, 1), values[k]);
        return solved(constraints);
    }
    /// The same where all are moved by one vector.
    std::vector<Vector3> moved(const std::vector<std::int32_t>& nodes, const Vector3& by) {
        Constraints constraints = held_;
        constraints.prescribe(nodes, by);
        return solved(constraints);
    }
    std::vector<Vector3> sample(std::span<const Vector3> places,
                                const std::vector<Vector3>& displacement) const {
        return PointSampler(body_.mesh(), places).sample(displacement);
    }

  private:
    static const Scene& as_static(Scene& scene, const ModelChoice& strain) {
        scene.track.reset();
        scene.strain = strain;
        scene.time.scheme = TimeScheme::static_equilibrium;
        scene.solver.kind = SolverKind::direct;
        return scene;
    }
    std::vector<Vector3> solved(const Constraints& constraints) {
        body_.body->set_constraints(constraints);
        EXPECT_TRUE(body_.body->solve(0, {.tolerance = 1e-8, .linear_tolerance = 1e-9}).converged);
        return body_.body->displacement();
    }

    SceneBody body_;
    Constraints held_;
};

/// A reference sensor and the image in front of a tracker, none along the axes of another.
struct TrackedFrames {
    RigidTransform<Tracker, ImageFrame> tracker_from_image{rotation_of_vector({-0.4, 0.7, 1.1}),
                                                           {0.1, 0.2, -0.3}};
    RigidTransform<ImageFrame, Reference> image_from_reference{rotation_of_vector({0.5, -0.8, 0.3}),
                                                               {0.11, 0.03, 0.07}};

    RigidTransform<Tracker, Reference> tracker_from_reference() const {
        return tracker_from_image * image_from_reference;
    }
    /// A sensor at a place in the image, as the tracker measures it without error.
    TrackedPose sensor_at(const Vector3& place) const {
        return pose_of(tracker_from_image * RigidTransform<ImageFrame, Sensor>{
                                                rotation_of_vector({0.2, 0.1, -0.6}), place});
    }
};

/// Time between two samples, s.
inline constexpr double sample_s = 0.025;

/// A patch whose motion is that of the last sample alone: all motions are thought possible, so the
/// estimator smooths nothing.
inline SensorPatchOptions prompt_patch(double position_rms, double rotation_rms) {
    SensorPatchOptions options;
    PoseEstimatorOptions& estimator = options.follower.estimator;
    estimator.position_rms = position_rms;
    estimator.rotation_rms = rotation_rms;
    estimator.acceleration_densities.fill(1e5);
    estimator.turn_acceleration_densities.fill(1e6);
    return options;
}

/// A patch whose motion has no error that is stated: no covariance comes with a filter, and this
/// one changes nothing.
inline SensorPatchOptions exact_patch() {
    SensorPatchOptions options = prompt_patch(1e-3, 0.01);
    options.follower.filter.emplace().enabled = false;
    return options;
}

/// Follows a sensor at rest without noise until its patch is placed. Returns the time, s.
inline double place_at(SensorPatch& patch, const Vector3& place, const TrackedFrames& frames,
                       const TetMesh& mesh) {
    double time_s = 0;
    for (; !patch.awaits_placement() && time_s < 5; time_s += sample_s)
        patch.follow(time_s, frames.sensor_at(place), frames.tracker_from_reference(),
                     frames.image_from_reference);
    const std::vector<Vector3> still(mesh.nodes.size(), Vector3::Zero());
    patch.place(mesh, surface_nodes(mesh), still, 0.02);
    return time_s;
}

/// The statement of a block, with all its responses.
class BlockStatement {
  public:
    BlockStatement(const TargetBlock& block, std::vector<const SensorPatch*> patches)
        : statement_(block.scene, block.hierarchy, block.mesh()),
          still_(block.mesh().nodes.size(), Vector3::Zero()) {
        statement_.start(patches, block.scene.fix);
        while (statement_.work()) {
        }
    }
    /// Of a body whose nodes are displaced; empty: at rest.
    FrameStatement operator()(const PoseErrors& poses, std::vector<const SensorPatch*> patches,
                              const std::vector<Vector3>& displacement = {},
                              std::optional<double> solver_error = {}) {
        return statement_.update(poses, patches, displacement.empty() ? still_ : displacement,
                                 {solver_error});
    }

  private:
    ErrorStatement statement_;
    std::vector<Vector3> still_;
};

}  // namespace livetet::test
