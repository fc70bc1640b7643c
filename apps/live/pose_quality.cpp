#include "apps/live/pose_quality.hpp"

#include <fmt/ranges.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/error.hpp"

namespace livetet {

using nlohmann::json;

std::string lags_text(const PoseQualities& poses) {
    constexpr double large_s = 0.02;
    std::vector<std::string> texts;
    bool is_large = false;
    for (const auto& [tool, quality] : poses) {
        if (!quality.lag_s) continue;
        texts.push_back(fmt::format("{} {:.0f} ms", tool, 1e3 * *quality.lag_s));
        is_large = is_large || *quality.lag_s > large_s;
    }
    return fmt::format("{}{}", fmt::join(texts, ", "),
                       is_large ? " (track.ahead_ms makes up for it)" : "");
}

std::string noise_text(const PoseQualities& poses) {
    constexpr double large_ratio = 2;
    std::vector<std::string> texts;
    const auto add = [&](const char* what, const std::string& tool, double ratio, const char* key) {
        if (ratio > large_ratio)
            texts.push_back(fmt::format("{} of {} {:.1f} times as noisy as track.{} says", what,
                                        tool, ratio, key));
    };
    for (const auto& [tool, quality] : poses) {
        add("position", tool, quality.position_noise_ratio, "position_noise_mm");
        add("rotation", tool, quality.rotation_noise_ratio, "rotation_noise_deg");
    }
    return fmt::format("{}", fmt::join(texts, ", "));
}

json json_of(const PoseQualities& poses) {
    json tools = json::object();
    for (const auto& [tool, quality] : poses) {
        tools[tool] = {{"position_noise_ratio", quality.position_noise_ratio},
                       {"rotation_noise_ratio", quality.rotation_noise_ratio}};
        if (quality.lag_s) tools[tool]["lag_ms"] = 1e3 * *quality.lag_s;
    }
    return tools;
}

PoseQualities parse_pose_qualities(const json& tools, const std::string& source) {
    if (!tools.is_object()) fail("{}: \"poses\" of the run is not a JSON object", source);
    PoseQualities poses;
    for (const auto& [tool, values] : tools.items()) {
        const auto number = [&, &name = tool, &object = values](const char* key) {
            const auto found = object.is_object() ? object.find(key) : object.end();
            if (found == object.end() || !found->is_number() ||
                !std::isfinite(found->get<double>()))
                fail("{}: \"{}\" of {} in \"poses\" of the run is not a finite number", source, key,
                     name);
            return found->get<double>();
        };
        PoseQuality& quality = poses[tool];
        quality.position_noise_ratio = number("position_noise_ratio");
        quality.rotation_noise_ratio = number("rotation_noise_ratio");
        if (values.contains("lag_ms")) quality.lag_s = number("lag_ms") / 1e3;
    }
    return poses;
}

}  // namespace livetet
