#include "tracking/dwell.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tracking/poses.hpp"

namespace livetet {

namespace {

using Eigen::Vector3d;

// The tip in one frame with usable poses. "Judged" values are in the frame in which stillness is
// judged.
struct TipSample {
    std::size_t frame = 0;
    double time_s = 0;
    Vector3d in_tracker = Vector3d::Zero(), in_reference = Vector3d::Zero();
    // orientation of the tool, judged
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    Vector3d judged = Vector3d::Zero();    // position of the tip, judged
    Vector3d smoothed = Vector3d::Zero();  // `judged`, averaged over the window
};

void check_options(const DwellOptions& o) {
    const auto positive = [](const char* name, double value) {
        if (!(value > 0)) fail("dwell: {} = {} must be > 0", name, value);
    };
    positive("radius_mm", o.radius_mm);
    positive("min_duration_s", o.min_duration_s);
    positive("smoothing_s", o.smoothing_s);
    positive("max_scatter_mm", o.max_scatter_mm);
}

std::vector<TipSample> tip_samples(const Recording& recording, const Vector3d& tip,
                                   const DwellOptions& options) {
    const std::size_t tool = tool_index(recording, options.tool);
    const std::size_t reference =
        options.reference ? tool_index(recording, *options.reference) : tool;
    std::vector<TipSample> samples;
    for (std::size_t i = 0; i < recording.samples.size(); ++i) {
        const auto& poses = recording.samples[i].poses;
        if (std::max(tool, reference) >= poses.size()) continue;
        if (!is_usable(poses[tool]) || !is_usable(poses[reference])) continue;
        TipSample s;
        s.frame = i;
        s.time_s = recording.samples[i].time_s;
        s.in_tracker = tracker_from<Tool>(poses[tool]) * tip;
        s.in_reference = tracker_from<Reference>(poses[reference]).inverse() * s.in_tracker;
        s.judged = options.reference ? s.in_reference : s.in_tracker;
        s.turn = options.reference
                     ? Eigen::Matrix3d(poses[reference].rotation.transpose() * poses[tool].rotation)
                     : poses[tool].rotation;
        samples.push_back(s);
    }
    return samples;
}

void smooth(std::vector<TipSample>& samples, double window_s) {
    std::size_t a = 0, b = 0;
    for (TipSample& s : samples) {
        while (a < samples.size() && samples[a].time_s < s.time_s - window_s / 2) ++a;
        while (b < samples.size() && samples[b].time_s <= s.time_s + window_s / 2) ++b;
        Vector3d sum = Vector3d::Zero();
        for (std::size_t i = a; i < b; ++i) sum += samples[i].judged;
        s.smoothed = b > a ? Vector3d(sum / static_cast<double>(b - a)) : s.judged;
    }
}

// Mean of a member: a position or an orientation.
template <class Value>
Value mean_of(std::span<const TipSample> samples, Value TipSample::*what) {
    Value sum = Value::Zero();
    for (const TipSample& s : samples) sum += s.*what;
    return sum / static_cast<double>(samples.size());
}

// RMS angle from the rotation nearest to the mean: |R - mean|_F^2 = 8 sin^2(angle / 2).
double turn_deg(std::span<const TipSample> stretch, const Eigen::Matrix3d& mean_turn) {
    const Eigen::Matrix3d mean = nearest_rotation(mean_turn);
    double squares = 0;
    for (const TipSample& s : stretch) {
        const double half = std::min(1.0, (s.turn - mean).norm() / std::sqrt(8.0));
        squares += 4 * std::asin(half) * std::asin(half);
    }
    return std::sqrt(squares / static_cast<double>(stretch.size())) * 180 / std::numbers::pi;
}

Dwell dwell_of(std::span<const TipSample> stretch, const DwellOptions& options) {
    Dwell dwell;
    dwell.first = stretch.front().frame;
    dwell.last = stretch.back().frame + 1;
    dwell.used = stretch.size();
    dwell.tip_in_tracker = mean_of(stretch, &TipSample::in_tracker);
    if (options.reference) dwell.tip_in_reference = mean_of(stretch, &TipSample::in_reference);
    const Vector3d mean = mean_of(stretch, &TipSample::judged);
    double sum = 0;
    for (const TipSample& s : stretch) sum += (s.judged - mean).squaredNorm();
    dwell.scatter = std::sqrt(sum / static_cast<double>(stretch.size()));
    dwell.mean_turn = mean_of(stretch, &TipSample::turn);
    dwell.turn_deg = turn_deg(stretch, dwell.mean_turn);
    return dwell;
}

void check_window(const FrameWindow& w, const Recording& recording) {
    if (w.first >= w.last || w.last > recording.samples.size())
        fail("dwell: frames {} to {} are not a window of the recording's {} frames", w.first,
             w.last, recording.samples.size());
}

// Index one past the last sample of the stretch that begins at `first`.
std::size_t end_of_stretch(std::span<const TipSample> samples, std::size_t first,
                           const DwellOptions& options) {
    Vector3d mean = samples[first].smoothed;
    std::size_t j = first + 1;
    for (; j < samples.size(); ++j) {
        if (samples[j].time_s - samples[j - 1].time_s > options.smoothing_s) break;
        if ((samples[j].smoothed - mean).norm() > 1e-3 * options.radius_mm) break;
        mean += (samples[j].smoothed - mean) / static_cast<double>(j - first + 1);
    }
    return j;
}

}  // namespace

std::vector<Dwell> find_dwells(const Recording& recording,
                               const RigidTransform<Tool, Tip>& tool_from_tip,
                               const DwellOptions& options) {
    return find_rests(recording, tool_from_tip, options).dwells;
}

Rests find_rests(const Recording& recording, const RigidTransform<Tool, Tip>& tool_from_tip,
                 const DwellOptions& options) {
    check_options(options);
    std::vector<TipSample> samples = tip_samples(recording, tool_from_tip.translation, options);
    smooth(samples, options.smoothing_s);
    const std::span<const TipSample> all(samples);
    struct Stretch {
        std::size_t first, last;
        Vector3d mean;
    };
    std::vector<Stretch> stretches;
    for (std::size_t i = 0; i < samples.size();) {
        const std::size_t j = end_of_stretch(all, i, options);
        if (samples[j - 1].time_s - samples[i].time_s < options.min_duration_s) {
            ++i;
            continue;
        }
        const Vector3d mean = mean_of(all.subspan(i, j - i), &TipSample::smoothed);
        const bool same =
            !stretches.empty() &&
            (stretches.back().mean - mean).norm() < 1e-3 * options.min_separation_mm &&
            samples[i].time_s - samples[stretches.back().last - 1].time_s <= options.smoothing_s;
        if (same)
            stretches.back().last = j;
        else
            stretches.push_back({i, j, mean});
        i = j;
    }
    Rests rests;
    for (const Stretch& s : stretches) {
        const Dwell dwell = dwell_of(all.subspan(s.first, s.last - s.first), options);
        (dwell.turn_deg >= options.min_turn_deg ? rests.dwells : rests.unheld).push_back(dwell);
    }
    return rests;
}

std::vector<Dwell> dwells_in_windows(const Recording& recording,
                                     const RigidTransform<Tool, Tip>& tool_from_tip,
                                     std::span<const FrameWindow> windows,
                                     const DwellOptions& options) {
    check_options(options);
    const std::vector<TipSample> samples =
        tip_samples(recording, tool_from_tip.translation, options);
    std::vector<Dwell> dwells;
    for (const FrameWindow& w : windows) {
        check_window(w, recording);
        std::vector<TipSample> inside;
        for (const TipSample& s : samples)
            if (s.frame >= w.first && s.frame < w.last) inside.push_back(s);
        if (inside.empty())
            fail("dwell: \"{}\" is not seen in frames {} to {}", options.tool, w.first, w.last);
        const Dwell dwell = dwell_of(inside, options);
        const std::size_t third = std::max<std::size_t>(1, inside.size() / 3);
        const double drift = (mean_of(std::span(inside).first(third), &TipSample::judged) -
                              mean_of(std::span(inside).last(third), &TipSample::judged))
                                 .norm();
        if (1e3 * dwell.scatter > options.max_scatter_mm || 1e3 * drift > 2 * options.radius_mm)
            fail(
                "dwell: the tip moves in frames {} to {}: scatter {:.2f} mm (at most {}), drift "
                "{:.2f} mm (at most {})",
                w.first, w.last, 1e3 * dwell.scatter, options.max_scatter_mm, 1e3 * drift,
                2 * options.radius_mm);
        dwells.push_back(dwell);
    }
    return dwells;
}

std::vector<Vector3d> tip_places(const Recording& recording,
                                 const RigidTransform<Tool, Tip>& tool_from_tip,
                                 std::span<const FrameWindow> windows,
                                 const DwellOptions& options) {
    for (const FrameWindow& w : windows) check_window(w, recording);
    std::vector<Vector3d> places;
    for (const TipSample& s : tip_samples(recording, tool_from_tip.translation, options)) {
        const bool asked = std::any_of(windows.begin(), windows.end(), [&](const FrameWindow& w) {
            return s.frame >= w.first && s.frame < w.last;
        });
        if (windows.empty() || asked) places.push_back(s.judged);
    }
    return places;
}

}  // namespace livetet
