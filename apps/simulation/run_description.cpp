#include "apps/simulation/run_description.hpp"

#include <nlohmann/json.hpp>

#include "apps/simulation/rank_usage.hpp"

namespace livetet {

using nlohmann::json;

namespace {

json history_json(const RunHistory& history) {
    json steps = json::array();
    for (const StepRecord& s : history.steps)
        steps.push_back({{"time_s", s.time_s},
                         {"step_s", s.step_s},
                         {"converged", s.report.converged},
                         {"kept", s.kept},
                         {"linearisations", s.report.newton_iterations},
                         {"iterations", s.report.iterations},
                         {"imbalance", s.report.imbalance},
                         {"time_error_mm", 1e3 * s.report.time_error},
                         {"seconds", s.report.seconds()}});
    return steps;
}

}  // namespace

StepReport sum_of(const RunHistory& history) {
    StepReport sum;
    for (const StepRecord& step : history.steps) {
        const StepReport& r = step.report;
        sum.iterations += r.iterations;
        sum.newton_iterations += r.newton_iterations;
        sum.forces_s += r.forces_s + r.finish_s;
        sum.operator_s += r.operator_s;
        sum.preconditioner_s += r.preconditioner_s;
        sum.solve_s += r.solve_s;
    }
    return sum;
}

json describe_run(const Scene& scene, const SceneBody& body, const RunHistory& history,
                  const RunFigures& figures, double start_s) {
    const RankUsage usage = usage_of_ranks(PETSC_COMM_WORLD);
    const StepReport& sum = figures.sum;
    json about{{"tets", body.tet_count()},
               {"nodes", body.node_count()},
               {"levels", body.hierarchy.levels.size()},
               {"ranks", figures.ranks},
               {"version", LIVETET_VERSION},
               {"largest_displacement_mm", 1e3 * figures.largest_displacement_m},
               {"converged", history.converged},
               {"failure", history.failure},
               {"inverted_tets", figures.inverted_tets},
               {"beyond_model", figures.beyond_model},
               {"share", history.share},
               {"is_static", !scene.time.is_dynamic()},
               {"restarted_at_s", start_s},
               {"reactions_N", json::object()},
               {"iterations", sum.iterations},
               {"linearisations", sum.newton_iterations},
               {"mesh_s", figures.mesh_s},
               {"partition_s", body.partition_s},
               {"setup_s", figures.setup_s},
               {"solve_s", sum.seconds()},
               {"forces_s", sum.forces_s},
               {"assembly_s", sum.operator_s},
               {"preconditioner_s", sum.preconditioner_s},
               {"linear_s", sum.solve_s},
               {"solver", body.body->linear_solver().name()},
               {"peak_bytes", usage.peak_bytes},
               {"peak_bytes_most", usage.max_peak_bytes},
               {"messages", usage.messages},
               {"message_bytes", usage.message_bytes},
               {"reductions", usage.reductions},
               {"profile", json_of(figures.profile)},
               {"steps", history_json(history)}};
    if (const TetMesh& mesh = body.mesh(); mesh.has_hexahedra()) {
        about["hexahedra"] = mesh.tets.size() / mesh.tets_per_element();
        about["levels"] = body.body->linear_solver().level_count();
    }
    for (const auto& [key, force] : figures.forces)
        about["reactions_N"][key] = {force.x(), force.y(), force.z()};
    return about;
}

}  // namespace livetet
