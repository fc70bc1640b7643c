#include "apps/study/study_solve.hpp"

#include <algorithm>

#include "apps/scene/cuts.hpp"
#include "apps/scene/model_limits.hpp"
#include "apps/scene/probes.hpp"
#include "base/error.hpp"
#include "base/stopwatch.hpp"
#include "config/yaml.hpp"
#include "io/points_csv.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace livetet {

namespace {

void add_vector(StudyRow& row, const std::string& name, const char* unit, const Vector3& v) {
    for (int c = 0; c < 3; ++c)
        row.outputs.emplace_back(fmt::format("{}_{}_{}", name, "xyz"[c], unit), v[c]);
    row.outputs.emplace_back(fmt::format("{}_{}", name, unit), v.norm());
}

}  // namespace

std::vector<double> history_values(std::span<const StepRecord> steps) {
    std::vector<double> values;
    for (const StepRecord& s : steps)
        for (const double x : {s.time_s, s.step_s, s.report.converged ? 1.0 : 0.0,
                               static_cast<double>(s.report.newton_iterations),
                               static_cast<double>(s.report.iterations), s.report.imbalance})
            values.push_back(x);
    return values;
}

std::vector<double> step_seconds(std::span<const StepRecord> steps) {
    std::vector<double> seconds;
    for (const StepRecord& s : steps) seconds.push_back(s.report.seconds());
    return seconds;
}

std::vector<StepRecord> read_steps(const hdf5::File& file, const std::string& history,
                                   const std::string& seconds) {
    const auto rows = file.read<double>(history, history_columns.size());
    const auto times = file.read<double>(seconds, 1);
    if (rows.rows != times.rows)
        fail("{}: {} has {} rows and {} has {}, expected equally many", file.shown(), history,
             rows.rows, seconds, times.rows);
    std::vector<StepRecord> steps;
    for (std::size_t i = 0; i < rows.rows; ++i) {
        const double* x = rows.values.data() + i * history_columns.size();
        StepRecord& step = steps.emplace_back(StepRecord{x[0], x[1], {}});
        step.report.converged = x[2] != 0;
        step.report.newton_iterations = static_cast<int>(x[3]);
        step.report.iterations = static_cast<int>(x[4]);
        step.report.imbalance = x[5];
        step.report.solve_s = times.values[i];
    }
    return steps;
}

void StudySolver::take_mesh(const Scene& scene) {
    if (mesh_key_ == mesh_identity(scene)) return;
    mesh_key_.clear();
    mesh_ = load_mesh_for(group_, scene, {});
    mesh_key_ = mesh_identity(scene);
}

void StudySolver::run(const Scene& scene, StudyRow& row, const ProgressCallback& progress) {
    // 1. mesh, body
    const auto start = std::chrono::steady_clock::now();
    take_mesh(scene);
    row.mesh_s = seconds_since(start);
    std::optional<Probes> probes;
    auto [body, constraints, forces] = make_held_body(
        group_, scene, mesh_, [&](const TetMesh& finest, const DistributedHierarchy& levels) {
            if (scene.probes)
                probes.emplace(read_points_csv(scene.probes->points),
                               MeshPart(finest, levels.levels.front().share));
        });
    row.setup_s = seconds_since(start) - row.mesh_s;

    // 2. run
    const RunHistory history =
        run_scene(scene, *body.body, constraints, forces, {.progress = progress});
    row.converged = history.converged;
    row.failure = history.failure;
    row.steps = history.steps;
    for (const StepRecord& s : history.steps) {
        row.iterations += s.report.iterations;
        row.newton_iterations += s.report.newton_iterations;
        row.solve_s += s.report.seconds();
    }

    // 3. outputs
    const std::vector<Vector3> local = body.body->displacement();
    row.displacement = values_on_first(body.share(), local);
    double largest = 0;
    for (const Vector3& u : local) largest = std::max(largest, u.norm());
    MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, group_);
    row.outputs.emplace_back("largest_displacement_mm", 1e3 * largest);
    row.outputs.emplace_back("strain_energy_mJ", 1e3 * body.body->strain_energy());
    row.outputs.emplace_back("largest_von_mises_Pa", body.body->largest_von_mises());
    row.outputs.emplace_back(inverted_tets_output, static_cast<double>(body.body->inverted_tets()));
    row.outputs.emplace_back(
        beyond_model_output,
        static_cast<double>(beyond_model(scene, body.mesh(), local, &body.share()).size()));
    if (!scene.time.is_dynamic()) row.outputs.emplace_back("share_of_load", history.share);
    for (const auto& [key, force] : constraints.forces(body.body->reactions(), local))
        add_vector(row, key + "_force", "N", force);
    if (!probes) return;
    const std::vector<Vector3> at_probes = probes->sample(local);
    for (std::size_t i = 0; i < at_probes.size(); ++i)
        add_vector(row, probes->points()[i].name, "mm", 1e3 * at_probes[i]);
}

StudyRow StudySolver::solve(const Scene& scene, const ProgressCallback& progress) {
    int ranks = 1;
    MPI_Comm_size(group_, &ranks);
    StudyRow row;
    try {
        run(scene, row, progress);
    } catch (const Error& e) {  // thrown on every rank
        row.failure = e.what();
    } catch (const PetscFailure& e) {
        if (ranks > 1) throw;  // the other ranks wait for this one
        if (PetscSession::any_options() && e.may_be_an_option())
            throw;  // no solve of the study would succeed
        row.failure = e.what();
    }
    if (row.outputs.empty()) row.converged = false;
    return row;
}

}  // namespace livetet
