#include "apps/live/pose_quality.hpp"

#include <fmt/ranges.h>

#include <algorithm>
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
        const long lag_ms = std::lround(1e3 * *quality.lag_s);
        texts.push_back(lag_ms < 0 ? fmt::format("{} {} ms ahead", tool, -lag_ms)
                                   : fmt::format("{} {} ms", tool, lag_ms));
        is_large = is_large || *quality.lag_s > large_s;
    }
    return fmt::format("{}{}", fmt::join(texts, ", "),
                       is_large ? " (track.ahead_ms makes up for it)" : "");
}

std::string noise_text(const PoseQualities& poses) {
    constexpr double large_ratio = 2;
    std::vector<std::string> texts;
    for (const auto& [tool, quality] : poses) {
        const double ratio = std::max(quality.position_noise_ratio, quality.rotation_noise_ratio);
        if (ratio > large_ratio) texts.push_back(fmt::format("{} {:.1f} times", tool, ratio));
    }
    if (texts.empty()) return "";
    return fmt::format("noise of {} what track.position_noise_mm and rotation_noise_deg say",
                       fmt::join(texts, ", "));
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
