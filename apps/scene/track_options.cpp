#include "apps/scene/track_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "base/error.hpp"
#include "config/key_places.hpp"

namespace livetet {

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

void check_targets(std::span<const TargetOptions> targets, std::string_view list,
                   const KeyPlaces& places) {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < targets.size(); ++i) {
        const TargetOptions& t = targets[i];
        const std::string key = fmt::format("{}[{}]", list, i);
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

namespace {

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

/// Throws Error unless a blade is a segment between two points.
void check_blade(const ToolOptions& tool, const std::string& key, const KeyPlaces& places) {
    constexpr double shortest_mm = 1, longest_mm = 1000;
    const std::vector<double>& ends = *tool.blade_mm;
    if (ends.size() != 6)
        fail("{} has {} numbers, expected 6: two ends ({})", key, ends.size(), places(key));
    const Eigen::Vector3d a(ends[0], ends[1], ends[2]), b(ends[3], ends[4], ends[5]);
    const double length_mm = (b - a).norm();
    if (!(length_mm >= shortest_mm && length_mm <= longest_mm))  // so that NaN fails
        fail(
            "{} = [{:g}, {:g}, {:g}, {:g}, {:g}, {:g}]: the blade of {} is {:g} mm long, expected "
            "{:g} to {:g} mm ({})",
            key, a.x(), a.y(), a.z(), b.x(), b.y(), b.z(), tool.tool, length_mm, shortest_mm,
            longest_mm, places(key));
    if (!(a.norm() <= longest_mm && b.norm() <= longest_mm))
        fail(
            "{}: an end of the blade of {} is {:g} mm from its tip or sensor, expected up to {:g} "
            "mm ({})",
            key, tool.tool, std::max(a.norm(), b.norm()), longest_mm, places(key));
}

}  // namespace

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
    if (!track.start.empty() && has_blades(track))
        fail(
            "track.start: found a blade in track.tools, or track.cut_by_hand_mm: a cut would "
            "free what the start holds, expected one of them ({})",
            places("track.start"));
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
        if (tool.blade_mm) check_blade(tool, fmt::format("track.tools[{}].blade_mm", i), places);
    }
    for (std::size_t i = 0; i < track.sensors.size(); ++i) {
        const SensorOptions& sensor = track.sensors[i];
        const std::string key = fmt::format("track.sensors[{}].patch_spread_mm", i);
        if (sensor.patch_spread_mm.value_or(0) >= sensor.patch_radius_mm)
            fail("{} = {} mm must be less than patch_radius_mm = {} mm ({})", key,
                 *sensor.patch_spread_mm, sensor.patch_radius_mm, places(key));
    }
    check_targets(track.targets, "track.targets", places);
}

}  // namespace livetet
