#pragma once

#include <string>
#include <vector>

#include "apps/scene/scene.hpp"
#include "io/registration_file.hpp"

namespace livetet {

/// `registration` as a transform from the reference sensor. Throws Error if it does not fit this
/// scene.
RigidTransform<ImageFrame, Reference> rigid_registration(const FiducialRegistration& registration,
                                                         const TrackOptions& track);

/// The reference, the sensors, and the tools to show; each once.
std::vector<std::string> tools_of(const TrackOptions& track);

}  // namespace livetet
