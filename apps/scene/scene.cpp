#include "apps/scene/scene.hpp"

#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>

#include "apps/scene/scene_files.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "config/key_places.hpp"
#include "config/yaml.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

int selections_in(const SelectionOptions& s) {
    return s.mask.has_value() + s.group.has_value() + s.box_mm.has_value() +
           s.sphere_mm.has_value() + s.half_space_mm.has_value() + s.nodes.has_value();
}

void check_selection(const SelectionOptions& s, const std::string& key, const KeyPlaces& places) {
    const int given = selections_in(s);
    if (given != 1)
        fail(
            "{} names {} of mask, group, box_mm, sphere_mm, half_space_mm, nodes, expected exactly "
            "one ({})",
            key, given, places(key));
    const auto check_size = [&](const std::optional<std::vector<double>>& values,
                                std::string_view name, std::size_t size) {
        if (values && values->size() != size)
            fail("{}.{} has {} numbers, expected {} ({})", key, name, values->size(), size,
                 places(fmt::format("{}.{}", key, name)));
    };
    check_size(s.box_mm, "box_mm", 6);
    check_size(s.sphere_mm, "sphere_mm", 4);
    check_size(s.half_space_mm, "half_space_mm", 6);
}

}  // namespace

std::optional<double> seconds_of(const std::string& text) {
    double number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    std::string_view unit(end, text.data() + text.size());
    unit.remove_prefix(std::min(unit.find_first_not_of(' '), unit.size()));
    if (error != std::errc{} || !(number > 0) || !std::isfinite(number) ||
        (unit != "ms" && unit != "s"))
        return {};
    return unit == "ms" ? number / 1e3 : number;
}

std::optional<std::pair<double, double>> range_of(const std::string& text) {
    const std::size_t colon = text.find(':');
    if (colon == std::string::npos || text.size() < 2) return {};
    const std::string_view low = trim(std::string_view(text).substr(0, colon));
    const std::string_view high = trim(std::string_view(text).substr(colon + 1));
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const auto from = low.empty() ? -infinity : parse_number(low);
    const auto to = high.empty() ? infinity : parse_number(high);
    if ((low.empty() && high.empty()) || !from || !to || !(*from <= *to)) return {};
    return std::pair(*from, *to);
}

namespace {

/// Throws Error if the scene writes a file that it reads, or a file twice.
void refuse_overwritten_inputs(const Scene& scene, const KeyPlaces& places) {
    std::set<std::filesystem::path> read = read_files(scene);
    read.insert(places.file());
    const auto written = written_files(scene);
    for (const auto& [key, path] : written)
        for (const std::filesystem::path& input : read)
            if (same_file(path, input))
                fail("{} = {}: is read, expected another file to write ({})", key, path.string(),
                     places(key));
    for (std::size_t i = 0; i < written.size(); ++i)
        for (std::size_t j = i + 1; j < written.size(); ++j)
            if (same_file(written[i].second, written[j].second))
                fail("{} and {}: both name {}, expected two files ({})", written[i].first,
                     written[j].first, written[i].second.string(), places(written[j].first));
}

void check_selections(const Scene& scene, const KeyPlaces& places) {
    const auto check_soft = [&](auto& list, std::string_view name) {
        for (std::size_t i = 0; i < list.size(); ++i)
            if (list[i].stiffness_N_per_m && list[i].components.size() != 3)
                fail(
                    "{}[{}].components = {} with a stiffness: springs pull along x, y and z, "
                    "expected xyz ({})",
                    name, i, list[i].components, places(fmt::format("{}[{}].components", name, i)));
    };
    const auto check_all = [&](auto& list, std::string_view name) {
        for (std::size_t i = 0; i < list.size(); ++i)
            check_selection(list[i], fmt::format("{}[{}]", name, i), places);
    };
    check_soft(scene.fix, "fix");
    check_soft(scene.drive, "drive");
    check_all(scene.fix, "fix");
    check_all(scene.drive, "drive");
    check_all(scene.loads, "loads");
}

/// Each target by one of point, points and a selection, and with a name unless the points have.
void check_targets(const TrackOptions& track, const KeyPlaces& places) {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < track.targets.size(); ++i) {
        const TargetOptions& t = track.targets[i];
        const std::string key = fmt::format("track.targets[{}]", i);
        const int given = t.point_mm.has_value() + !t.points.empty() + (selections_in(t) > 0);
        if (given != 1)
            fail("{} names {} of point_mm, points and a selection of nodes, expected one ({})", key,
                 given, places(key));
        if (selections_in(t) > 0) check_selection(t, key, places);
        if (!t.points.empty()) {
            if (!t.name.empty())
                fail("{}.name = {}: the points of {} have names, expected no name ({})", key,
                     t.name, t.points.string(), places(key + ".name"));
            continue;
        }
        if (t.name.empty()) fail("{}.name is missing ({})", key, places(key));
        if (std::find(names.begin(), names.end(), t.name) != names.end())
            fail("{}.name = {}: another target has this name ({})", key, t.name,
                 places(key + ".name"));
        names.push_back(t.name);
    }
}

/// Whether the poses in use can be extrapolated as `ahead_ms` and `display_ms` say.
void check_ahead(const TrackOptions& track, const KeyPlaces& places) {
    const bool is_auto = track.ahead_ms && track.ahead_ms->is_auto();
    if (is_auto && track.smoothing_Hz)
        fail(
            "track.ahead_ms = auto with track.smoothing_Hz = {} Hz: only the pose estimator takes "
            "a time that changes, expected no smoothing_Hz, or a number of ms ({})",
            *track.smoothing_Hz, places("track.ahead_ms"));
    if (track.ahead_ms && track.ahead_ms->number.value_or(0) > 0 && track.smoothing_Hz == 0)
        fail(
            "track.ahead_ms = {} ms with track.smoothing_Hz = 0 Hz: poses as measured are not "
            "extrapolated, expected no smoothing_Hz, or ahead_ms: 0 ({})",
            *track.ahead_ms->number, places("track.ahead_ms"));
    if (track.display_ms > 0 && !is_auto)
        fail(
            "track.display_ms = {} ms without track.ahead_ms = auto: is not used, expected "
            "ahead_ms: auto, or no display_ms ({})",
            track.display_ms, places("track.display_ms"));
}

void check_track(const TrackOptions& track, const KeyPlaces& places) {
    if (track.source.empty())
        fail(
            "track.source is missing, expected openigtlink://host:port, a tracker recording, or a "
            "script ({})",
            places("track"));
    if (track.registration.empty())
        fail("track.registration is missing, expected what `livetet register` wrote ({})",
             places("track"));
    check_ahead(track, places);
    std::vector<std::string> names{track.reference_tool};
    for (std::size_t i = 0; i < track.sensors.size(); ++i) {
        const SensorOptions& sensor = track.sensors[i];
        if (std::find(names.begin(), names.end(), sensor.tool) != names.end())
            fail(
                "track.sensors: {} is named twice, expected each tool once, and not the reference "
                "({})",
                sensor.tool, places(fmt::format("track.sensors[{}].tool", i)));
        names.push_back(sensor.tool);
    }
    for (std::size_t i = 0; i < track.tools.size(); ++i) {
        const ToolOptions& tool = track.tools[i];
        const std::string name = tool.tool + (tool.tip.empty() ? "" : "Tip");
        if (std::find(names.begin(), names.end(), name) != names.end())
            fail("track.tools: {} is shown twice as {}ToRAS, expected names that differ ({})",
                 tool.tool, name, places(fmt::format("track.tools[{}].tool", i)));
        names.push_back(name);
    }
    for (std::size_t i = 0; i < track.sensors.size(); ++i) {
        const SensorOptions& sensor = track.sensors[i];
        const std::string key = fmt::format("track.sensors[{}].patch_spread_mm", i);
        if (sensor.patch_spread_mm.value_or(0) >= sensor.patch_radius_mm)
            fail("{} = {} mm must be less than patch_radius_mm = {} mm ({})", key,
                 *sensor.patch_spread_mm, sensor.patch_radius_mm, places(key));
    }
    check_targets(track, places);
}

/// Makes the scene's relative paths relative to `folder`.
void resolve_paths(Scene& scene, const std::filesystem::path& folder) {
    const auto resolve = [&](std::filesystem::path& p) {
        if (!p.empty() && p.is_relative()) p = folder / p;
    };
    resolve(scene.mesh.file);
    resolve(scene.image);
    for (auto& f : scene.fix)
        if (f.mask) resolve(*f.mask);
    for (auto& d : scene.drive)
        if (d.mask) resolve(*d.mask);
    for (auto& l : scene.loads)
        if (l.mask) resolve(*l.mask);
    if (scene.track) {
        if (scene.track->source.find("://") == std::string::npos) {
            std::filesystem::path source = scene.track->source;
            resolve(source);
            scene.track->source = source.string();
        }
        resolve(scene.track->registration);
        for (ToolOptions& tool : scene.track->tools) resolve(tool.tip);
        for (TargetOptions& target : scene.track->targets) {
            resolve(target.points);
            if (target.mask) resolve(*target.mask);
        }
    }
    if (scene.probes) {
        resolve(scene.probes->points);
        resolve(scene.probes->displacements);
    }
    resolve(scene.output.file);
}

}  // namespace

void finish_scene(Scene& scene, const KeyPlaces& places, const std::filesystem::path& folder) {
    if (scene.mesh.file.empty())
        fail("mesh.file is missing, expected the body's mesh ({})", places("mesh"));
    if (scene.materials.empty())
        fail("materials is empty, expected at least one ({})", places("materials"));
    if (scene.time.scheme == TimeScheme::newmark && 2 * scene.time.beta < scene.time.gamma)
        fail(
            "time.beta = {} is below gamma / 2 = {}: not stable at every step, expected at least "
            "that ({})",
            scene.time.beta, scene.time.gamma / 2, places("time.beta"));
    check_selections(scene, places);
    if (scene.track) check_track(*scene.track, places);
    if (scene.probes && scene.probes->points.empty())
        fail("probes.points is missing, expected a CSV of points ({})", places("probes"));
    resolve_paths(scene, folder);
    refuse_overwritten_inputs(scene, places);
}

Scene load_scene(const std::filesystem::path& path) {
    const std::string text = read_text_file(path);
    Scene scene = read_yaml<Scene>(text, path.string());
    finish_scene(scene, KeyPlaces(path.string(), text), path.parent_path());
    return scene;
}

}  // namespace livetet
