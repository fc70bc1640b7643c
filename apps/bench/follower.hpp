#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "apps/bench/realtime_result.hpp"
#include "apps/live/tracked_body.hpp"
#include "apps/phantom/phantom.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {

/// The press of `bench realtime` at time t, m: 15 mm, once a second.
inline double press_depth(double t) { return 0.0075 * (1 - std::cos(2 * std::numbers::pi * t)); }

inline SimulatedTrackerOptions bench_tracker() { return phantom_tracker(PhantomOptions{}); }

/// The organ moves and is pressed by `depth(t)` metres, with t from the end of `rest_s`, during
/// which the sensor's position at rest is measured.
std::vector<TrackerSample> record_press(const SimulatedTrackerOptions& tracker, double rate,
                                        int frames, const std::function<double(double)>& depth,
                                        double rest_s = 0.6);

/// A body on a phantom's mesh that follows samples, and a second one that solves the same steps to
/// convergence.
class Follower {
  public:
    Follower(const Scene& scene, const MeshHierarchy& hierarchy,
             const SimulatedTrackerOptions& tracker);

    Measured frame(const TrackerSample& sample, FrameLimits limits,
                   std::optional<double> budget_s = {});
    /// A frame compared with the converged solve of the same step.
    Measured judged_frame(const TrackerSample& sample, const FrameLimits& limits, double dt);

    /// Converged displacement of the last judged frame.
    std::vector<Vector3> converged() const { return reference_->displacement(); }

    DeformableBody& body() { return *body_.body; }
    const TetMesh& mesh() const { return body_.mesh(); }

  private:
    Scene scene_;
    SceneBody body_;
    TrackedBody model_;
    CoreWatch watch_;
    std::unique_ptr<DeformableBody> reference_;
};

}  // namespace livetet
