#include "io/tip_file.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/file.hpp"
#include "io/covariance_json.hpp"

namespace livetet {

namespace {

using Eigen::Vector3d;
using nlohmann::json;
constexpr const char* tip_format = "livetet tool tip 2";
constexpr const char* covariance_key = "covariance_mm2";

json numbers(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Vector3d vector_of(const json& j, const char* key, const std::string& where) {
    const auto v = j.at(key).get<std::vector<double>>();
    if (v.size() != 3) fail("{}: {} has {} numbers, expected 3", where, key, v.size());
    return {v[0], v[1], v[2]};
}

json matrix_mm(const RigidTransform<Tool, Tip>& t) {
    json rows = json::array();
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) rows.push_back(t.rotation(i, k));
        rows.push_back(1e3 * t.translation[i]);
    }
    for (const double x : {0.0, 0.0, 0.0, 1.0}) rows.push_back(x);
    return rows;
}

SpinCalibration spin_of(const json& j, const std::string& where) {
    SpinCalibration spin{vector_of(j, "in_tool", where), vector_of(j, "in_tracker", where),
                         j.at("tilt_deg").get<double>(), j.at("turn_deg").get<double>(),
                         j.at("used").get<std::size_t>()};
    if (!(std::abs(spin.shaft_in_tool.norm() - 1) < 1e-6))
        fail("{}: shaft.in_tool has a length of {}, expected 1", where, spin.shaft_in_tool.norm());
    return spin;
}

}  // namespace

void write_tip(const std::filesystem::path& path, const ToolTip& tip) {
    const PivotCalibration& c = tip.pivot;
    json j{{"format", tip_format},
           {"tool", tip.tool},
           {"tip_mm", numbers(1e3 * c.tool_from_tip.translation)},
           {"pivot_mm", numbers(1e3 * c.pivot_in_tracker)},
           {"rms_mm", 1e3 * c.rms},
           {"used", c.used},
           {"rejected", c.rejected},
           {"spread_deg", c.spread_deg},
           {"condition", c.condition},
           {"rank", c.rank},
           {"tool_from_tip_mm", matrix_mm(tip.tool_from_tip())}};
    if (tip.spin)
        j["shaft"] = {{"in_tool", numbers(tip.spin->shaft_in_tool)},
                      {"in_tracker", numbers(tip.spin->shaft_in_tracker)},
                      {"tilt_deg", tip.spin->tilt_deg},
                      {"turn_deg", tip.spin->turn_deg},
                      {"used", tip.spin->used}};
    if (tip.covariance) j[covariance_key] = covariance_to_json(*tip.covariance);
    write_text_file(path, j.dump(2, ' ', false, json::error_handler_t::replace) + "\n");
}

ToolTip read_tip(const std::filesystem::path& path) {
    const std::string text = read_text_file(path), where = path.string();
    ToolTip tip;
    try {
        const json j = json::parse(text);
        if (j.value("format", "") != tip_format)
            fail("{}: format is \"{}\", expected \"{}\"", where, j.value("format", ""), tip_format);
        tip.tool = j.at("tool").get<std::string>();
        PivotCalibration& c = tip.pivot;
        c.tool_from_tip.translation = vector_of(j, "tip_mm", where) / 1e3;
        c.pivot_in_tracker = vector_of(j, "pivot_mm", where) / 1e3;
        c.rms = j.at("rms_mm").get<double>() / 1e3;
        c.used = j.at("used").get<std::size_t>();
        c.rejected = j.at("rejected").get<std::size_t>();
        c.spread_deg = j.at("spread_deg").get<double>();
        c.condition = j.at("condition").get<double>();
        c.rank = j.at("rank").get<int>();
        if (j.contains("shaft")) tip.spin = spin_of(j["shaft"], where);
        if (j.contains(covariance_key))
            tip.covariance =
                covariance_from_json<3>(j[covariance_key], where + ": " + covariance_key);
    } catch (const json::exception& e) {
        fail("{}: not a tool tip that `livetet calibrate` wrote: {}", where, e.what());
    }
    return tip;
}

ToolTip read_tip(const std::filesystem::path& path, const std::string& tool) {
    ToolTip tip = read_tip(path);
    if (tip.tool != tool)
        fail("{}: is the tip of {}, expected that of {}", path.string(), tip.tool, tool);
    return tip;
}

}  // namespace livetet
