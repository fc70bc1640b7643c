#pragma once

#include <vector>

#include "apps/live/registration_input.hpp"
#include "apps/simulation/measured_organ.hpp"

namespace livetet {

/// Landmarks that --landmarks and --image both name; none without these. Throws Error for a
/// measured one that the image does not have.
std::vector<MeasuredLandmark> matched_landmarks(const RegisterArguments& a);

/// Maps what was measured into the image.
void map_landmarks(const FiducialRegistration& registration,
                   std::vector<MeasuredLandmark>& landmarks);

}  // namespace livetet
