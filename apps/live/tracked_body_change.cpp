#include <algorithm>

#include "apps/live/listed_scene.hpp"
#include "apps/live/response_nodes.hpp"
#include "apps/live/tracked_body.hpp"
#include "apps/scene/mesh_grading.hpp"
#include "io/tip_file.hpp"

namespace livetet {

namespace {

std::vector<RigidTransform<Tool, Tip>> read_tips(const TrackOptions& track) {
    std::vector<RigidTransform<Tool, Tip>> tips;
    for (const ToolOptions& tool : track.tools)
        tips.push_back(tool.tip.empty() ? RigidTransform<Tool, Tip>{}
                                        : read_tip(tool.tip, tool.tool).tool_from_tip());
    return tips;
}

/// Where a sensor was planned does not matter to one that follows.
bool follow_alike(SensorOptions a, const SensorOptions& b) {
    a.place_mm = b.place_mm;
    return a == b;
}

}  // namespace

SceneChange prepare_change(const Scene& scene, const TetMesh& mesh) {
    check_sensor_places(scene, mesh);
    Scene listed = scene;
    list_selected_nodes(listed, mesh);
    SceneChange change{scene, SceneConstraints(listed, mesh), std::move(listed.fix),
                       read_tips(*scene.track)};
    change.constraints.move_to_share(1);
    check_no_free_motion(scene, mesh, change.constraints);
    return change;
}

std::vector<FixOptions> TrackedBody::fix_of_change(const SceneChange& change) const {
    if (!frame_.cut) return change.fix;
    Scene listed;
    listed.fix = change.fix;
    add_copies_to_lists(listed, frame_.cut->mesh.nodes.size() - frame_.cut->originals.size(),
                        frame_.cut->originals);
    return listed.fix;
}

void TrackedBody::change(SceneChange&& change) {
    // 1. may throw
    Scene next = scene_;
    next.fix = change.scene.fix;
    next.track->sensors = change.scene.track->sensors;
    next.track->tools = change.scene.track->tools;
    const bool fix_changed = !(next.fix == scene_.fix);
    std::list<Sensor> sensors, leaving;
    for (const SensorOptions& options : next.track->sensors) {
        const auto same = std::find_if(sensors_.begin(), sensors_.end(), [&](const Sensor& s) {
            return !s.leaving && follow_alike(s.options, options);
        });
        if (same == sensors_.end()) sensors.push_back(new_sensor(options));
        (void)find_tool_(options.tool);
    }
    for (const ToolOptions& tool : next.track->tools) (void)find_tool_(tool.tool);
    if (!cutting_ && has_blades(*next.track))
        fail(
            "track.tools: found blade_mm in a run that began without, expected it, or "
            "track.cut_by_hand_mm, from the start");
    std::optional<SceneConstraints> on_cut_mesh;  // else those of the change do
    std::vector<FixOptions> fix = fix_of_change(change);
    if (frame_.cut && fix_changed) {
        Scene listed = cutting_->listed;
        listed.fix = fix;
        on_cut_mesh.emplace(listed, body_.mesh());
        on_cut_mesh->move_to_share(1);
    }

    // 2. does not throw
    scene_ = std::move(next);
    for (const SensorOptions& options : scene_.track->sensors) {
        const auto kept = std::find_if(sensors_.begin(), sensors_.end(), [&](const Sensor& s) {
            return !s.leaving && follow_alike(s.options, options);
        });
        auto at = std::find_if(sensors.begin(), sensors.end(),
                               [&](const Sensor& s) { return s.options == options; });
        leaving.splice(leaving.end(), kept != sensors_.end() ? sensors_ : sensors,
                       kept != sensors_.end() ? kept : at);
        leaving.back().options.place_mm = options.place_mm;
    }
    for (Sensor& s : sensors_) s.leaving = true;
    leaving.splice(leaving.end(), sensors_);
    sensors_ = std::move(leaving);
    find_shown(std::move(change.tips));
    if (cutting_) {
        cutting_->cuts.change_blades();
        cutting_->followers.clear();
    }
    stating_.is_outdated = stating_.is_outdated || fix_changed;
    if (fix_changed) {
        std::vector<std::uint8_t> before = scene_constraints_->constraints().components;
        if (settling_)
            for (const std::int32_t n : settling_->nodes)
                before[n] = 0;  // they have not arrived yet
        scene_constraints_.emplace(on_cut_mesh ? std::move(*on_cut_mesh)
                                               : std::move(change.constraints));
        restart_opening();
        if (cutting_) cutting_->listed.fix = fix;
        stating_.fix = std::move(fix);
        if (frame_.cut) {
            const auto free = held_pieces(cutting_->listed, body_.mesh()).free;
            take_free_pieces(free);
            stating_.fix = fix_of_responses(cutting_->listed, body_.mesh(), free);
        }
        begin_settling(before);
        pulled_ = true;  // springs are rebuilt
    }
    take_constraints();
}

/// Starts leading nodes to rest that have fixed components now and had not `before`.
void TrackedBody::begin_settling(const std::vector<std::uint8_t>& before) {
    Settling settling;
    const Constraints& now = scene_constraints_->constraints();
    for (std::size_t n = 0; n < before.size(); ++n)
        if (now.components[n] & ~before[n]) {
            settling.nodes.push_back(static_cast<std::int32_t>(n));
            settling.from.push_back(frame_.displacement[n]);
        }
    settling.now = settling.from;
    settling.since_s = frame_.time_s;
    settling_ = std::move(settling);
}

void TrackedBody::settle() {
    if (!settling_) return;
    const double release_s = scene_.track->release_s;
    const double way =
        release_s > 0 ? std::min(1.0, (frame_.time_s - settling_->since_s) / release_s) : 1.0;
    const double left = 1 - way * way * (3 - 2 * way);
    for (std::size_t k = 0; k < settling_->nodes.size(); ++k)
        settling_->now[k] = scene_constraints_->constraints().values[settling_->nodes[k]] +
                            left * settling_->from[k];
    body_.body->move_constraints(settling_->nodes, settling_->now);
    if (way >= 1) settling_.reset();
}

}  // namespace livetet
