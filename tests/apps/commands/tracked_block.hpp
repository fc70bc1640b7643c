#pragma once

#include <gtest/gtest.h>

#include <algorithm>

#include "io/hierarchy_file.hpp"
#include "io/registration_file.hpp"
#include "io/result_file.hpp"
#include "io/sequence_file.hpp"
#include "mesh/hierarchy.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet::test {

/// A block on a moving table, registered exactly, a sensor on the middle of its top.
struct Tracked {
    Folder folder;
    SimulatedTrackerOptions tracker;
    Tracked() {
        tracker.rate_Hz = 15;
        tracker.presses = 1;
        tracker.image_from_reference.translation = {0.02, 0.1, 0.05};
        tracker.image_from_sensor_at_rest.translation = {0.1, 0.05, 0.1};
        tracker.press_direction = {0, 0, -1};
        write_hierarchy(folder / "block.h5",
                        make_hierarchy({test::block({12, 6, 6}, {0.2, 0.1, 0.1}),
                                        test::block({7, 4, 4}, {0.2, 0.1, 0.1}),
                                        test::block({4, 2, 2}, {0.2, 0.1, 0.1})},
                                       "a block"));
        FiducialRegistration registration;
        registration.reference_tool = "Reference";
        const auto reference_from_image = tracker.image_from_reference.inverse();
        for (const Vector3& x :
             {Vector3(0, 0, 0), Vector3(0.2, 0, 0), Vector3(0, 0.1, 0), Vector3(0, 0, 0.1)})
            registration.fiducials.push_back({"F", x, x, reference_from_image * x, 0, 0});
        const auto& image_from_reference = tracker.image_from_reference;
        registration.image_from_base = {1, image_from_reference.rotation,
                                        image_from_reference.translation};
        registration.expected_error.emplace().holds_tip = true;
        registration.expected_error->covariance.diagonal() << 1e-8, 1e-8, 1e-8, 1e-6, 1e-6, 1e-6;
        write_registration(folder / "registration.json", registration);
        write_scene();
    }
    /// More keys of `track`.
    void set_track(const std::string& keys) {
        track_ = keys;
        write_scene();
    }
    void set_source(const std::string& source) {
        source_ = source;
        write_scene();
    }
    ResultReader run(const std::string& options = "--every-sample") {
        write_sequence(folder / "press.igs.mha", recording);
        return run_as_it_is(options);
    }
    /// With the files as the test left them.
    ResultReader run_as_it_is(const std::string& options = "--every-sample") {
        const auto outcome = livetet(folder, "track scene.yaml " + options);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return ResultReader(folder / "result.h5");
    }
    void record() { recording = simulate_press(tracker); }
    Recording recording;

  private:
    /// What is expected of sudden motions is of a filter without extrapolation, which overshoots,
    /// unless `track_` names a filter or the noise that the pose estimator begins with.
    void write_scene() {
        const bool has_own = track_.find("smoothing_Hz") != std::string::npos ||
                             track_.find("position_noise_mm") != std::string::npos;
        const std::string filter = has_own ? "" : ", smoothing_Hz: 1, ahead_ms: 0";
        write_text(folder / "scene.yaml",
                   "mesh: {file: block.h5}\nfix: [{half_space_mm: [0, 0, 1, 0, 0, 1]}]\n"
                   "time: {scheme: newmark, rayleigh_alpha: 10, rayleigh_beta: 0.01}\n"
                   "track: {source: \"" +
                       source_ + "\", registration: registration.json" + filter +
                       (track_.empty() ? "" : ", " + track_) + "}\n");
    }
    std::string source_ = "press.igs.mha", track_;
};

inline double largest(const std::vector<Vector3>& u) {
    double most = 0;
    for (const Vector3& v : u) most = std::max(most, v.norm());
    return most;
}

}  // namespace livetet::test
