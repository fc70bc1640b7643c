#include <fmt/format.h>

#include "apps/commands/commands.hpp"
#include "apps/scene/body_factory.hpp"
#include "apps/scene/explanation.hpp"
#include "apps/scene/live_element.hpp"
#include "apps/scene/rank_memory.hpp"
#include "mesh/quadratic.hpp"
#include "solvers/linear/multigrid_solver.hpp"

namespace livetet {

namespace {

/// `has_matrix`: whether the finest level's operator is one.
std::vector<LevelSize> explain_levels(const MeshHierarchy& hierarchy, bool multigrid,
                                      bool has_matrix) {
    std::vector<LevelSize> sizes;
    fmt::print("\n{:<8} {:>9} {:>9} {:>11} {:>12}\n", "level", "tets", "nodes", "unknowns",
               "memory/MB");
    for (std::size_t l = 0; l < (multigrid ? hierarchy.levels.size() : 1); ++l) {
        const LevelSize& size =
            sizes.emplace_back(size_of_level(hierarchy.levels[l], l > 0 || has_matrix));
        fmt::print("{:<8} {:>9} {:>9} {:>11} {:>12.1f}\n", l, size.tets, size.nodes, 3 * size.nodes,
                   size.bytes / 1e6);
    }
    return sizes;
}

/// What bounds a solve on so many ranks, in words.
std::string bound_of(const RankMemory& memory, std::size_t tets, int ranks) {
    const auto of_each = tets / static_cast<std::size_t>(ranks);
    if (ranks > 1 && of_each < worthwhile_tets_a_rank)
        return fmt::format("more ranks than pay: they wait for each other below {} tets each",
                           worthwhile_tets_a_rank);
    if (memory.whole > memory.own) return "METIS, on the first rank";
    return memory.program > memory.own ? "the program itself" : "its own share";
}

/// `of_ranks`: levels that several ranks make from their own parts; `tets_of_metis`: see
/// memory_of_rank.
void explain_ranks(const std::vector<LevelSize>& levels, std::span<const int> ranks, int of_ranks,
                   std::size_t tets_of_metis) {
    fmt::print("\n{:<8} {:>9} {:>9} | {:>9} {:>9} {:>9}   {}\n", "ranks", "tets each", "MB each",
               "own", "mesh", "program", "bound by");
    for (const int n : ranks) {
        const RankMemory memory = memory_of_rank(levels, n, of_ranks, tets_of_metis);
        const std::size_t tets = levels.front().tets;
        fmt::print("{:<8} {:>9} {:>9.0f} | {:>9.0f} {:>9.0f} {:>9.0f}   {}\n", n,
                   tets / static_cast<std::size_t>(n), memory.sum() / 1e6, memory.own / 1e6,
                   memory.whole / 1e6, memory.program / 1e6, bound_of(memory, tets, n));
    }
}

void explain(const std::filesystem::path& path, std::span<const int> ranks) {
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
    const bool has_matrix =
        kind == SolverKind::live ||
        !(multigrid && MultigridSolver::finest_is_matrix_free(elastic_model(scene), scene.solver));
    const std::vector<LevelSize> levels = explain_levels(hierarchy, multigrid, has_matrix);
    if (!ranks.empty()) {
        const int of_ranks = scene.mesh.refine + (scene.elements == Elements::p2 ? 1 : 0);
        const std::size_t of_file =
            hierarchy.levels[static_cast<std::size_t>(of_ranks)].tets.size();
        const bool by_metis =
            resolved_partitioner(scene.solver.partitioner, of_file) == Partitioner::metis;
        explain_ranks(levels, ranks, of_ranks, by_metis ? of_file : 0);
    }
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
    auto ranks = std::make_shared<std::vector<int>>();
    command
        ->add_option("--ranks", *ranks,
                     "also estimate the memory of a rank, and what bounds it, on these numbers of "
                     "ranks: 1,8,64")
        ->delimiter(',')
        ->check(CLI::Range(1, 1'000'000));
    command->callback([scene, ranks] { explain(*scene, *ranks); });
}

}  // namespace livetet
