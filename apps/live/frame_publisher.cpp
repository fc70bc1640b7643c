#include "apps/live/frame_publisher.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <nlohmann/json.hpp>

#include "apps/live/statement_record.hpp"
#include "apps/live/tracker_source.hpp"
#include "base/counted.hpp"
#include "base/log.hpp"
#include "geometry/ellipsoid_surface.hpp"
#include "io/openigtlink/conversions.hpp"
#include "mesh/grid_border.hpp"
#include "mesh/grid_surface.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

using nlohmann::json;

constexpr std::array<const char*, 6> drive_names{"placing", "following", "returning",
                                                 "holding", "releasing", "released"};
constexpr std::array<const char*, 3> registration_names{"valid", "held", "lost"};

constexpr std::array<const char*, 11> trouble_names{
    "",           "lost",   "invalid", "out of volume",      "stale",
    "not a pose", "jumped", "too far", "reference not seen", "does not rest",
    "slipped"};

const char* text_of(SensorTrouble trouble) {
    return trouble_names[static_cast<std::size_t>(trouble)];
}

/// " (stale)"; empty if there is no trouble.
std::string because(SensorTrouble trouble) {
    return trouble == SensorTrouble::none ? "" : fmt::format(" ({})", text_of(trouble));
}

const char* text_of(DriveStatus status) { return drive_names[static_cast<std::size_t>(status)]; }
const char* text_of(RegistrationStatus status) {
    return registration_names[static_cast<std::size_t>(status)];
}

/// "registration held (stale)".
std::string registration_text(const FrameState& frame) {
    return fmt::format("registration {}{}", text_of(frame.registration), because(frame.reference));
}

/// State of each sensor, with the reason if it does not follow: "Sensor holding (out of volume)".
std::vector<std::string> sensor_texts(const PublishedFrame& a) {
    std::vector<std::string> texts;
    for (std::size_t i = 0; i < a.sensors.size() && i < a.frame.sensors.size(); ++i) {
        const SensorState& s = a.frame.sensors[i];
        texts.push_back(
            s.off_organ > 0
                ? fmt::format("{} {:.0f} mm off the organ", a.sensors[i], 1e3 * s.off_organ)
                : fmt::format("{} {}{}", a.sensors[i], text_of(s.drive), because(s.trouble)));
    }
    return texts;
}

/// ", 2 pieces, 1 held by nothing"; empty if nothing was cut off.
std::string pieces_of_cut(const CutMesh& cut) {
    std::string text;
    if (cut.pieces > 1) text += fmt::format(", {} pieces", cut.pieces);
    if (cut.free_pieces > 0) text += fmt::format(", {} held by nothing", cut.free_pieces);
    return text;
}

/// "registration valid, Sensor following, not converged": what is followed and what is wrong.
std::string followed_text(const PublishedFrame& a, std::string_view separator) {
    std::string text = registration_text(a.frame);
    const std::vector<std::string> sensors = sensor_texts(a);
    if (!sensors.empty()) text += fmt::format("{}{}", separator, fmt::join(sensors, ", "));
    if (!a.frame.step.converged) text += fmt::format("{}not converged", separator);
    if (a.frame.turned_elements > 0)
        text +=
            fmt::format("{}{} turned over", separator, counted(a.frame.turned_elements, "element"));
    return text;
}

// STATUS codes of OpenIGTLink.
constexpr std::uint16_t all_well = 1, not_followed = 7, not_ready = 13;

std::uint16_t status_code(const FrameState& frame) {
    const auto is_well = [](const SensorState& s) {
        return s.trouble == SensorTrouble::none && s.off_organ == 0;
    };
    if (frame.registration != RegistrationStatus::valid || !frame.step.converged ||
        !std::ranges::all_of(frame.sensors, is_well))
        return not_followed;
    const bool placing = std::ranges::any_of(
        frame.sensors, [](const SensorState& s) { return s.drive == DriveStatus::placing; });
    return placing ? not_ready : all_well;
}

/// The 95 % ellipsoids of all targets as one surface, with how many sources of error they lack.
igtl::Message region_message(const FrameStatement& statement, double time_s) {
    TriangleMesh all;
    std::vector<float> radius_mm;
    for (const TargetStatement& t : statement.targets) {
        const TriangleMesh region = ellipsoid_surface(t.position, error_ellipsoid(t.covariance));
        const auto first = static_cast<std::int32_t>(all.nodes.size());
        all.nodes.insert(all.nodes.end(), region.nodes.begin(), region.nodes.end());
        for (const auto& [a, b, c] : region.triangles)
            all.triangles.push_back({first + a, first + b, first + c});
        radius_mm.resize(all.nodes.size(), static_cast<float>(1e3 * t.radius_95));
    }
    const std::vector<float> missing(radius_mm.size(),
                                     static_cast<float>(std::popcount(statement.missing.bits())));
    const igtl::PointScalars scalars[] = {{"radius_95_mm", radius_mm},
                                          {"missing_sources", missing}};
    return igtl::surface_message("TargetRegion", all.nodes, all.triangles, scalars, time_s);
}

}  // namespace

FrameMessages::FrameMessages(const TetMesh& mesh, std::string surface)
    : surface_(std::move(surface)) {
    take_mesh(mesh);
}

void FrameMessages::take_mesh(const TetMesh& mesh) {
    triangles_ = body_surface(mesh);
    nodes_ = nodes_of(triangles_);
    const std::vector<Vector3> places = drawn_places(mesh, triangles_);
    for (Triangle& t : triangles_)
        for (std::int32_t& n : t)
            n = static_cast<std::int32_t>(std::lower_bound(nodes_.begin(), nodes_.end(), n) -
                                          nodes_.begin());
    rest_.clear();
    for (const std::int32_t n : nodes_) rest_.push_back(places[n]);
}

std::vector<igtl::Message> FrameMessages::operator()(const PublishedFrame& a, double time_s) {
    if (a.frame.cut && a.frame.cut != cut_) {
        cut_ = a.frame.cut;
        take_mesh(cut_->mesh);
    }
    const FrameState& frame = a.frame;
    std::vector<Vector3> points = rest_;
    std::vector<float> moved_mm;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
        const Vector3& u = a.displacement[nodes_[i]];
        points[i] += u;
        moved_mm.push_back(static_cast<float>(1e3 * u.norm()));
    }
    const igtl::PointScalars scalars[] = {{"displacement_mm", moved_mm}};
    std::vector<igtl::Message> messages;
    messages.push_back(igtl::surface_message(surface_, points, triangles_, scalars, time_s));
    if (!frame.statement.targets.empty())
        messages.push_back(region_message(frame.statement, time_s));
    if (frame.registration != RegistrationStatus::lost)
        messages.push_back(
            igtl::transform_message("TrackerToRAS", frame.tracker_from_image.inverse(), time_s));
    for (std::size_t i = 0; i < a.tools.size(); ++i) {
        const TrackedPose& pose = frame.image_from_tool[i];
        if (!is_usable(pose)) continue;
        messages.push_back(igtl::transform_message(
            fmt::format("{}{}ToRAS", a.tools[i].tool, a.tools[i].has_tip ? "Tip" : ""),
            RigidTransform<ImageFrame, Tool>{pose.rotation, pose.translation}, time_s));
    }
    messages.push_back(
        igtl::status_message("Livetet", status_code(frame), followed_text(a, "; "), time_s));
    json sensors = json::object();
    for (std::size_t i = 0; i < a.sensors.size() && i < frame.sensors.size(); ++i)
        sensors[a.sensors[i]] = {{"status", text_of(frame.sensors[i].drive)},
                                 {"reason", text_of(frame.sensors[i].trouble)},
                                 {"press_mm", 1e3 * frame.sensors[i].press}};
    json about = {{"sample", a.sample},
                  {"sample_time_s", frame.time_s},
                  {"frame", a.frames},
                  {"missed", a.missed},
                  {"latency_ms", 1e3 * (a.done_s - a.arrived_s)},
                  {"ahead_ms", 1e3 * frame.ahead_s},
                  {"registration", text_of(frame.registration)},
                  {"reference", text_of(frame.reference)},
                  {"sensors", sensors},
                  {"poses", json_of(pose_qualities(a.tools, frame))},
                  {"iterations", frame.step.iterations},
                  {"turned_elements", frame.turned_elements},
                  {"error_estimate_mm", 1e3 * frame.step.linear_error}};
    if (const CutMesh none; frame.cut || frame.cut_waits || frame.blade_gaps.count > 0) {
        const CutMesh& cut = frame.cut ? *frame.cut : none;
        about["cuts"] = {
            {"openings", cut.openings},       {"parted", cut.parted},
            {"pieces", cut.pieces},           {"free_pieces", cut.free_pieces},
            {"gaps", frame.blade_gaps.count}, {"gaps_mm", 1e3 * frame.blade_gaps.length},
            {"waits", frame.cut_waits}};
    }
    if (!frame.statement.targets.empty()) about["statement"] = json_of(frame.statement, a.targets);
    messages.push_back(igtl::string_message(
        "LivetetFrame", about.dump(-1, ' ', false, json::error_handler_t::replace), time_s));
    return messages;
}

std::string status_text(const PublishedFrame& a, const SourceStatus& source, double received_Hz,
                        double frames_Hz) {
    std::string text;
    std::vector<std::string> awaited = source.never_came;
    std::erase_if(awaited, [&](const std::string& tool) {  // a sensor or tool that was removed
        return std::ranges::find(a.tools, tool, &TrackedBody::ShownTool::tool) == a.tools.end();
    });
    if (const std::string names = names_text(source); !awaited.empty() && !names.empty())
        text += fmt::format("no {} yet; what comes: {} | ", fmt::join(awaited, ", "), names);
    if (source.state != "receiving" && source.state != "playing") text += source.state;
    if (!source.problem.empty() && source.state != "receiving")
        text += fmt::format(" ({})", source.problem);
    if (!text.empty() && !text.ends_with("| ")) text += " | ";
    text +=
        fmt::format("{:.1f} Hz in, {:.1f} frames/s, {} missed", received_Hz, frames_Hz, a.missed);
    if (source.refused > 0)
        text += fmt::format(", {} messages refused ({})", source.refused, source.refusal);
    text += fmt::format(" | latency {:.1f} ms", 1e3 * (a.done_s - a.arrived_s));
    if (a.frame.ahead_s > 0) text += fmt::format(", poses {:.1f} ms ahead", 1e3 * a.frame.ahead_s);
    std::vector<std::string> ages;
    for (const TrackedBody::ShownTool& tool : a.tools) {
        const bool came = tool.pose < a.times.size() && a.times[tool.pose].arrived_s > 0;
        ages.push_back(came ? fmt::format("{} {:.0f} ms", tool.tool,
                                          1e3 * (a.done_s - a.times[tool.pose].arrived_s))
                            : tool.tool + " never");
    }
    text += fmt::format(" | age {}", fmt::join(ages, ", "));
    const PoseQualities poses = pose_qualities(a.tools, a.frame);
    if (const std::string lags = lags_text(poses); !lags.empty()) text += " | lag " + lags;
    if (const std::string noise = noise_text(poses); !noise.empty()) text += " | " + noise;
    if (const std::string error = statement_text(a.frame.statement, a.targets); !error.empty())
        text += " | " + error;
    text +=
        fmt::format(" | {} + {} iterations, solver error {:.3f} mm", a.frame.step.newton_iterations,
                    a.frame.step.iterations, 1e3 * a.frame.step.linear_error);
    if (const CutMesh* cut = a.frame.cut.get())
        text += fmt::format(" | cut {}{}", counted(cut->openings, "time"), pieces_of_cut(*cut));
    if (a.frame.cut_waits) text += " | a cut waits to open";
    if (const BladeGaps& gaps = a.frame.blade_gaps; gaps.count > 0)
        text += fmt::format(" | NOT cut in {}", counted(gaps.count, "gap"));
    text += " | " + followed_text(a, ", ");
    if (!a.frame.sensors.empty() || a.frame.pull)
        text += fmt::format(", press {:.1f} mm", 1e3 * a.frame.press);
    return text;
}

FramePublisher::FramePublisher(const TetMesh& mesh, const TrackerSource& source,
                               std::size_t samples, const std::optional<PublishOptions>& publish,
                               StatusCallback show)
    : source_(source), samples_(samples), show_(std::move(show)) {
    if (publish) {
        messages_.emplace(mesh, publish->surface);
        server_ = std::make_unique<OpenIgtLinkServer>(
            OpenIgtLinkServerOptions{publish->address, static_cast<std::uint16_t>(publish->port)});
        period_s_ = publish->rate_Hz > 0 ? 1 / publish->rate_Hz : 0;
        log_info(
            fmt::format("OpenIGTLink server on {} port {}", publish->address, server_->port()));
    }
    thread_ = std::thread([this] { run(); });
}

FramePublisher::~FramePublisher() {
    mailbox_.outgoing().last = true;
    mailbox_.post();
    thread_.join();
}

void FramePublisher::publish(const Frame& frame, const TrackedBody& tracked, const Scene& scene,
                             const StreamSample& sample, std::size_t frames, std::size_t missed) {
    PublishedFrame& a = mailbox_.outgoing();
    a.frame = frame;
    if (server_) a.displacement = frame.displacement;
    a.tools = tracked.tools();
    a.sensors.resize(scene.track->sensors.size());
    for (std::size_t i = 0; i < a.sensors.size(); ++i) a.sensors[i] = scene.track->sensors[i].tool;
    a.targets = tracked.target_names();
    a.times = sample.times;
    a.sample = sample.number;
    a.frames = frames;
    a.missed = missed;
    a.arrived_s = sample.arrived_s;
    a.done_s = steady_seconds();
    mailbox_.post();
}

void FramePublisher::run() {
    double due_s = 0;
    Rate received, computed;
    for (;;) {
        const auto seen =
            mailbox_.posted();  // read before `take`: a frame posted after this ends the wait
        if (!mailbox_.take()) {
            mailbox_.wait_beyond(seen);
            continue;
        }
        const PublishedFrame& a = mailbox_.incoming();
        if (a.last) return;
        const double now = steady_seconds();
        if (server_ && now >= due_s) {
            due_s = std::max(due_s + period_s_, now);
            server_->publish((*messages_)(a, utc_seconds()));
        }
        if (!show_) continue;
        const SourceStatus source = source_.status();
        const std::string text =
            status_text(a, source, received(source.samples), computed(a.frames));
        if (samples_ > 0)
            show_(static_cast<double>(a.sample) / static_cast<double>(samples_), text);
        else
            show_(std::nullopt, text);
    }
}

}  // namespace livetet
