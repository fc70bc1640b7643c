#include <nlohmann/json.hpp>

#include "apps/report/report.hpp"

namespace livetet {

namespace {

using ordered_json = nlohmann::ordered_json;

ordered_json to_json(const Distribution& d) {
    return {{"count", d.count}, {"mean", d.mean}, {"rms", d.rms},    {"median", d.median},
            {"p95", d.p95},     {"p99", d.p99},   {"worst", d.worst}};
}

ordered_json frames_json(const Report& r) {
    const FrameStatistics& f = r.frames;
    ordered_json out = {{"samples", r.run.samples},
                        {"computed", r.run.frames},
                        {"kept", f.kept},
                        {"missed", r.run.missed},
                        {"not_kept", r.run.not_kept},
                        {"interval_ms", r.run.interval_ms},
                        {"mean_interval_ms", r.run.mean_interval_ms},
                        {"budget_ms", r.run.budget_ms},
                        {"budget_given", r.run.budget_given},
                        {"over_budget", f.over_budget},
                        {"cut_short", f.cut_short},
                        {"not_converged", f.not_converged},
                        {"turned_over", f.turned_over},
                        {"registration_held", f.registration_held},
                        {"registration_lost", f.registration_lost},
                        {"poses", json_of(r.run.poses)},
                        {"frame_ms", to_json(f.frame_ms)},
                        {"operator_ms", to_json(f.operator_ms)},
                        {"forces_ms", to_json(f.forces_ms)},
                        {"solve_ms", to_json(f.solve_ms)},
                        {"iterations", to_json(f.iterations)}};
    const auto add = [&](const char* name, const Distribution& d) {  // only what the run recorded
        if (d.count > 0) out[name] = to_json(d);
    };
    add("sensor_ms", f.sensor_ms);
    add("finish_ms", f.finish_ms);
    add("output_ms", f.output_ms);
    add("statement_ms", f.statement_ms);
    add("ahead_ms", f.ahead_ms);
    add("error_estimate_mm", f.error_estimate_mm);
    return out;
}

ordered_json registration_json(const Report& r) {
    ordered_json fiducials = ordered_json::array();
    for (const RunFiducial& f : r.run.fiducials) {
        ordered_json entry = {{"name", f.name}, {"residual_mm", f.residual_mm}};
        if (f.leave_one_out_mm) entry["leave_one_out_mm"] = *f.leave_one_out_mm;
        fiducials.push_back(std::move(entry));
    }
    return {{"fre_mm", r.run.fre_mm}, {"fiducials", fiducials}};
}

ordered_json sensors_json(const Report& r) {
    ordered_json tools = ordered_json::array(), frames = ordered_json::object();
    for (const ReportSensor& s : r.sensors) {
        ordered_json tool = {
            {"tool", s.tool}, {"patch_radius_mm", s.patch_radius_mm}, {"turns", s.turns}};
        if (s.stiffness_N_per_m) tool["stiffness_N_per_m"] = *s.stiffness_N_per_m;
        tools.push_back(std::move(tool));
    }
    if (r.sensor_frames)
        for (std::size_t s = 0; s < r.sensor_frames->size(); ++s)
            frames[sensor_states[s]] = (*r.sensor_frames)[s];
    return {{"tools", tools}, {"frames", frames}, {"unplaced", r.unplaced}, {"slips", r.slips}};
}

ordered_json truth_json(const TargetErrors& t) {
    ordered_json series = ordered_json::array();
    for (const TargetErrorSample& s : t.samples)
        series.push_back({{"time_s", s.time_s},
                          {"press_mm", s.press_mm},
                          {"rigid_mm", s.rigid_mm},
                          {"deforming_mm", s.deforming_mm}});
    const RestErrors& r = t.rest;
    return {{"targets", t.targets},
            {"moving_targets", t.moving},
            {"largest_motion_mm", t.largest_motion_mm},
            {"unregistered_frames", t.unregistered_frames},
            {"beyond_truth_frames", t.beyond_truth_frames},
            {"ahead_ms", to_json(t.ahead_ms)},
            {"deepest_press",
             {{"press_mm", t.deepest_press_mm},
              {"frames", t.deepest_frames},
              {"rigid_mm", to_json(t.rigid_mm)},
              {"deforming_mm", to_json(t.deforming_mm)},
              {"registration_mm", to_json(t.registration_mm)},
              {"deformation_mm", to_json(t.deformation_mm)},
              {"times_smaller", t.gain()},
              {"times_smaller_wanted", wanted_gain}}},
            {"at_rest",
             {{"frames", r.frames},
              {"organ_travel_mm", r.organ_travel_mm},
              {"organ_turn_deg", r.organ_turn_deg},
              {"moved_mm", to_json(r.moved_mm)},
              {"registration_mm", to_json(r.registration_mm)},
              {"registration_lag_ms", r.registration_lag_ms},
              {"expected_rms_mm", r.expected_rms_mm},
              {"explained_by_noise", r.explained()}}},
            {"series", series}};
}

ordered_json stated_json(const StatedErrors& stated) {
    ordered_json missing = ordered_json::object(), targets = ordered_json::array();
    for (std::size_t q = 0; q < error_source_count; ++q)
        if (stated.missing[q] > 0)
            missing[name_of(static_cast<ErrorSource>(q))] = stated.missing[q];
    for (const StatedTarget& t : stated.targets) {
        ordered_json sources = ordered_json::object();
        for (std::size_t q = 0; q < error_source_count; ++q)
            if (t.rms_by_source_mm[q])
                sources[name_of(static_cast<ErrorSource>(q))] = *t.rms_by_source_mm[q];
        ordered_json target = {{"name", t.name},
                               {"radius_95_mm", to_json(t.radius_95_mm)},
                               {"rms_by_source_mm", sources}};
        if (t.truth) {
            target["truth"] = {{"frames", t.truth->frames},
                               {"within", t.truth->within},
                               {"coverage", t.truth->coverage()},
                               {"median_radius_mm", t.truth->median_radius_mm},
                               {"median_error_mm", t.truth->median_error_mm}};
            if (const auto ratio = t.truth->radius_per_error())
                target["truth"]["radius_per_error"] = *ratio;
        }
        targets.push_back(std::move(target));
    }
    return {{"frames", stated.frames},
            {"incomplete_frames", stated.incomplete},
            {"missing_frames", missing},
            {"targets", targets}};
}

}  // namespace

std::string report_json(const Report& r) {
    ordered_json out = {{"result", r.source},
                        {"version", r.run.version},
                        {"problem", r.run.problem},
                        {"verdicts", verdicts(r)},
                        {"mesh",
                         {{"tets", r.run.tets},
                          {"elements", r.elements},
                          {"nodes", r.run.nodes},
                          {"levels", r.run.levels}}},
                        {"solver", r.run.solver},
                        {"first_s", r.first_s},
                        {"last_s", r.last_s},
                        {"largest_press_mm", r.largest_press_mm},
                        {"registration", registration_json(r)},
                        {"frames", frames_json(r)},
                        {"sensors", sensors_json(r)},
                        {"parts", parts_json(r.parts)}};
    if (const auto& cuts = r.run.cuts)
        out["cuts"] = {{"openings", cuts->openings},       {"parted", cuts->parted},
                       {"nodes_added", cuts->nodes_added}, {"pieces", cuts->pieces},
                       {"free_pieces", cuts->free_pieces}, {"longest_ms", cuts->longest_ms},
                       {"prepared_ms", cuts->prepared_ms}, {"gaps", cuts->gaps},
                       {"gaps_mm", cuts->gaps_mm},         {"waits", cuts->waits}};
    if (r.truth) out["targets"] = truth_json(*r.truth);
    if (r.stated) out["stated_error"] = stated_json(*r.stated);
    return json_text(out);
}

}  // namespace livetet
