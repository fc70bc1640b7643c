#include "apps/commands/live_sweep.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/commands/deform_result.hpp"
#include "apps/live/statement_record.hpp"
#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/log.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

/// Points farther from the organ at rest are not on it: the tip is on its way. Deformations are
/// smaller, and the robust misfit copes with what is nearer.
constexpr double reach_m = 0.06;

/// A fit ends after so many iterations or, if that is later, about this time: soon the newest
/// points count. The first answer comes quickly, later ones converge where the mesh allows it.
constexpr int least_iterations = 3;
constexpr double longest_fit_s = 2;

using PointsMotion = RigidTransform<ImageFrame, ImageFrame>;

/// The tracker in the image by the last sample; none if the reference is not seen, or if the
/// registration has a scale.
std::optional<RigidTransform<ImageFrame, Tracker>> image_from_tracker(
    const Recording& recording, const FiducialRegistration& frame, const PointsMotion& motion) {
    const auto& fit = frame.image_from_base;
    if (std::abs(fit.scale - 1) > 1e-9) return {};
    RigidTransform<Base, Tracker> base_from_tracker;
    if (!frame.reference_tool.empty()) {
        const TrackedPose& pose =
            recording.samples.back().poses[tool_index(recording, frame.reference_tool)];
        if (!is_usable(pose)) return {};
        base_from_tracker = tracker_from<Base>(pose).inverse();
    }
    return motion *
           (RigidTransform<ImageFrame, Base>{fit.rotation, fit.translation} * base_from_tracker);
}

}  // namespace

LiveSweep::LiveSweep(const RegisterArguments& arguments, const Scene& scene, SceneBody& body,
                     DeformingRegistration& registration, const FiducialRegistration& frame,
                     std::vector<MeasuredLandmark> landmarks, Output output)
    : arguments_(arguments),
      scene_(scene),
      body_(body),
      registration_(registration),
      frame_(frame),
      landmarks_(std::move(landmarks)),
      output_(std::move(output)),
      allowed_iterations_(least_iterations),
      surface_(body.mesh().nodes, boundary_triangles(body.mesh().tets)) {
    if (deform_options(scene).frame == PointFrame::surface)
        fail(
            "deform.frame: surface with --live: the first points do not tell where the organ is, "
            "expected refined or fixed");
    if (!output_.publish) return;
    const PublishOptions& publish = *output_.publish;
    messages_.emplace(body.mesh(), publish.surface);
    server_ = std::make_unique<OpenIgtLinkServer>(
        OpenIgtLinkServerOptions{publish.address, static_cast<std::uint16_t>(publish.port)});
    log_info(fmt::format("OpenIGTLink server on {} port {}", publish.address, server_->port()));
}

MeasuredOrgan LiveSweep::measured(const Recording& recording) {
    MeasuredOrgan measured{arguments_.surface_points, {}, landmarks_};
    left_out_ = 0;
    for (const Vector3& c : surface_points_of(arguments_, recording)) {
        const Vector3 in_image = frame_.image_from_base * c;
        if (surface_.find(in_image).distance <= reach_m)
            measured.points.push_back(in_image);
        else
            ++left_out_;
    }
    return measured;
}

void LiveSweep::take(const Recording& so_far) {
    const MeasuredOrgan organ = measured(so_far);
    if (organ.points.size() == fitted_points_) return;
    fitted_points_ = organ.points.size();
    DeformedOrgan found;
    try {
        registration_.check(organ);
        found = registration_.fit(organ, allowed_iterations_);
    } catch (const Error& error) {  // more points may mend it; at the end it is an error
        text_ = error.what();
        return;
    }
    ++fits_;
    if (!first_step_s_) first_step_s_ = found.first_step_s;
    const double of_one_s = found.fit_s / std::max(1, found.report.iterations);
    allowed_iterations_ = std::max(
        least_iterations, std::min(deform_options(scene_).max_iterations,
                                   static_cast<int>(longest_fit_s / std::max(of_one_s, 1e-3))));
    registration_.state_errors(found);
    describe(organ, found);
    if (output_.result)
        append_found(*output_.result, scene_, body_, found,
                     so_far.samples.back().time_s - so_far.samples.front().time_s);
    if (server_) publish(so_far, found);
}

void LiveSweep::describe(const MeasuredOrgan& organ, const DeformedOrgan& found) {
    text_ = fmt::format("{}, {:.2f} mm from the surface (median)",
                        counted(organ.points.size(), "point"), 1e3 * found.report.median_m);
    if (left_out_ > 0) text_ += fmt::format(", {} too far away", left_out_);
    const std::string error =
        statement_text(statement_of(found, deform_options(scene_).frame), names_of_targets(found));
    if (!found.report.converged)
        text_ += ", not converged yet";
    else if (!error.empty())
        text_ += ", " + error;
}

void LiveSweep::publish(const Recording& so_far, const DeformedOrgan& found) {
    PublishedFrame shown;
    FrameState& frame = shown.frame;
    frame.time_s = so_far.samples.back().time_s;
    frame.statement = statement_of(found, deform_options(scene_).frame);
    frame.step.converged = found.report.converged;
    frame.step.iterations = found.report.iterations;
    const auto tracker = image_from_tracker(so_far, frame_, found.image_from_points);
    frame.registration = tracker ? RegistrationStatus::valid : RegistrationStatus::lost;
    frame.reference = tracker ? SensorTrouble::none : SensorTrouble::lost;
    const TrackedPose& tool = so_far.samples.back().poses[tool_index(so_far, arguments_.tool)];
    if (tracker) {
        frame.tracker_from_image = tracker->inverse();
        if (is_usable(tool)) {
            const auto tip = tracker_from<Tool>(tool) * tip_of(arguments_, "").tool_from_tip();
            shown.tools.push_back({.tool = arguments_.tool, .has_tip = true});
            const auto in_image = *tracker * tip;
            frame.image_from_tool.push_back(
                {in_image.rotation, in_image.translation, PoseStatus::ok});
        }
    }
    shown.displacement = body_.body->displacement();
    shown.targets = names_of_targets(found);
    shown.sample = so_far.samples.size();
    shown.frames = fits_;
    shown.arrived_s = shown.done_s = steady_seconds();
    server_->publish((*messages_)(shown, utc_seconds()));
}

}  // namespace livetet
