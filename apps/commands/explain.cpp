#include <fmt/format.h>

#include "apps/commands/commands.hpp"
#include "apps/scene/body_factory.hpp"
#include "apps/scene/explanation.hpp"
#include "apps/scene/live_element.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

namespace {

/// Number of 3x3 blocks in the operator of a mesh: one for each node and two for each edge.
std::size_t block_count(const TetMesh& mesh) {
    std::vector<std::pair<std::int32_t, std::int32_t>> edges;
    for (const Tet& t : mesh.tets)
        for (int i = 0; i < 4; ++i)
            for (int j = i + 1; j < 4; ++j) edges.push_back(std::minmax(t[i], t[j]));
    std::sort(edges.begin(), edges.end());
    const auto unique = std::unique(edges.begin(), edges.end()) - edges.begin();
    return 2 * static_cast<std::size_t>(unique) + mesh.nodes.size();
}

void explain_levels(const MeshHierarchy& hierarchy, bool multigrid) {
    fmt::print("\n{:<8} {:>9} {:>9} {:>11} {:>12}\n", "level", "tets", "nodes", "unknowns",
               "memory/MB");
    for (std::size_t l = 0; l < (multigrid ? hierarchy.levels.size() : 1); ++l) {
        const TetMesh& mesh = hierarchy.levels[l];
        const bool linear = mesh.edge_nodes.empty();
        const double blocks = linear ? block_count(mesh) : 28.0 * mesh.nodes.size();
        // A block with its column; for each tet its gradients, rotations, nodes and block indices;
        // for each node its vectors, constraints and row of a transfer.
        const double bytes =
            76.0 * blocks + (linear ? 228.0 : 470.0) * mesh.tets.size() + 600.0 * mesh.nodes.size();
        fmt::print("{:<8} {:>9} {:>9} {:>11} {:>12.1f}\n", l, mesh.tets.size(), mesh.nodes.size(),
                   3 * mesh.nodes.size(), bytes / 1e6);
    }
}

void explain(const std::filesystem::path& path) {
    const Scene scene = load_scene(path);
    ProgressLine progress("mesh");
    MeshHierarchy hierarchy = load_mesh(scene, progress.callback());
    refuse_hexahedra(hierarchy, "explain");
    if (scene.elements == Elements::p2) hierarchy = with_quadratic_level(std::move(hierarchy));
    const SolverKind kind = resolved_kind(solver_options(scene, hierarchy, use_of(scene)).kind,
                                          hierarchy.levels.size());
    const bool multigrid = kind == SolverKind::multigrid || kind == SolverKind::live;
    const std::size_t tets = hierarchy.levels.front().tets.size();

    std::vector<ExplainedPart> parts = explain_parts(scene, tets, hierarchy.levels.size(), kind);
    if (scene.track) parts.push_back(explain_live(scene, hierarchy));
    for (const ExplainedPart& p : parts)
        fmt::print("{:<11} {:<22} {}\n", p.built ? "builds" : "leaves out", p.part, p.why);
    explain_levels(hierarchy, multigrid);
    if (scene.track) fmt::print("\n{}", describe_live_element(scene, tets));
    const int iterations = scene.solver.relative_tolerance > 1e-4 ? 7 : 15;
    fmt::print(
        "\nEach Newton iteration, with about {} Krylov iterations to {:.0e}: {:.0f} ms (measured "
        "on one core "
        "of a 2.4 GHz EPYC; "
        "yours will differ)\n",
        multigrid ? fmt::format("{}", iterations) : "an unknown number of",
        scene.solver.relative_tolerance, (1.5e-4 + 6e-5 * iterations) * tets);
}

}  // namespace

void add_explain_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand("explain",
                                           "Explains what a scene builds, what it leaves out and "
                                           "why, and the memory and time it needs");
    auto scene = std::make_shared<std::filesystem::path>();
    command->add_option("scene", *scene, "scene file (YAML)")->required();
    command->callback([scene] { explain(*scene); });
}

}  // namespace livetet
