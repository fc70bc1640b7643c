#include "apps/live/patch_options.hpp"

#include <algorithm>

#include "tracking/poses.hpp"

namespace livetet {

double fixed_ahead_s(const TrackOptions& track) {
    if (track.ahead_ms) return track.ahead_ms->number.value_or(0) / 1e3;
    return track.smoothing_Hz.value_or(0) > 0 ? 0.04 : 0;
}

PoseFollowerOptions pose_follower_options(const TrackOptions& track) {
    PoseFollowerOptions options;
    options.estimator.position_rms = track.position_noise_mm / 1e3;
    options.estimator.rotation_rms = track.rotation_noise_deg * radians_per_degree;
    if (!track.smoothing_Hz) {
        options.ahead_s = fixed_ahead_s(track);
        return options;
    }
    PoseFilterOptions& filter = options.filter.emplace();
    filter.enabled = *track.smoothing_Hz > 0;
    if (filter.enabled) filter.min_cutoff_Hz = *track.smoothing_Hz;
    filter.ahead_s = fixed_ahead_s(track);
    return options;
}

SensorPatchOptions sensor_patch_options(const Scene& scene, const SensorOptions& options) {
    const TrackOptions& track = *scene.track;
    SensorPatchOptions patch;
    patch.drive = {.motion = options.motion,
                   .base_window_s = track.base_window_s,
                   .hold_s = track.hold_s,
                   .release_s = track.release_s,
                   .max_displacement = track.max_displacement_mm / 1e3};
    patch.follower = pose_follower_options(track);
    patch.radius = options.patch_radius_mm / 1e3;
    patch.radius_spread = options.patch_spread_mm.value_or(0.15 * options.patch_radius_mm) / 1e3;
    patch.stiffness = options.stiffness_N_per_m;
    patch.may_slip = options.may_slip;
    // A hundred times what a disc of the patch's size meets on a half-space: 2 E a / (1 - nu^2).
    double young = 0;
    for (const Material& m : scene.materials) young = std::max<double>(young, m.young_Pa);
    patch.firm_stiffness = 100 * 2 * young * patch.radius / 0.75;
    return patch;
}

}  // namespace livetet
