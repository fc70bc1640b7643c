#include "apps/simulation/solve_profile.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace livetet {

std::vector<ProfileRow> solve_profile(MPI_Comm comm, const Scene& scene,
                                      const SceneBody& scene_body, double mesh_s,
                                      const PhaseCost& output) {
    const BodyCosts c = scene_body.body->costs();
    const bool is_static = !scene.time.is_dynamic();
    const bool is_mixed = scene_body.body->linear_solver().is_mixed();
    const bool has_levels = scene_body.body->linear_solver().level_count() > 1;
    std::vector<ProfileRow> rows{
        {"mesh", {0, mesh_s, 1}, true, ""},
        {"partition", {0, scene_body.partition_s, 1}, scene_body.partition_s > 0, "one rank"},
        {"elements", c.solver.elements, true, ""},
        {"forces", c.forces, true, ""},
        {"rotations", c.solver.rotations, has_corotated(scene.materials, scene.strain),
         "no material is corotated"},
        {"pressures", c.solver.pressures, is_mixed, "the formulation is by displacements"},
        {"mass", c.solver.mass, !is_static, "time.scheme: static"},
        {"velocities", c.velocities, !is_static, "time.scheme: static"},
        {"coarse levels", c.solver.coarse_levels, has_levels, "the solver has no levels"},
        {"operators", c.solver.matrix, true, ""},
        {"preconditioner", c.solver.preconditioner, true, ""},
        {"linear solves", c.linear_solves, true, ""},
        {"output", output, true, ""},
    };
    for (ProfileRow& row : rows) {
        MPI_Allreduce(MPI_IN_PLACE, &row.cost.bytes, 1, MPI_DOUBLE, MPI_SUM, comm);
        MPI_Allreduce(MPI_IN_PLACE, &row.cost.seconds, 1, MPI_DOUBLE, MPI_MAX, comm);
    }
    return rows;
}

std::string profile_table(std::span<const ProfileRow> rows) {
    std::string text =
        fmt::format("\n{:<16} {:>9} {:>9} {:>10}\n", "part", "MB", "times", "seconds");
    for (const ProfileRow& row : rows) {
        if (!row.is_built) {
            text += fmt::format("{:<16} left out: {}\n", row.part, row.why);
            continue;
        }
        text += fmt::format("{:<16} {:>9} {:>9} {:>10}\n", row.part,
                            row.cost.bytes > 0 ? fmt::format("{:.2f}", row.cost.bytes / 1e6) : "",
                            row.cost.times > 0 ? fmt::format("{}", row.cost.times) : "",
                            row.cost.seconds > 0 ? fmt::format("{:.4f}", row.cost.seconds) : "");
    }
    return text +
           "MB of the heap that its set-up took; operators: the time of all levels, renewed "
           "together; linear solves: iterations\n";
}

nlohmann::json json_of(std::span<const ProfileRow> rows) {
    nlohmann::json list = nlohmann::json::array();
    for (const ProfileRow& row : rows)
        list.push_back({{"part", row.part},
                        {"built", row.is_built},
                        {"bytes", row.cost.bytes},
                        {"seconds", row.cost.seconds},
                        {"times", row.cost.times}});
    return list;
}

}  // namespace livetet
