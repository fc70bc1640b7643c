#include "tracking/poses.hpp"

#include <fmt/ranges.h>

#include <algorithm>

#include "config/yaml.hpp"

namespace livetet {

std::size_t tool_index(const Recording& recording, std::string_view tool) {
    const auto found = std::find(recording.tools.begin(), recording.tools.end(), tool);
    if (found == recording.tools.end()) {
        const std::string nearest = nearest_name(tool, recording.tools);
        fail("the recording has no tool \"{}\"; it has {}{}", tool,
             fmt::join(recording.tools, ", "),
             nearest.empty() ? "" : fmt::format("; did you mean {}?", nearest));
    }
    return static_cast<std::size_t>(found - recording.tools.begin());
}

std::vector<RigidTransform<Tracker, Tool>> usable_poses(const Recording& recording,
                                                        std::string_view tool) {
    const std::size_t index = tool_index(recording, tool);
    std::vector<RigidTransform<Tracker, Tool>> poses;
    for (const TrackerSample& sample : recording.samples)
        if (index < sample.poses.size() && is_usable(sample.poses[index]))
            poses.push_back(tracker_from<Tool>(sample.poses[index]));
    return poses;
}

}  // namespace livetet
