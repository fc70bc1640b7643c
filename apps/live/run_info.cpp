#include <nlohmann/json.hpp>

#include "apps/live/run_result.hpp"
#include "base/error.hpp"

namespace livetet {

namespace {

using nlohmann::json;

/// The value of an optional key, if there is one.
template <class T>
T value_of(const json& object, const char* key, const std::string& source) {
    const auto found = object.find(key);
    if (found == object.end())
        fail("{}: what the run says about itself has no \"{}\"", source, key);
    try {
        return found->get<T>();
    } catch (const json::exception&) {
        fail("{}: \"{}\" of the run is {}, expected another type", source, key, found->dump());
    }
}

RunFiducial parse_fiducial(const json& object, const std::string& source) {
    RunFiducial fiducial{value_of<std::string>(object, "name", source),
                         value_of<double>(object, "residual_mm", source),
                         {}};
    if (object.contains("leave_one_out_mm") && !object["leave_one_out_mm"].is_null())
        fiducial.leave_one_out_mm = value_of<double>(object, "leave_one_out_mm", source);
    return fiducial;
}

RunCuts parse_cuts(const json& object, const std::string& source) {
    return {value_of<std::size_t>(object, "openings", source),
            value_of<std::size_t>(object, "parted", source),
            value_of<std::size_t>(object, "nodes_added", source),
            value_of<std::size_t>(object, "pieces", source),
            value_of<std::size_t>(object, "free_pieces", source),
            value_of<double>(object, "longest_ms", source),
            object.contains("prepared_ms") ? value_of<double>(object, "prepared_ms", source) : 0,
            object.contains("gaps") ? value_of<std::size_t>(object, "gaps", source) : 0,
            object.contains("gaps_mm") ? value_of<double>(object, "gaps_mm", source) : 0,
            object.contains("waits") && value_of<bool>(object, "waits", source)};
}

}  // namespace

RunInfo parse_run_info(const std::string& text, const std::string& source) {
    const json object = json::parse(text, nullptr, false);
    if (!object.is_object())
        fail("{}: what the run says about itself is not a JSON object", source);
    RunInfo info;
    info.samples = value_of<std::size_t>(object, "samples", source);
    info.frames = value_of<std::size_t>(object, "frames", source);
    info.missed = value_of<std::size_t>(object, "missed", source);
    info.budget_ms = value_of<double>(object, "budget_ms", source);
    info.interval_ms = object.contains("interval_ms")
                           ? value_of<double>(object, "interval_ms", source)
                           : info.budget_ms;
    info.mean_interval_ms = object.contains("mean_interval_ms")
                                ? value_of<double>(object, "mean_interval_ms", source)
                                : info.interval_ms;
    if (object.contains("budget_given"))
        info.budget_given = value_of<bool>(object, "budget_given", source);
    if (object.contains("poses")) info.poses = parse_pose_qualities(object["poses"], source);
    info.fre_mm = value_of<double>(object, "fre_mm", source);
    for (const json& f : value_of<std::vector<json>>(object, "fiducials", source))
        info.fiducials.push_back(parse_fiducial(f, source));
    info.tets = value_of<std::size_t>(object, "tets", source);
    info.nodes = value_of<std::size_t>(object, "nodes", source);
    info.levels = value_of<std::size_t>(object, "levels", source);
    if (object.contains("not_kept"))
        info.not_kept = value_of<std::size_t>(object, "not_kept", source);
    if (object.contains("problem")) info.problem = value_of<std::string>(object, "problem", source);
    if (object.contains("cuts")) info.cuts = parse_cuts(object["cuts"], source);
    if (object.contains("solver")) info.solver = value_of<std::string>(object, "solver", source);
    info.version = value_of<std::string>(object, "version", source);
    return info;
}

}  // namespace livetet
