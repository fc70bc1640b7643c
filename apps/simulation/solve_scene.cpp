#include "apps/simulation/solve_scene.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "apps/scene/model_limits.hpp"
#include "apps/scene/probes.hpp"
#include "apps/scene/rank_memory.hpp"
#include "base/counted.hpp"
#include "base/file.hpp"
#include "base/log.hpp"
#include "base/stopwatch.hpp"
#include "io/points_csv.hpp"
#include "solvers/parallel/log_stage.hpp"

namespace livetet {

namespace {

/// Of the vectors of all ranks. Collective.
double largest_norm(const std::vector<Vector3>& values) {
    double largest = 0;
    for (const Vector3& v : values) largest = std::max(largest, v.norm());
    MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
    return largest;
}

bool is_first_of_world() {
    int rank = 0;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    return rank == 0;
}

/// Says that a mesh is too small for its ranks: they wait for each other longer than they work.
void warn_of_small_parts(std::size_t tets, int ranks) {
    const std::size_t useful = std::max<std::size_t>(1, tets / worthwhile_tets_a_rank);
    if (static_cast<std::size_t>(ranks) > useful)
        log_warning(fmt::format(
            "{} tets on {} ranks: found {} tets a rank, expected {} or more: "
            "{} would be as fast",
            tets, ranks, tets / ranks, worthwhile_tets_a_rank, counted(useful, "rank")));
}

}  // namespace

SolvedScene solve_scene(const Scene& scene, const SolveRequest& request) {
    const bool first = is_first_of_world();
    if (first && scene.probes) expect_writable(scene.probes->displacements);
    if (const auto note = locking_note(scene); note && first) log_warning(*note);

    // 1. mesh, body
    SolvedScene solved;
    RunFigures& figures = solved.figures;
    MPI_Comm_size(PETSC_COMM_WORLD, &figures.ranks);
    const auto start = std::chrono::steady_clock::now();
    std::optional<LogStage> stage(std::in_place, "Livetet mesh");
    SceneMesh mesh = load_mesh_for(PETSC_COMM_WORLD, scene, request.progress);
    figures.mesh_s = seconds_since(start);
    stage.emplace("Livetet set-up");
    std::optional<Probes> probes;
    std::optional<StateKeeper> states;
    TetMesh whole;
    if (request.whole && figures.ranks > 1) whole = finest_mesh(PETSC_COMM_WORLD, scene);
    auto [scene_body, constraints, forces] = make_held_body(
        PETSC_COMM_WORLD, scene, std::move(mesh),
        [&](const TetMesh& finest, const DistributedHierarchy& levels) {
            const PartitionedMesh& share = levels.levels.front().share;
            if (scene.probes)
                probes.emplace(read_points_csv(scene.probes->points), MeshPart(finest, share));
            states.emplace(scene, levels.tets, finest, share, request.start);
        });
    if (first && probes) warn_of_points_outside(probes->points(), probes->distances());
    SceneBody& body = solved.body = std::move(scene_body);
    figures.setup_s = seconds_since(start) - figures.mesh_s;
    if (first) warn_of_small_parts(body.tet_count(), figures.ranks);

    // 2. steps
    stage.emplace("Livetet steps");
    RunHooks hooks = states->hooks(*body.body, request.progress);
    hooks.iterated = request.iterated;
    solved.history = run_scene(scene, *body.body, constraints, forces, hooks);
    solved.displacement = states->take_displacement();
    solved.frames = states->frames();
    figures.forces = constraints.forces(body.body->reactions(), solved.displacement);
    figures.inverted_tets = body.body->inverted_tets();
    figures.largest_displacement_m = largest_norm(solved.displacement);
    figures.beyond_model = beyond_model(scene, body.mesh(), solved.displacement, &body.share());
    figures.sum = sum_of(solved.history);
    if (request.profile)
        figures.profile =
            solve_profile(PETSC_COMM_WORLD, scene, body, figures.mesh_s,
                          {0, states->output_s(), static_cast<long>(states->frames())});

    // 3. results
    stage.emplace("Livetet results");
    nlohmann::json about = describe_run(scene, body, solved.history, figures, states->start_s());
    states->close(about.dump());
    about["output_s"] = states->output_s();
    solved.description = about.dump(2);
    const bool has_probes = probes && solved.frames > 0;
    std::vector<Vector3> at_probes;
    if (has_probes) at_probes = probes->sample(solved.displacement);
    if (!whole.nodes.empty()) {
        solved.displacement = whole_values(body.share(), solved.displacement);
        body.hierarchy.levels.front() = std::move(whole);
    }
    if (!first) return solved;
    states->remove_checkpoints();
    if (has_probes)
        write_displacements_csv(scene.probes->displacements, probes->points(), at_probes);
    return solved;
}

}  // namespace livetet
