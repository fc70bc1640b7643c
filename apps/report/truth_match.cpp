#include "apps/report/truth_match.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

#include "apps/scene/scene.hpp"
#include "base/error.hpp"
#include "config/yaml.hpp"

namespace livetet {

namespace {

constexpr double matching_s = 1e-3;

/// Number of the sample nearest to a time.
std::size_t nearest_sample(const std::vector<TruthSample>& samples, double time_s) {
    const auto later = std::ranges::lower_bound(samples, time_s, {}, &TruthSample::time_s);
    const auto k = static_cast<std::size_t>(later - samples.begin());
    if (later == samples.begin()) return 0;
    if (later == samples.end()) return k - 1;
    return time_s - samples[k - 1].time_s < later->time_s - time_s ? k - 1 : k;
}

/// The truth at a time within the samples.
TruthSample truth_at(const std::vector<TruthSample>& samples, double time_s) {
    const auto later = std::ranges::lower_bound(samples, time_s, {}, &TruthSample::time_s);
    if (later == samples.begin()) return *later;
    const TruthSample &a = *(later - 1), &b = *later;
    const double share = (time_s - a.time_s) / (b.time_s - a.time_s);
    TruthSample between;
    between.time_s = time_s;
    between.depth = std::lerp(a.depth, b.depth, share);
    auto& pose = between.tracker_from_image;
    pose.translation =
        (1 - share) * a.tracker_from_image.translation + share * b.tracker_from_image.translation;
    pose.rotation = Eigen::Quaterniond(a.tracker_from_image.rotation)
                        .slerp(share, Eigen::Quaterniond(b.tracker_from_image.rotation))
                        .toRotationMatrix();
    return between;
}

/// Whether `ahead_s` of the frames is a prediction. A scene that is not known says nothing of a
/// filter.
bool is_predicted(const RunResult& result) {
    if (result.scene_text.empty()) return true;
    try {
        const auto scene = read_yaml<Scene>(result.scene_text, result.source);
        return !(scene.track && scene.track->smoothing_Hz);
    } catch (const Error&) {
        return true;
    }
}

}  // namespace

TruthMatches match_with_truth(const RunResult& result, const Truth& truth) {
    const std::vector<TruthSample>& samples = truth.samples;
    if (samples.empty()) fail("{}: the truth has no samples to compare with", result.source);
    const bool predicted = is_predicted(result);
    TruthMatches matched;
    for (std::size_t f = 0; f < result.frames.size(); ++f) {
        const RunFrame& frame = result.frames[f];
        const std::size_t sample = nearest_sample(samples, frame.time_s);
        if (!(std::abs(samples[sample].time_s - frame.time_s) <= matching_s))
            fail(
                "{}: the frame at {:.4f} s has no true sample within {:g} ms (the nearest is at "
                "{:.4f} s; the truth goes from {:.4f} to {:.4f} s), expected the truth of the "
                "recording that was tracked",
                result.source, frame.time_s, 1e3 * matching_s, samples[sample].time_s,
                samples.front().time_s, samples.back().time_s);
        const auto& pose = frame.tracker_from_image;
        const double ahead_s = predicted ? frame.ahead_ms.value_or(0) / 1e3 : 0;
        const double time_s = samples[sample].time_s + ahead_s;
        if (!pose.rotation.allFinite() || !pose.translation.allFinite())
            ++matched.unregistered;
        else if (ahead_s == 0)
            matched.matches.push_back({f, sample, samples[sample], 0});
        else if (time_s > samples.back().time_s)
            ++matched.beyond_truth;
        else
            matched.matches.push_back(
                {f, nearest_sample(samples, time_s), truth_at(samples, time_s), ahead_s});
    }
    return matched;
}

}  // namespace livetet
