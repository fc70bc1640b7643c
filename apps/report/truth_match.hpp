#pragma once

#include <cstddef>
#include <vector>

#include "apps/live/run_result.hpp"
#include "apps/phantom/truth_file.hpp"

namespace livetet {

/// A kept frame and the truth at the time that its poses are meant for.
struct TruthMatch {
    std::size_t frame = 0;
    std::size_t sample = 0;  ///< the truth's sample nearest to that time
    TruthSample truth;
    double ahead_s = 0;  ///< from the frame's sample to that time
};

/// The frames that can be compared with the truth, and how many cannot.
struct TruthMatches {
    std::vector<TruthMatch> matches;
    std::size_t unregistered = 0;  ///< frames without a registration yet
    std::size_t beyond_truth = 0;  ///< frames predicted to a time after the truth's last sample
};

/// Matches each frame with the truth at its sample's time or, if the pose estimator predicted its
/// poses, at that time plus the recorded `ahead_s`. Between two samples the truth is linear, on the
/// sphere for rotations. The one-euro filter extrapolates to make up for its own lag: its poses are
/// meant for the sample's time. Throws Error if a frame's sample is not of the truth (within 1 ms).
TruthMatches match_with_truth(const RunResult& result, const Truth& truth);

}  // namespace livetet
