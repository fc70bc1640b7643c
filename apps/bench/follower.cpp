#include "apps/bench/follower.hpp"

#include "apps/bench/realtime_cases.hpp"
#include "apps/scene/body_factory.hpp"
#include "base/stopwatch.hpp"
#include "tracking/poses.hpp"

namespace livetet {

std::vector<TrackerSample> record_press(const SimulatedTrackerOptions& tracker, double rate,
                                        int frames, const std::function<double(double)>& depth,
                                        double rest_s) {
    TrackerNoise noise(tracker);
    std::vector<TrackerSample> samples;
    const int rest = static_cast<int>(std::ceil(rest_s * rate));
    for (int k = 0; k < rest + frames; ++k) {
        const double t = k / rate, pressed = k < rest ? 0 : depth((k - rest) / rate);
        const auto tracker_from_image = true_tracker_from_image(tracker, t);
        auto image_from_sensor = tracker.image_from_sensor_at_rest;
        image_from_sensor.translation += pressed * tracker.press_direction.normalized();
        const auto reference = tracker_from_image * tracker.image_from_reference;
        const auto sensor = tracker_from_image * image_from_sensor;
        samples.push_back({t,
                           {noise({reference.rotation, reference.translation, PoseStatus::ok}),
                            noise({sensor.rotation, sensor.translation, PoseStatus::ok})}});
    }
    return samples;
}

Follower::Follower(const Scene& scene, const MeshHierarchy& hierarchy,
                   const SimulatedTrackerOptions& tracker)
    : scene_(scene),
      body_(make_body(PETSC_COMM_SELF, scene_, MeshHierarchy(hierarchy), Use::track)),
      model_(scene_, body_, tool_finder({"Reference", "Sensor"}), tracker.image_from_reference) {}

Measured Follower::frame(const TrackerSample& sample, FrameLimits limits,
                         std::optional<double> budget_s) {
    Measured m;
    watch_.start();
    const auto start = Clock::now();
    if (budget_s) limits.deadline = Deadline::after(start, *budget_s);
    const Frame& frame = model_.advance(sample, limits);
    m.seconds = seconds_since(start);
    m.cores = watch_.stop();
    m.step = frame.step;
    m.sensor_s = frame.sensor_s;
    m.output_s = frame.output_s;
    return m;
}

Measured Follower::judged_frame(const TrackerSample& sample, const FrameLimits& limits, double dt) {
    if (!reference_) {  // same kernels, which agree with the plain path (LiveSolver tests)
        SolverOptions converged = scene_.solver;
        converged.kind = SolverKind::live;
        reference_ =
            std::make_unique<DeformableBody>(DistributedHierarchy{PETSC_COMM_SELF, body_.hierarchy},
                                             elastic_model(scene_), scene_.time, converged);
    }
    const bool is_static = !scene_.time.is_dynamic();
    if (!is_static) reference_->copy_state(*body_.body);
    Measured m = frame(sample, limits);
    if (is_static)
        reference_->copy_state(*body_.body);  // an equilibrium has no history: start close to it
    reference_->set_constraints(model_.constraints());
    reference_->move_constraints(model_.driven(), model_.driven_to());
    m.reference_converged =
        reference_->solve(dt, {.max_newton = 60, .tolerance = 1e-6, .linear_tolerance = 1e-2})
            .converged;
    const Gap gap = gap_between(body_.body->displacement(), reference_->displacement());
    m.error = gap.rms;
    m.node_error = gap.node;
    m.largest = gap.largest;
    return m;
}

}  // namespace livetet
