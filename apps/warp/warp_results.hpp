#pragma once

#include <vector>

#include "apps/warp/warp_frame.hpp"
#include "base/progress.hpp"

namespace livetet {

/// Warps the frames that the arguments choose, and writes their files, each whole or not at all.
/// Several frames are warped side by side, one a thread. Returns one entry a frame, result by
/// result. `progress`: called before the first frame with 0 and after each one, by one thread at a
/// time; an exception that it throws ends the run after the frames at work. Throws Error as
/// plan_warp and warp_frame do; of several frames it says which one failed and how many are
/// written.
std::vector<WarpedFrame> warp_results(const WarpArguments& arguments,
                                      const ProgressCallback& progress);

/// On how many threads `frames` frames are warped.
int warp_threads(const WarpArguments& arguments, std::size_t frames);

}  // namespace livetet
