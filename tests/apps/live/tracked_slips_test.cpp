#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <vector>

#include "apps/live/tracked_model.hpp"
#include "mesh/barycentric_map.hpp"
#include "mesh/hierarchy.hpp"
#include "support/shapes.hpp"
#include "tracking/poses.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

constexpr double frame_s = 1.0 / 15, begins_s = 4, moving_s = 0.5;

/// From 0 to 1, within half a second from 4 s on.
double moved_share(double time_s) { return std::clamp((time_s - begins_s) / moving_s, 0.0, 1.0); }

const Vector3 first_place(0.06, 0.05, 0.1), second_place(0.12, 0.05, 0.1);

/// A block on a table with sensors on its top; the reference rests at the origin of the image.
struct TrackedTop {
    MeshHierarchy hierarchy = make_hierarchy(
        {test::block({12, 6, 6}, {0.2, 0.1, 0.1}), test::block({7, 4, 4}, {0.2, 0.1, 0.1}),
         test::block({4, 2, 2}, {0.2, 0.1, 0.1})},
        "a block");
    Scene scene;
    std::vector<std::string> tools{"Reference"};
    std::vector<Vector3> places;
    double noise = 0;  ///< RMS of each tool's position, m
    unsigned seed = 1;

    explicit TrackedTop(std::vector<Vector3> sensors) : places(std::move(sensors)) {
        scene.fix.emplace_back().half_space_mm = {0, 0, 1, 0, 0, 1};
        scene.time = {.scheme = TimeScheme::newmark, .rayleigh_alpha = 10, .rayleigh_beta = 0.01};
        scene.solver.threads = 1;
        scene.track.emplace();
        scene.track->sensors.resize(places.size());
        for (std::size_t i = 0; i < places.size(); ++i) {
            tools.push_back(fmt::format("Sensor{}", i));
            scene.track->sensors[i].tool = tools.back();
        }
    }

    /// When each sensor was first taken for slipping, s; follows them for 8 s. `way`:
    /// displacement of a sensor from its place at a time, m.
    using Way = std::function<Vector3(std::size_t sensor, double time_s)>;
    std::vector<std::optional<double>> slips_of(const Way& way) {
        TrackedModel model = make_tracked_model(scene, hierarchy);
        TrackedBody tracked =
            track_model(scene, model, tool_finder(tools), {}, {}, MisplacedSensor::refuse);
        std::vector<TrackerNoise> noises;
        for (std::size_t i = 0; i <= places.size(); ++i)
            noises.emplace_back(noise, 0, seed * 100 + i);
        std::vector<std::optional<double>> slips(places.size());
        last_.clear();
        for (double time_s = 0; time_s < 8; time_s += frame_s) {
            TrackerSample sample{time_s, {noises[0](seen_at(Vector3::Zero()))}};
            for (std::size_t i = 0; i < places.size(); ++i)
                sample.poses.push_back(noises[i + 1](seen_at(places[i] + way(i, time_s))));
            const Frame& frame = tracked.advance(sample);
            for (std::size_t i = 0; i < places.size(); ++i)
                if (frame.sensors[i].trouble == SensorTrouble::slipped && !slips[i])
                    slips[i] = time_s;
            last_.push_back(frame.displacement);
            tracked.work_on_responses();
        }
        return slips;
    }
    /// Displacement of a place of the block in each frame of the last run, m.
    std::vector<Vector3> moved(const Vector3& place) const {
        const Vector3 places_of_one[] = {place};
        const auto map = map_into(hierarchy.levels.front(), places_of_one);
        std::vector<Vector3> ways;
        for (const auto& u : last_) ways.push_back(interpolate(map, 0, u));
        return ways;
    }

  private:
    static TrackedPose seen_at(const Vector3& place) {
        return {Eigen::Matrix3d::Identity(), place, PoseStatus::ok};
    }
    std::vector<std::vector<Vector3>> last_;
};

Vector3 slid(double time_s) { return {0, 0.01 * moved_share(time_s), 0}; }

TEST(TrackedSlips, ASlipOf10MmIsDetectedWithinASecondWithASensorAloneAndBesideAnother) {
    for (const std::size_t sensors : {1, 2})
        for (const unsigned seed : {1, 2, 3}) {
            TrackedTop top({first_place, second_place});
            top.places.resize(sensors);
            top.scene.track->sensors.resize(sensors);
            top.scene.track->position_noise_mm = 1.4;
            top.noise = 1.4e-3;
            top.seed = seed;
            const auto slips = top.slips_of([](std::size_t sensor, double time_s) {
                return sensor == 0 ? slid(time_s) : Vector3::Zero();
            });
            ASSERT_TRUE(slips[0]) << sensors << " sensors, seed " << seed;
            EXPECT_GT(*slips[0], begins_s) << "noise is none";
            EXPECT_LT(*slips[0], begins_s + 1) << sensors << " sensors, seed " << seed;
            if (sensors == 2) {
                EXPECT_FALSE(slips[1]) << "it rests on the tissue, seed " << seed;
            }
        }
}

/// One is pushed aside with the organ, and counts as fixed to it. The other rides along, as the
/// block goes where no sensor holds it.
TEST(TrackedSlips, ASensorThatRidesAlongBesideAPushIsFollowed) {
    const auto push = [](double time_s) {
        return Vector3(moved_share(time_s) * Vector3(0, 0.02, -0.015));
    };
    TrackedTop alone({first_place});
    alone.scene.track->sensors[0].may_slip = false;
    EXPECT_FALSE(alone.slips_of([&](std::size_t, double t) { return push(t); })[0]);
    const std::vector<Vector3> rides = alone.moved(second_place);
    double along = 0;
    for (const Vector3& u : rides) along = std::max(along, u.head<2>().norm());
    EXPECT_GT(along, 0.006) << "else riding along is no slip anyway";

    for (const double noise : {0.0, 1.4e-3}) {
        TrackedTop both({first_place, second_place});
        both.scene.track->sensors[0].may_slip = false;
        both.scene.track->position_noise_mm = 1.4;
        both.noise = noise;
        const auto slips = both.slips_of([&](std::size_t sensor, double t) {
            return sensor == 0 ? push(t)
                               : rides[static_cast<std::size_t>(std::lround(t / frame_s))];
        });
        EXPECT_FALSE(slips[1]) << 1e3 * noise << " mm of noise";
    }
}

/// One voxel of 1 m is the block's lower part. Its file is gone once the run has begun.
TEST(TrackedSlips, ResponsesReadNoMaskWhileTheModelIsTracked) {
    const std::filesystem::path mask = "responses-read-no-mask.nrrd";
    std::ofstream(mask) << "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 1 1 1\nspace: "
                           "right-anterior-superior\nspace directions: (1000,0,0) (0,1000,0) "
                           "(0,0,1000)\nspace origin: (0,0,-490)\nencoding: text\n\n1\n";
    TrackedTop top({first_place, second_place});
    top.scene.fix.assign(1, {});
    top.scene.fix[0].mask = mask;
    TrackedModel model = make_tracked_model(top.scene, top.hierarchy);
    TrackedBody tracked =
        track_model(top.scene, model, tool_finder(top.tools), {}, {}, MisplacedSensor::refuse);
    std::filesystem::remove(mask);
    testing::internal::CaptureStderr();
    int solves = 0;
    for (double time_s = 0; time_s < 4; time_s += frame_s) {
        tracked.advance({time_s,
                         {{Eigen::Matrix3d::Identity(), Vector3::Zero(), PoseStatus::ok},
                          {Eigen::Matrix3d::Identity(), first_place, PoseStatus::ok},
                          {Eigen::Matrix3d::Identity(), second_place, PoseStatus::ok}}});
        solves += tracked.work_on_responses();
    }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_EQ(solves, 6) << "the second body, and all but the last of three for each sensor";
}

/// Raw poses, and those of the one-euro filter, state no error: their noise is the tracker's.
TEST(TrackedSlips, ASlipIsDetectedWithoutThePoseEstimator) {
    for (const double smoothing_Hz : {0.0, 1.0}) {
        TrackedTop top({first_place});
        top.scene.track->smoothing_Hz = smoothing_Hz;
        top.scene.track->position_noise_mm = 1.4;
        top.noise = 1.4e-3;
        for (const double depth : {0.0, 0.02}) {
            const auto slips = top.slips_of([&](std::size_t, double time_s) {
                return depth > 0 ? Vector3(0, 0, -depth * moved_share(time_s)) : slid(time_s);
            });
            EXPECT_EQ(slips[0].has_value(), depth == 0) << smoothing_Hz << " Hz";
            if (slips[0]) {
                EXPECT_GT(*slips[0], begins_s);
                EXPECT_LT(*slips[0], begins_s + 1.5);
            }
        }
    }
}

}  // namespace
}  // namespace livetet
