#include "apps/bench/convergence_solves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/bench/beam_mesh.hpp"
#include "apps/bench/solve_run.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "io/hierarchy_file.hpp"
#include "mesh/refine.hpp"
#ifdef LIVETET_IMAGES
#include "apps/bench/convergence_bodies.hpp"
#endif

namespace livetet {

namespace {

namespace fs = std::filesystem;

constexpr double tolerance = 1e-8;
constexpr int max_iterations = 2000;

using Solve = std::pair<ConvergenceSetting, SolveMethod>;

std::string name_of(const ConvergenceSetting& s, const SolveMethod& m) {
    return s.against + (s.body.empty() ? "" : " " + s.body) + ", " + m.name;
}

#ifdef LIVETET_IMAGES
/// Those that solve bodies.
const std::vector<SolveMethod>& body_methods() {
    static const std::vector<SolveMethod> all{
        convergence_methods()[0],
        convergence_methods()[1],
        {automatic_with_levels, "kind: automatic", 1e9},
        {"BoomerAMG", "kind: boomeramg", 1e9, true},
        {"GAMG", "kind: gamg", 1e9, true},
        {"direct", "kind: direct", 1e9, true},
        {automatic_on_one_level, "kind: automatic", 1e9, true},
    };
    return all;
}
#endif

/// Edge length of a beam's mesh with about this number of nodes; the power is fitted to meshes from
/// 10^3 to 10^6 nodes.
double edge_for(double nodes) {
    return std::cbrt(4.955 * 0.002 / (5.75 * nodes)) /
           std::cbrt(0.877 * std::pow(nodes / 1000, 0.062));
}

/// Meshes of rising size, solved by every method that is quick enough on them.
void add_sizes(const ConvergenceArguments& a, std::vector<Solve>& all) {
    for (double nodes = a.min_nodes; nodes < 1.01 * a.max_nodes; nodes *= std::sqrt(10)) {
        for (const SolveMethod& m : convergence_methods()) {
            if (nodes > m.max_nodes) continue;
            const int cuts = m.name.ends_with("nested") ? (nodes > 3e4 ? 2 : 1)
                             : nodes > max_meshed_nodes ? 1
                                                        : 0;
            all.emplace_back(ConvergenceSetting{.against = "nodes",
                                                .value = std::round(nodes),
                                                .edge_m = std::pow(2, cuts) * edge_for(nodes),
                                                .refine = cuts},
                             m);
        }
    }
}

}  // namespace

const std::vector<SolveMethod>& convergence_methods() {
    static const std::vector<SolveMethod> all{
        {"multigrid", "kind: multigrid, coarse: rediscretised", 1e9},
        {"multigrid, Galerkin", "kind: multigrid, coarse: galerkin", 5e5},
        {"multigrid, nested", "kind: multigrid, coarse: rediscretised", 1e9},
        {"BoomerAMG", "kind: boomeramg", 2.5e5},
        {"GAMG", "kind: gamg", 2.5e5},
        {"ICC", "kind: petsc, petsc_options: -ksp_type cg -pc_type icc", 2.5e5},
        {"Jacobi", "kind: petsc, petsc_options: -ksp_type cg -pc_type jacobi", 5e4},
    };
    return all;
}

std::string ConvergenceSetting::value_text() const {
    return body.empty() ? fmt::format("{}", value) : body;
}

double ConvergencePoint::factor() const {
    return std::pow(tolerance, 1 / std::max(1.0, iterations));
}

std::vector<Solve> convergence_solves(const ConvergenceArguments& a) {
    std::vector<Solve> all;
    add_sizes(a, all);
    const auto vary = [&](const std::string& against, std::initializer_list<double> values,
                          std::initializer_list<std::size_t> of_methods, auto&& set) {
        for (const double value : values)
            for (const std::size_t m : of_methods) {
                ConvergenceSetting s{
                    .against = against, .value = value, .edge_m = edge_for(a.nodes)};
                set(s, value);
                all.emplace_back(s, convergence_methods()[m]);
            }
    };
    const std::initializer_list<std::size_t> multilevel{0, 1, 3, 4}, ours{0, 1};
    vary("nu", {0, 0.3, 0.45, 0.49, 0.499}, multilevel,
         [](ConvergenceSetting& s, double v) { s.poisson = v; });
    vary("contrast", {1, 1e2, 1e4, 1e6}, multilevel,
         [](ConvergenceSetting& s, double v) { s.contrast = v; });
    vary("anisotropy", {1, 0.3, 0.1, 0.03}, multilevel,
         [](ConvergenceSetting& s, double v) { s.stretch = v; });
    vary("levels", {2, 3, 4}, ours,
         [](ConvergenceSetting& s, double v) { s.levels = static_cast<int>(v); });
    vary("smoothing", {1, 2, 4, 6, 8}, ours,
         [](ConvergenceSetting& s, double v) { s.smoothing = static_cast<int>(v); });
#ifdef LIVETET_IMAGES
    for (const ConvergenceBody& body : convergence_bodies())
        for (const SolveMethod& m : body_methods())
            all.emplace_back(ConvergenceSetting{.against = "body", .body = body.name}, m);
#endif
    std::erase_if(all, [&](const Solve& solve) {
        return name_of(solve.first, solve.second).find(a.only) == std::string::npos;
    });
    if (all.empty()) fail("--only {}: no solve has this in its name", a.only);
    if (!a.figure.empty() && std::none_of(all.begin(), all.end(), [](const Solve& solve) {
            return solve.first.against == "nodes";
        }))
        fail("--only {}: leaves nothing for --figure, which shows solves against nodes", a.only);
    return all;
}

ConvergencePoint ConvergenceScenes::solve(const ConvergenceSetting& s, const SolveMethod& method) {
    ConvergencePoint point{s, method.name, "", 0, 0, 0};
    try {
        const fs::path scene = folder_ / fmt::format("{}.yaml", ++count_);
        write_text_file(scene,
                        fmt::format("{}strain: linear\nformulation: displacement\n"
                                    "solver: {{{}, smoothing_steps: {}, relative_tolerance: {}, "
                                    "max_iterations: {}, newton_tolerance: 0.5, max_newton: 1}}\n"
                                    "output: {{file: result.h5}}\n",
                                    s.body.empty() ? beam(s) : body(s, method), method.solver,
                                    s.smoothing, tolerance, max_iterations));
        const SolveRun run = run_solve(method.name, "", 1, scene);
        point.nodes = run.unknowns / 3;
        point.iterations = run.iterations_a_solve();
        point.seconds = run.assembly_s + run.preconditioner_s + run.linear_s;
        if (point.iterations >= max_iterations)
            point.failure = fmt::format("not in {} iterations", max_iterations);
        else if (!run.converged)
            point.failure = "did not converge";
    } catch (const Error& error) {
        point.failure = error.what();
    }
    return point;
}

std::string ConvergenceScenes::beam(const ConvergenceSetting& s) {
    const double top = 1e3 * 0.1 * s.stretch;
    return fmt::format(
        "mesh: {{file: {}, refine: {}}}\n"
        "materials: [{{region: 1, young_Pa: 5000, poisson: {}}}, {{region: 2, young_Pa: {}, "
        "poisson: {}}}]\n"
        "fix: [{{half_space_mm: [0.001, 0, 0, 1, 0, 0]}}]\n"
        "drive: [{{box_mm: [83.5, 33.5, {}, 116.5, 66.5, {}], displacement_mm: [0, 0, -1]}}]\n",
        mesh_of(s), s.refine, s.poisson, 5000 * s.contrast, s.poisson, top - 0.001, top + 0.001);
}

std::string ConvergenceScenes::body([[maybe_unused]] const ConvergenceSetting& s,
                                    [[maybe_unused]] const SolveMethod& m) {
#ifdef LIVETET_IMAGES
    const auto& all = convergence_bodies();
    const auto& body =
        *std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.name == s.body; });
    std::string name = s.body;
    std::replace(name.begin(), name.end(), ' ', '_');
    const std::string finest = name + "_finest.h5";
    name += ".h5";
    if (!fs::exists(folder_ / finest)) {
        MeshHierarchy hierarchy = mesh_body(body, nodes_);
        write_hierarchy(folder_ / name, hierarchy);
        hierarchy.levels.resize(1);
        write_hierarchy(folder_ / finest, make_hierarchy(std::move(hierarchy.levels), s.body));
    }
    return fmt::format("mesh: {{file: {}}}\nmaterials: [{{young_Pa: 5000, poisson: {}}}]\n{}",
                       m.one_level ? finest : name, s.poisson, body.boundary);
#else
    return {};
#endif
}

std::string ConvergenceScenes::mesh_of(const ConvergenceSetting& s) {
    const std::string name = fmt::format("{:.6f}_{}_{}.h5", s.edge_m, s.stretch, s.levels);
    if (fs::exists(folder_ / name)) return name;
    MeshHierarchy hierarchy = mesh_beam(s.edge_m, {});
    if (s.levels > 0 && hierarchy.levels.size() > static_cast<std::size_t>(s.levels))
        hierarchy.levels.resize(s.levels);
    for (TetMesh& level : hierarchy.levels) {
        for (const Tet& t : level.tets) {
            double z = 0;
            for (const std::int32_t n : t) z += level.nodes[n].z() / 4;
            level.regions.push_back(z < 0.05 ? 1 : 2);
        }
        for (Vector3& x : level.nodes) x.z() *= s.stretch;
    }
    write_hierarchy(folder_ / name, make_hierarchy(std::move(hierarchy.levels), "beam"));
    return name;
}

}  // namespace livetet
