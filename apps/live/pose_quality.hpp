#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tracking/pose_follower.hpp"

namespace livetet {

/// What was learned of the poses of each tool that is followed, by its name.
using PoseQualities = std::map<std::string, PoseQuality>;

/// "Reference 14 ms, Sensor 9 ms ahead", with the key that mends it if a lag is large; empty if
/// none is known.
std::string lags_text(const PoseQualities& poses);

/// "noise of Sensor 3.1 times what track.position_noise_mm and rotation_noise_deg say"; empty if
/// none is twice as noisy as stated. A sensor's poses are relative to the reference: both keys
/// decide, and the noise of both tools.
std::string noise_text(const PoseQualities& poses);

/// Lags in ms, where they are known, and noise ratios.
nlohmann::json json_of(const PoseQualities& poses);
/// The inverse. Throws Error naming `source` if a value is missing or not a finite number.
PoseQualities parse_pose_qualities(const nlohmann::json& tools, const std::string& source);

}  // namespace livetet
