#include "apps/live/error_statement.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include "apps/live/statement_fixture.hpp"
#include "geometry/error_ellipsoid.hpp"
#include "geometry/registration_covariance.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using test::StatedBlock;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

double by(const TargetStatement& t, ErrorSource source) {
    return t.by_source[static_cast<std::size_t>(source)];
}

/// A tracked block at rest in front of a tracker: what the trackers measure, with noise or without,
/// followed as in a run.
class Followed {
  public:
    Followed(const StatedBlock& block, double position_rms, double rotation_rms, std::uint64_t seed)
        : block_(block),
          of_reference_(position_rms, rotation_rms, 2 * seed),
          of_sensor_(position_rms, rotation_rms, 2 * seed + 1) {
        image_from_reference.rotation = rotation_of_vector({0.1, -0.3, 0.2});
        image_from_reference.translation = {0.1, 0.02, 0.05};
        tracker_from_image.rotation = rotation_of_vector({-0.4, 0.2, 1});
        tracker_from_image.translation = {0.1, 0.2, -0.3};
        SensorPatchOptions options;
        options.drive.base_window_s = 1;
        options.radius = 0.015;
        patch = std::make_unique<SensorPatch>(options);
        block_.place(*patch, [this](double) { step(Vector3::Zero()); });
    }
    /// The next sample, with the sensor moved by `press` in the image.
    void step(const Vector3& press) {
        time_s_ += 0.025;
        const auto pose_in_tracker = [&](const auto& image_from_tool) {
            const auto pose = tracker_from_image * image_from_tool;
            return TrackedPose{pose.rotation, pose.translation, PoseStatus::ok};
        };
        const TrackedPose measured = of_reference_(pose_in_tracker(image_from_reference));
        (void)reference.update(time_s_, measured);
        const RigidTransform<ImageFrame, Sensor> sensor{Eigen::Matrix3d::Identity(),
                                                        StatedBlock::sensor_place() + press};
        patch->follow(time_s_, of_sensor_(pose_in_tracker(sensor)),
                      tracker_from<Reference>(measured), image_from_reference);
    }
    PoseErrors poses(const ExpectedRegistrationError* registration) const {
        return {reference.used() ? &*reference.used() : nullptr, image_from_reference,
                registration};
    }
    RigidTransform<ImageFrame, Reference> image_from_reference;
    RigidTransform<Tracker, ImageFrame> tracker_from_image;
    PoseFollower reference;
    std::unique_ptr<SensorPatch> patch;

  private:
    const StatedBlock& block_;
    TrackerNoise of_reference_, of_sensor_;
    double time_s_ = 0;
};

/// The statement of a block whose responses are known.
struct Stated {
    StatedBlock block;
    ErrorStatement statement{block.scene, block.hierarchy, block.mesh()};
    TargetResponses responses{block.scene, block.hierarchy, block.places};
    std::vector<Vector3> still = std::vector<Vector3>(block.mesh().nodes.size(), Vector3::Zero());

    void start(const SensorPatch& patch) {
        const SensorPatch* patches[] = {&patch};
        statement.start(patches, block.scene.fix);
        while (statement.work()) {
        }
        responses.start({{.nodes = patch.nodes(),
                          .wider_nodes = patch.wider_nodes(),
                          .wider_by = patch.wider_by(),
                          .radius_spread = patch.options().radius_spread,
                          .centre = patch.drive().base()->translation,
                          .place = patch.rest_place(),
                          .radius = patch.options().radius}},
                        block.scene.fix);
        while (responses.work()) {
        }
    }
    const FrameStatement& update(const Followed& f,
                                 const ExpectedRegistrationError* registration = nullptr,
                                 std::optional<double> solver_error = 1e-5) {
        const SensorPatch* patches[] = {f.patch.get()};
        return statement.update(f.poses(registration), patches, still, {solver_error});
    }
};

/// The errors of reference and sensor that are stated are those that noise makes: mean squares at
/// both targets over many runs. The targets are shown at T (x + G d) with the estimates of both.
TEST(ErrorStatement, PosesErrAsStated) {
    constexpr int runs = 200;
    Stated s;
    std::array<double, 2> stated{}, found{}, apart{};
    for (int run = 0; run < runs; ++run) {
        Followed f(s.block, 1.4e-3, 0.5 * radians_per_degree, static_cast<std::uint64_t>(run));
        if (run == 0) s.start(*f.patch);
        for (int k = 0; k < 40; ++k) f.step(Vector3::Zero());
        const FrameStatement& frame = s.update(f);
        const auto& estimate = *f.reference.used();
        const RigidTransform<Tracker, Reference> reference{estimate.rotation, estimate.translation};
        const auto estimated = reference * f.image_from_reference.inverse();
        for (std::size_t i = 0; i < 2; ++i) {
            const Vector3& x = s.block.places[i];
            const Vector3 u =
                s.responses.at(i, 0).motion.leftCols<3>() * f.patch->motion().head<3>();
            const TargetStatement& t = frame.targets[i];
            stated[i] += by(t, ErrorSource::reference) + by(t, ErrorSource::sensors);
            found[i] += (estimated * Vector3(x + u) - f.tracker_from_image * x).squaredNorm();
            apart[i] += (estimated * x - f.tracker_from_image * x).squaredNorm() + u.squaredNorm();
        }
    }
    for (std::size_t i = 0; i < 2; ++i) {
        // At rest the filter is a little better than it states: it stays ready to move.
        EXPECT_GT(std::sqrt(stated[i] / found[i]), 0.9) << "target " << i;
        EXPECT_LT(std::sqrt(stated[i] / found[i]), 1.3) << "target " << i;
        EXPECT_GT(std::sqrt(found[i] / runs), 2e-4) << "there is an error";
    }
    EXPECT_LT(found[0], 0.9 * apart[0]) << "the reference's error cancels near the sensor";
}

/// Two sensors at one place, each with half the response: their own noise averages out, the
/// reference's does not, now or when they were placed.
TEST(ErrorStatement, SensorsThatArePlacedTogetherShareTheReferencesError) {
    Stated one, two;
    Followed f(one.block, 1.4e-3, 0.5 * radians_per_degree, 7);
    for (int k = 0; k < 40; ++k) f.step(Vector3::Zero());
    one.start(*f.patch);
    const SensorPatch* both[] = {f.patch.get(), f.patch.get()};
    two.statement.start(both, two.block.scene.fix);
    while (two.statement.work()) {
    }
    const FrameStatement& of_one = one.update(f);
    const FrameStatement& of_two = two.statement.update(f.poses(nullptr), both, two.still, {1e-5});
    for (std::size_t i = 0; i < 2; ++i) {
        const TargetStatement &a = of_one.targets[i], &b = of_two.targets[i];
        const double reference = by(a, ErrorSource::reference), own = by(a, ErrorSource::sensors);
        EXPECT_NEAR(by(b, ErrorSource::reference), reference, 0.02 * reference) << "target " << i;
        EXPECT_NEAR(by(b, ErrorSource::sensors), own / 2, 0.02 * own) << "target " << i;
        EXPECT_GT(own, 1e-8);
    }
}

/// A tracker three times as noisy as it is said to be is found out, and the radius grows.
TEST(ErrorStatement, MoreNoiseThanStatedMakesTheRadiusLarger) {
    Stated s;
    std::array<double, 2> by_noise{};
    for (const int times : {1, 3}) {
        Followed f(s.block, times * 1.4e-3, times * 0.5 * radians_per_degree, 5);
        s.start(*f.patch);
        for (int k = 0; k < 80; ++k) f.step(Vector3::Zero());
        const TargetStatement& t = s.update(f).targets[0];
        by_noise[times == 3] = by(t, ErrorSource::reference) + by(t, ErrorSource::sensors);
    }
    EXPECT_GT(std::sqrt(by_noise[1]), 1.8 * std::sqrt(by_noise[0]));
}

/// Registration: the covariance at the target, and none without it.
TEST(ErrorStatement, TheRegistrationsErrorIsThatAtTheTarget) {
    Stated s;
    Followed f(s.block, 0, 0, 1);
    s.start(*f.patch);
    ExpectedRegistrationError error{Matrix6d::Zero(), true};
    error.covariance.diagonal() << 1e-7, 2e-7, 3e-7, 1e-5, 2e-5, 3e-5;
    const FrameStatement with = s.update(f, &error);
    EXPECT_FALSE(with.missing.has(ErrorSource::fiducials));
    for (std::size_t i = 0; i < 2; ++i) {
        const Vector3 arm = s.block.places[i] - f.image_from_reference.translation;
        EXPECT_NEAR(by(with.targets[i], ErrorSource::fiducials),
                    point_covariance(error.covariance, arm).trace(), 1e-12);
    }
    const FrameStatement without = s.update(f);
    EXPECT_TRUE(without.missing.has(ErrorSource::fiducials));
    EXPECT_EQ(by(without.targets[0], ErrorSource::fiducials), 0);
    EXPECT_LT(without.targets[0].radius_95, with.targets[0].radius_95);
    error.holds_tip = false;
    EXPECT_TRUE(s.update(f, &error).missing.has(ErrorSource::fiducials)) << "not wholly known";
}

/// What a press leaves open: elements, material, radius and the effect of large strain, each by its
/// response; the sum is the covariance, and the radius is that of the covariance.
TEST(ErrorStatement, AModelsErrorsGrowWithThePress) {
    Stated s;
    Followed f(s.block, 0, 0, 1);
    s.start(*f.patch);
    for (int k = 0; k < 60; ++k) f.step({0, 0, -0.01 * std::min(1.0, k / 20.0)});
    const auto d = f.patch->motion();
    ASSERT_NEAR(d[2], -0.01, 1e-4);
    const FrameStatement& frame = s.update(f);
    for (std::size_t i = 0; i < 2; ++i) {
        const TargetStatement& t = frame.targets[i];
        const PatchResponse& r = s.responses.at(i, 0);
        EXPECT_NEAR(by(t, ErrorSource::elements), (r.elements * d).squaredNorm(), 1e-13);
        EXPECT_NEAR(by(t, ErrorSource::materials), (r.materials[0] * d).squaredNorm(), 1e-13);
        const double radius = (r.wider * d).squaredNorm();
        EXPECT_GT(by(t, ErrorSource::patches), radius);
        EXPECT_LT(by(t, ErrorSource::patches), 4 * radius + 1e-7);
        // the body of the test does not move: all of the linear response is "large strain"
        EXPECT_NEAR(by(t, ErrorSource::law), std::pow(0.3, 2) * (r.motion * d).squaredNorm(),
                    1e-12);
        double sum = 0;
        for (const double square : t.by_source) sum += square;
        EXPECT_NEAR(t.covariance.trace(), sum, 1e-6 * sum);
        EXPECT_NEAR(t.radius_95, error_ellipsoid(t.covariance).radius_95, 1e-12);
        EXPECT_EQ(t.position, s.block.places[i]) << "as the body is";
    }
}

TEST(ErrorStatement, WhatIsNotKnownIsMissingAndNeverLeftUnsaid) {
    Stated s;
    Followed f(s.block, 1e-3, 0, 1);
    const SensorPatch* patches[] = {f.patch.get()};
    s.statement.start(patches, s.block.scene.fix);
    const FrameStatement at_first = s.update(f);
    EXPECT_EQ(at_first.computed, 0);
    for (const ErrorSource source :
         {ErrorSource::sensors, ErrorSource::patches, ErrorSource::materials, ErrorSource::fixed,
          ErrorSource::elements, ErrorSource::law, ErrorSource::fiducials})
        EXPECT_TRUE(at_first.missing.has(source)) << name_of(source);
    EXPECT_FALSE(at_first.missing.has(ErrorSource::reference));
    while (s.statement.work()) {
    }
    const FrameStatement known = s.update(f);
    EXPECT_EQ(known.computed, 1);
    EXPECT_FALSE(known.missing.has(ErrorSource::sensors));
    EXPECT_FALSE(known.missing.has(ErrorSource::elements));
    EXPECT_FALSE(known.missing.has(ErrorSource::solver));
    EXPECT_NEAR(by(known.targets[0], ErrorSource::solver), 1e-10, 1e-16);
    EXPECT_TRUE(s.update(f, nullptr, std::nullopt).missing.has(ErrorSource::solver));
    const FrameStatement turned = s.statement.update(f.poses(nullptr), patches, s.still,
                                                     {.linear = 1e-5, .has_turned_elements = true});
    EXPECT_TRUE(turned.missing.has(ErrorSource::elements));
    EXPECT_TRUE(turned.missing.has(ErrorSource::law));
    // the sensor is lost: where it is now is a guess
    for (int k = 0; k < 10; ++k)
        f.patch->follow(100 + 0.025 * k, {}, RigidTransform<Tracker, Reference>{},
                        f.image_from_reference);
    const FrameStatement lost = s.update(f);
    EXPECT_TRUE(lost.missing.has(ErrorSource::sensors));
    const PoseErrors no_reference{nullptr, f.image_from_reference};
    EXPECT_TRUE(s.statement.update(no_reference, patches, s.still, {0})
                    .missing.has(ErrorSource::reference));
}

/// A block with a target at each of its surface's places whose coordinates survive the change of
/// units in a scene, and the statement of a press.
struct StatedSurface {
    StatedBlock block;
    std::vector<Vector3> places = surface_places(block.mesh());
    std::vector<std::size_t> with_target;
    std::vector<Vector3> displacement;
    ExpectedRegistrationError error{Matrix6d::Identity() * 1e-6, true};

    StatedSurface() {
        block.scene.track->targets.clear();
        for (std::size_t i = 0; i < places.size(); ++i) {
            const Vector3 mm = 1e3 * places[i];
            if (mm / 1e3 != places[i]) continue;
            TargetOptions& target = block.scene.track->targets.emplace_back();
            target.name = fmt::format("{}", i);
            target.point_mm = mm;
            with_target.push_back(i);
        }
        for (const Vector3& x : block.mesh().nodes)
            displacement.emplace_back(0, 0.1 * x.x(), -0.1 * x.z());
    }
    ErrorStatement statement() const { return {block.scene, block.hierarchy, block.mesh()}; }
    const FrameStatement& update(ErrorStatement& statement, const Followed& f) const {
        const SensorPatch* patches[] = {f.patch.get()};
        return statement.update(f.poses(&error), patches, displacement, {1e-5});
    }
    void start(ErrorStatement& statement, const Followed& f) const {
        const SensorPatch* patches[] = {f.patch.get()};
        statement.start(patches, block.scene.fix);
    }
    /// Number of the surface's radii that are those of the targets at the same places.
    std::size_t as_targets(const FrameStatement& frame) const {
        std::size_t same = 0;
        for (std::size_t k = 0; k < with_target.size(); ++k)
            same += frame.surface.radius_95[with_target[k]] == frame.targets[k].radius_95;
        return same;
    }
};

TEST(ErrorStatement, TheSurfaceIsRenewedInTurnsAndStatesWhatTargetsAtItsPlacesDo) {
    const StatedSurface s;
    ASSERT_EQ(s.places.size(), max_places_of_surface);
    ASSERT_GT(s.with_target.size(), 3 * max_places_of_surface / 4);
    ErrorStatement statement = s.statement();
    Followed f(s.block, 1e-3, 0.5 * radians_per_degree, 3);
    s.start(statement, f);
    while (statement.work()) {
    }
    for (int press = 0; press < 2; ++press) {
        for (int k = 0; k < 40; ++k) f.step({0, 0, -0.01 * press});
        for (std::size_t turn = 1; turn <= surface_turns; ++turn) {
            const FrameStatement& frame = s.update(statement, f);
            const std::size_t same = s.as_targets(frame);
            EXPECT_TRUE(same == s.with_target.size() || turn < surface_turns);
            EXPECT_LE(same, turn * max_places_of_surface / surface_turns) << "no frame does more";
        }
    }
    const auto [least, most] = std::ranges::minmax(s.update(statement, f).surface.radius_95);
    EXPECT_GT(least, 1e-4);
    EXPECT_GT(most, 1.2 * least) << "the error is not the same everywhere";
}

TEST(ErrorStatement, TheSurfaceNamesWhatAnyOfItsRadiiLacks) {
    const StatedSurface s;
    ErrorStatement statement = s.statement();
    Followed f(s.block, 1e-3, 0.5 * radians_per_degree, 3);
    for (int k = 0; k < 40; ++k) f.step(Vector3::Zero());
    s.start(statement, f);
    for (std::size_t turn = 0; turn < 2 * surface_turns; ++turn)
        EXPECT_TRUE(s.update(statement, f).surface.missing.has(ErrorSource::elements));
    while (statement.work()) {
    }
    for (std::size_t turn = 1; turn <= surface_turns; ++turn) {
        const FrameStatement& frame = s.update(statement, f);
        EXPECT_TRUE(frame.missing.empty());
        EXPECT_EQ(frame.surface.missing.empty(), turn == surface_turns)
            << "the radii of frames before do not know the responses";
    }
}

TEST(ErrorStatement, AnotherRunStatesTheSameSurfaceToTheBit) {
    const StatedSurface s;
    std::vector<std::vector<double>> first;
    for (int run = 0; run < 2; ++run) {
        ErrorStatement statement = s.statement();
        Followed f(s.block, 1e-3, 0.5 * radians_per_degree, 3);
        s.start(statement, f);
        for (std::size_t k = 0; k < 20; ++k) {
            f.step({0, 0, -1e-3 * static_cast<double>(k)});
            const std::vector<double>& radii = s.update(statement, f).surface.radius_95;
            if (run == 0)
                first.push_back(radii);
            else
                EXPECT_EQ(radii, first[k]) << "frame " << k;
            (void)statement.work();
        }
    }
    EXPECT_NE(first[18], first[19]);
}

TEST(ErrorStatement, WithoutTheSurfaceTargetsAreTheSame) {
    Stated s;
    ErrorStatement without(s.block.scene, s.block.hierarchy, s.block.mesh(),
                           SurfaceErrors::left_out);
    Followed f(s.block, 1e-3, 0.5 * radians_per_degree, 3);
    for (int k = 0; k < 40; ++k) f.step({0, 0, -0.005});
    s.start(*f.patch);
    const SensorPatch* patches[] = {f.patch.get()};
    without.start(patches, s.block.scene.fix);
    while (without.work()) {
    }
    const FrameStatement& whole = s.update(f);
    const FrameStatement& alone = without.update(f.poses(nullptr), patches, s.still, {1e-5});
    EXPECT_TRUE(alone.surface.radius_95.empty());
    EXPECT_FALSE(whole.surface.radius_95.empty());
    ASSERT_EQ(alone.targets.size(), whole.targets.size());
    for (std::size_t i = 0; i < alone.targets.size(); ++i)
        EXPECT_EQ(alone.targets[i].radius_95, whole.targets[i].radius_95) << i;
}

TEST(ErrorStatement, WithoutTargetsNothingIsStatedOfTheSurface) {
    StatedBlock block;
    block.scene.track->targets.clear();
    ErrorStatement statement(block.scene, block.hierarchy, block.mesh());
    statement.start({}, block.scene.fix);
    const std::vector<Vector3> still(block.mesh().nodes.size(), Vector3::Zero());
    EXPECT_TRUE(statement.update({}, {}, still, {}).surface.radius_95.empty());
}

/// The table's border and the stiffness of a suspension, each by its response, are one source.
TEST(ErrorStatement, WhatIsFixedIsASourceOfItsOwn) {
    StatedBlock block;
    block.scene.fix[0].spread_mm = 12;
    Stated exact, uncertain{block};
    Followed f(exact.block, 0, 0, 1);
    exact.start(*f.patch);
    uncertain.start(*f.patch);
    for (int k = 0; k < 60; ++k) f.step({0.004, 0, -0.01 * std::min(1.0, k / 20.0)});
    const auto d = f.patch->motion();
    const FrameStatement without = exact.update(f), with = uncertain.update(f);
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(by(without.targets[i], ErrorSource::fixed), 0);
        const PatchResponse& r = uncertain.responses.at(i, 0);
        ASSERT_EQ(r.fixed.size(), 1u);
        EXPECT_GT((r.fixed[0] * d).norm(), 1e-4);
        EXPECT_NEAR(by(with.targets[i], ErrorSource::fixed), (r.fixed[0] * d).squaredNorm(), 1e-13);
        EXPECT_GT(with.targets[i].radius_95, without.targets[i].radius_95);
    }
}

/// The sensor's place has an error along the surface and one normal to it; the patch is put on the
/// surface whatever the second is.
TEST(ErrorStatement, APatchIsNotElsewhereForAnErrorAlongTheNormal) {
    Stated s;
    Followed f(s.block, 0, 0, 1);
    s.start(*f.patch);
    EXPECT_LT((f.patch->normal() - Vector3::UnitZ()).norm(), 1e-9);
    for (int k = 0; k < 60; ++k) f.step({0, 0, -0.01 * std::min(1.0, k / 20.0)});
    const auto by_patches = [&](const Vector3& spread) {
        ExpectedRegistrationError error{Matrix6d::Zero(), true};
        error.covariance.diagonal().head<3>() = spread.cwiseAbs2();
        return by(s.update(f, &error).targets[0], ErrorSource::patches);
    };
    const double none = by_patches({0, 0, 0});
    EXPECT_NEAR(by_patches({0, 0, 0.003}), none, 1e-3 * none);
    EXPECT_GT(by_patches({0, 0.003, 0}), 1.2 * none);
}

/// A body of ten-node elements is compared with the next coarser level, if there is one.
TEST(ErrorStatement, OfTenNodeElementsLacksTheirErrorOnOneLevelAlone) {
    StatedBlock block;
    block.scene.elements = Elements::p2;
    const TetMesh quadratic = quadratic_mesh(block.mesh());
    const std::vector<Vector3> still(quadratic.nodes.size(), Vector3::Zero());
    const auto lacks_elements = [&](const MeshHierarchy& hierarchy) {
        ErrorStatement statement(block.scene, hierarchy, quadratic);
        statement.start({}, block.scene.fix);
        return statement.update({}, {}, still, {}).missing.has(ErrorSource::elements);
    };
    EXPECT_FALSE(lacks_elements(block.hierarchy));
    testing::internal::CaptureStderr();
    EXPECT_TRUE(lacks_elements(make_hierarchy({block.mesh()}, "a block of one level")));
    const std::string warning = testing::internal::GetCapturedStderr();
    EXPECT_NE(warning.find("lacks elements: those of ten nodes"), std::string::npos) << warning;
}

}  // namespace
}  // namespace livetet
