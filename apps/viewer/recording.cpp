#include "apps/viewer/recording.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/live/recorder.hpp"
#include "apps/scene/body_factory.hpp"
#include "apps/scene/scene_image.hpp"
#include "base/counted.hpp"
#include "base/error.hpp"
#include "config/yaml.hpp"
#include "geometry/matrix_rows.hpp"
#include "io/registration_file.hpp"
#include "io/tip_file.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

using nlohmann::json;

bool has(const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

/// The tools of a run. The result of a killed run lacks the registration, which the scene then
/// names.
struct TrackerOfRun {
    std::vector<std::string> tools;
    RigidTransform<ImageFrame, Reference> image_from_reference;

    TrackerOfRun(const ResultReader& reader, const Scene& scene, const std::string& source) {
        const bool whole = reader.has_text("replay");
        if (!whole && !reader.has_text("tools"))
            fail("the result does not say which tool is which");
        try {
            if (!whole) {
                json::parse(reader.text("tools")).get_to(tools);
                const auto& image_from_base =
                    read_registration(locate(scene.track->registration, source)).image_from_base;
                image_from_reference = {image_from_base.rotation, image_from_base.translation};
                return;
            }
            const json about = json::parse(reader.text("replay"));
            about.at("tools").get_to(tools);
            const auto pose = about.at("image_from_reference").get<std::vector<double>>();
            if (pose.size() != 12)
                fail("{}: image_from_reference has {} numbers, expected 12", source, pose.size());
            image_from_reference =
                transform_of_rows<ImageFrame, Reference>(std::span(pose).first<12>());
        } catch (const json::exception& e) {
            fail("{}: invalid replay data, expected those of livetet track: {}", source, e.what());
        }
    }
    /// Of a tool in the samples; their number if it is not among them.
    std::size_t index_of(const std::string& tool) const {
        return static_cast<std::size_t>(std::find(tools.begin(), tools.end(), tool) -
                                        tools.begin());
    }
    TrackedPose pose(const TrackerSample& sample, const std::string& tool) const {
        const std::size_t at = index_of(tool);
        return at < sample.poses.size() ? sample.poses[at] : TrackedPose{};
    }
};

RigidTransform<Tool, Tip> tip_of(const ToolOptions& tool, const std::string& source) {
    return tool.tip.empty() ? RigidTransform<Tool, Tip>{}
                            : read_tip(locate(tool.tip, source), tool.tool).tool_from_tip();
}

}  // namespace

ViewRecording::ViewRecording(const std::filesystem::path& path, const ViewFiles& files)
    : reader_(path), statements_(reader_, path.string()) {
    const std::string source = path.string();
    if (reader_.frame_count() == 0)
        fail("{}: holds no frame, expected the result of livetet track or solve", source);
    std::optional<Scene> scene;
    if (!reader_.scene_text().empty()) scene = read_yaml<Scene>(reader_.scene_text(), source);
    body_ = make_shown_body(reader_.mesh(), scene, path, files);
    body_.stated_places = statements_.surface_places();
    has_stress_ = has(reader_.field_names(), "von_mises");
    has_press_ = has(reader_.value_names(), "press_mm");
    const bool tracked = has(reader_.value_names(), "tracker_from_image");
    if (tracked && !reader_.has_text("run"))
        body_.left_out.push_back(
            fmt::format("the end: the run was killed; it kept {}, until a few seconds before",
                        counted(reader_.frame_count(), "frame")));
    try {
        if (scene && scene->track && tracked) trace_tools(source, *scene);
        if (scene && !tracked) find_driven(source, *scene);
    } catch (const Error& error) {
        body_.left_out.push_back(fmt::format("tools and sensors: {}", error.what()));
    }
    find_ranges();
}

void ViewRecording::find_driven(const std::string& source, const Scene& scene) {
    for (std::size_t i = 0; i < scene.drive.size(); ++i) {
        const std::string key = fmt::format("drive[{}]", i);
        sensors_.push_back({key, {}, {}, select_located(body_.mesh, scene.drive[i], key, source)});
    }
}

/// Repeats the run without its solves, as far as its kept frames tell: where sensors were placed,
/// and the poses of all tools in the image.
void ViewRecording::trace_tools(const std::string& source, const Scene& scene) {
    const TrackerOfRun tracker(reader_, scene, source);
    const RecordedRun run = read_recorded_run(reader_, source);
    const std::vector<std::int32_t> skin = nodes_of(boundary_triangles(body_.mesh.tets));
    std::vector<RigidTransform<Tool, Tip>> tips;
    for (const ToolOptions& tool : scene.track->tools) tips.push_back(tip_of(tool, source));
    std::vector<SensorPatch> patches;
    std::vector<ShownSensor> sensors;
    for (const SensorOptions& sensor : scene.track->sensors) {
        patches.emplace_back(sensor_patch_options(scene, sensor));
        sensors.push_back({sensor.tool, {}, {}, {}});
    }
    PoseFollower follower(pose_follower_options(*scene.track));
    std::vector<Traced> traced(reader_.frame_count());
    for (std::size_t k = 0; k < traced.size(); ++k) {
        const auto found = std::lower_bound(
            run.samples.begin(), run.samples.end(), run.frames[k].sample,
            [](const StreamSample& s, std::uint64_t number) { return s.number < number; });
        if (found == run.samples.end() || found->number != run.frames[k].sample) continue;
        const TrackerSample& sample = found->sample;
        const auto rows = reader_.values("tracker_from_image", k, 12);
        const auto tracker_from_image =
            transform_of_rows<Tracker, ImageFrame>(std::span(rows).first<12>());
        const TrackedPose reference =
            follower.update(sample.time_s, tracker.pose(sample, scene.track->reference_tool))
                .unfiltered;
        std::optional<RigidTransform<Tracker, Reference>> tracker_from_reference;
        if (is_usable(reference)) tracker_from_reference = tracker_from<Reference>(reference);
        const auto in_image =
            [&](const std::string& tool) -> std::optional<RigidTransform<ImageFrame, Tool>> {
            const TrackedPose pose = tracker.pose(sample, tool);
            if (!is_usable(pose) || !tracker_from_image.rotation.allFinite()) return {};
            return tracker_from_image.inverse() * tracker_from<Tool>(pose);
        };
        Traced& now = traced[k];
        now.pull = run.frames[k].pull;
        if (const auto pose = in_image(scene.track->reference_tool))
            now.tools.push_back({scene.track->reference_tool, false, *pose});
        for (std::size_t i = 0; i < tips.size(); ++i)
            if (const auto pose = in_image(scene.track->tools[i].tool)) {
                const auto tip = *pose * tips[i];
                now.tools.push_back({scene.track->tools[i].tool,
                                     !scene.track->tools[i].tip.empty(),
                                     {tip.rotation, tip.translation}});
            }
        const std::uint64_t slipped = read_slipped(reader_, k, source);
        for (std::size_t i = 0; i < patches.size(); ++i) {
            patches[i].follow(sample.time_s, tracker.pose(sample, sensors[i].name),
                              tracker_from_reference, tracker.image_from_reference,
                              run.frames[k].ahead_s);
            if (is_slipped(slipped, tracker.index_of(sensors[i].name))) patches[i].let_go();
            if (patches[i].awaits_placement()) {
                (void)patches[i].place(body_.mesh, skin, reader_.displacement(k),
                                       farthest_from_organ);
                sensors[i].patch = patches[i].nodes();
            }
            // In the frame of the organ, free of the lag of the registration.
            const auto& base = patches[i].drive().base();
            now.bases.push_back(base ? std::optional(base->translation) : std::nullopt);
            const auto pose = in_image(sensors[i].name);
            if (base && patches[i].trouble() == SensorTrouble::none)
                now.now.push_back(base->translation +
                                  patches[i].drive().displacement(base->translation));
            else
                now.now.push_back(pose ? std::optional(pose->translation) : std::nullopt);
        }
    }
    traced_ = std::move(traced);
    sensors_ = std::move(sensors);
}

void ViewRecording::find_ranges() {
    if (has_stress_) {
        node_volume_.assign(body_.mesh.nodes.size(), 0);
        for (const Tet& t : body_.mesh.tets)
            for (const std::int32_t n : t) node_volume_[n] += signed_volume(body_.mesh, t) / 4;
    }
    for (const Vector3& x : body_.mesh.nodes) extent_.extend(x);
    const std::size_t frames = reader_.frame_count(), step = std::max<std::size_t>(1, frames / 16);
    std::vector<std::size_t> looked_at{frames - 1};
    for (std::size_t k = 0; k < frames; k += step) looked_at.push_back(k);
    representative_frame_ = frames - 1;
    if (has_press_) {
        double most = 0;
        for (std::size_t k = 0; k < frames; ++k)
            if (const double press = reader_.values("press_mm", k, 1)[0]; press > most) {
                most = press;
                representative_frame_ = k;
            }
        looked_at.push_back(representative_frame_);
    }
    for (const std::size_t k : looked_at) {
        const std::vector<Vector3> u = reader_.displacement(k);
        for (std::size_t n = 0; n < u.size(); ++n) {
            largest_displacement_ = std::max(largest_displacement_, u[n].norm());
            extent_.extend(body_.mesh.nodes[n] + u[n]);
        }
        if (states_errors())
            for (const double radius : statements_.read(k).surface.radius_95)
                largest_stated_error_ = std::max(largest_stated_error_, radius);
        if (!has_stress_) continue;
        std::vector<double> stress = nodal_stress(k);
        const auto high = stress.begin() + static_cast<std::ptrdiff_t>(
                                               0.99 * static_cast<double>(stress.size() - 1));
        std::nth_element(stress.begin(), high, stress.end());
        largest_stress_ = std::max(largest_stress_, *high);
    }
}

/// Mean over the tets of each node, weighted by volume.
std::vector<double> ViewRecording::nodal_stress(std::size_t k) const {
    const std::vector<double> stress = reader_.field("von_mises", k, 1);
    if (stress.size() != body_.mesh.tets.size())
        fail("field von_mises of frame {} has {} values, expected {}", k, stress.size(),
             body_.mesh.tets.size());
    std::vector<double> nodal(body_.mesh.nodes.size(), 0);
    for (std::size_t t = 0; t < stress.size(); ++t)
        for (const std::int32_t n : body_.mesh.tets[t])
            nodal[n] += signed_volume(body_.mesh, body_.mesh.tets[t]) / 4 * stress[t];
    for (std::size_t n = 0; n < nodal.size(); ++n)
        if (node_volume_[n] > 0) nodal[n] /= node_volume_[n];
    return nodal;
}

ShownMoment ViewRecording::moment(std::size_t k) const {
    ShownMoment moment;
    moment.time_s = reader_.times_s()[k];
    moment.displacement = reader_.displacement(k);
    if (has_stress_) moment.von_mises = nodal_stress(k);
    moment.sensors = sensors_;
    if (!traced_.empty()) {
        const Traced& now = traced_[k];
        moment.tools = now.tools;
        moment.pull = now.pull;
        for (std::size_t i = 0; i < now.now.size(); ++i) {
            moment.sensors[i].base = now.bases[i];
            moment.sensors[i].now = now.now[i];
            if (!now.bases[i]) moment.sensors[i].patch.clear();
        }
    }
    double largest = 0;
    for (const Vector3& u : moment.displacement) largest = std::max(largest, u.norm());
    moment.text = fmt::format("{:.2f} s, frame {} of {}: {:.1f} mm at most",
                              moment.time_s - reader_.times_s().front(), k + 1,
                              reader_.frame_count(), 1e3 * largest);
    add_statement(moment, statements_.read(k), statements_.names());
    return moment;
}

}  // namespace livetet
