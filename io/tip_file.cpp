#include "io/tip_file.hpp"

#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/file.hpp"

namespace livetet {

namespace {

using nlohmann::json;
constexpr const char* format_name = "livetet tool tip 1";

}  // namespace

void write_tip(const std::filesystem::path& path, const std::string& tool, const PivotCalibration& c) {
    const Eigen::Vector3d tip = 1e3 * c.tool_from_tip.translation, pivot = 1e3 * c.pivot_in_tracker;
    const json j{{"format", format_name},
                 {"tool", tool},
                 {"tip_mm", {tip.x(), tip.y(), tip.z()}},
                 {"pivot_mm", {pivot.x(), pivot.y(), pivot.z()}},
                 {"rms_mm", 1e3 * c.rms},
                 {"used", c.used},
                 {"rejected", c.rejected},
                 {"spread_deg", c.spread_deg},
                 {"rank", c.rank}};
    write_text_file(path, j.dump(2) + "\n");
}

ToolTip read_tip(const std::filesystem::path& path) {
    const std::string text = read_text_file(path);
    ToolTip tip;
    try {
        const json j = json::parse(text);
        if (j.value("format", "") != format_name)
            fail("{}: format is \"{}\", expected \"{}\"", path.string(), j.value("format", ""), format_name);
        tip.tool = j.at("tool").get<std::string>();
        const auto mm = j.at("tip_mm").get<std::vector<double>>();
        if (mm.size() != 3) fail("{}: tip_mm has {} numbers, expected 3", path.string(), mm.size());
        tip.tool_from_tip.translation = Eigen::Vector3d(mm[0], mm[1], mm[2]) / 1e3;
    } catch (const json::exception& e) {
        fail("{}: not a tool tip that `livetet calibrate pivot` wrote: {}", path.string(), e.what());
    }
    return tip;
}

}  // namespace livetet
