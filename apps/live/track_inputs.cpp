#include "apps/live/track_inputs.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"

namespace livetet {

RigidTransform<ImageFrame, Reference> rigid_registration(const FiducialRegistration& registration,
                                                         const TrackOptions& track) {
    const auto& image_from_base = registration.image_from_base;
    if (std::abs(image_from_base.scale - 1) > 1e-9)
        fail(
            "{}: has a scale of {:.5f}, expected a rigid registration (livetet register without "
            "--scale)",
            track.registration.string(), image_from_base.scale);
    if (registration.reference_tool != track.reference_tool)
        fail(
            "{}: registered in the frame of {}, expected the reference sensor {} (livetet register "
            "--reference {})",
            track.registration.string(),
            registration.reference_tool.empty() ? "the tracker" : registration.reference_tool,
            track.reference_tool, track.reference_tool);
    return {image_from_base.rotation, image_from_base.translation};
}

std::vector<std::string> tools_of(const TrackOptions& track) {
    std::vector<std::string> tools{track.reference_tool};
    for (const SensorOptions& sensor : track.sensors) tools.push_back(sensor.tool);
    for (const ToolOptions& tool : track.tools)
        if (std::find(tools.begin(), tools.end(), tool.tool) == tools.end())
            tools.push_back(tool.tool);
    return tools;
}

}  // namespace livetet
