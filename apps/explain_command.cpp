#include <fmt/format.h>

#include "apps/commands.hpp"
#include "apps/scene_body.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

namespace {

/// What a scene builds and leaves out, a line each.
class Explanation {
  public:
    void uses(std::string_view part, const std::string& why) { row("builds", part, why); }
    void leaves_out(std::string_view part, const std::string& why) { row("leaves out", part, why); }

  private:
    static void row(std::string_view verdict, std::string_view part, const std::string& why) {
        fmt::print("{:<11} {:<22} {}\n", verdict, part, why);
    }
};

/// Blocks of 3x3 in the operator of a mesh: a node couples with itself and along each edge.
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
    fmt::print("\n{:<8} {:>9} {:>9} {:>11} {:>12}\n", "level", "tets", "nodes", "unknowns", "memory/MB");
    for (std::size_t l = 0; l < (multigrid ? hierarchy.levels.size() : 1); ++l) {
        const TetMesh& mesh = hierarchy.levels[l];
        const double blocks = mesh.edge_nodes.empty() ? block_count(mesh) : 28.0 * mesh.nodes.size();
        const double bytes = 76.0 * blocks + (sizeof(TetElement) + 104 + 72 + 192 + 20) * mesh.tets.size() +
                             400.0 * mesh.nodes.size();
        fmt::print("{:<8} {:>9} {:>9} {:>11} {:>12.1f}\n", l, mesh.tets.size(), mesh.nodes.size(),
                   3 * mesh.nodes.size(), bytes / 1e6);
    }
}

void explain(const std::filesystem::path& path) {
    const Scene scene = load_scene(path);
    ProgressLine progress("mesh");
    MeshHierarchy hierarchy = load_mesh(scene.mesh, progress.callback());
    if (scene.elements == Elements::p2) hierarchy = with_quadratic_level(std::move(hierarchy));
    const bool is_static = scene.time.scheme == TimeScheme::static_equilibrium;
    const SolverKind kind = resolved_kind(
        solver_options(scene, hierarchy, scene.track.has_value()).kind, hierarchy.levels.size());
    const bool multigrid = kind == SolverKind::multigrid || kind == SolverKind::live;
    const std::size_t tets = hierarchy.levels.front().tets.size();

    Explanation e;
    constexpr const char* strains[] = {"small strain", "corotated", "Green's strain", "neo-Hookean"};
    e.uses("elements", fmt::format("{} tetrahedra of {} nodes, {}", tets, scene.elements == Elements::p2 ? 10 : 4,
                                   strains[static_cast<int>(scene.strain)]));
    if (resolved_formulation(elastic_model(scene, scene.track.has_value())) == Formulation::mixed)
        e.uses("pressures", "one at each corner, FGMRES around the preconditioner of the displacements");
    else
        e.leaves_out("pressures", scene.track ? "`track`" : "formulation: displacement, or no poisson >= 0.49");
    if (scene.strain != StrainModel::corotated)
        e.leaves_out("rotations", "strain is not corotated");
    else
        e.uses("rotations", fmt::format("one for each quadrature point, each linearisation: about {:.0f} ms",
                                     (scene.elements == Elements::p2 ? 1e-3 : 2.5e-5) * tets));
    if (scene.strain == StrainModel::linear)
        e.uses("one operator", "small strain: kept, with what it was factored to, while the step, constraints and springs are the same");
    if (is_static)
        e.leaves_out("mass, velocities", "time.scheme: static");
    else
        e.uses("mass, velocities", fmt::format("lumped mass; time.scheme, step {} s", scene.time.step_s));
    if (is_static || (scene.time.rayleigh_alpha == 0 && scene.time.rayleigh_beta == 0))
        e.leaves_out("damping", is_static ? "time.scheme: static" : "rayleigh_alpha and rayleigh_beta are 0");
    else
        e.uses("damping",
               fmt::format("Rayleigh, alpha {} 1/s, beta {} s", scene.time.rayleigh_alpha, scene.time.rayleigh_beta));
    if (scene.gravity_m_per_s2 == Vector3::Zero() && scene.loads.empty())
        e.leaves_out("forces", "no gravity, no loads");
    else
        e.uses("forces", fmt::format("{}{} load(s)", scene.gravity_m_per_s2 == Vector3::Zero() ? "" : "gravity, ",
                                     scene.loads.size()));
    if (multigrid)
        e.uses("coarse levels",
               fmt::format("{} of them, {}", hierarchy.levels.size() - 1,
                           scene.solver.coarse == CoarseOperator::galerkin ? "P^T A P each linearisation"
                                                                           : "assembled with their own rotations"));
    else
        e.leaves_out("coarse levels",
                     hierarchy.levels.size() > 1 ? "solver.kind is not multigrid" : "the mesh has one level");
    if (scene.track) {
        e.uses("tracker", fmt::format("`track` only: {} sensor(s); a thread each for the source, the result file, the status "
                                      "line and the scene file",
                                      scene.track->sensors.size()));
        if (scene.track->smoothing_Hz == 0) e.leaves_out("pose filter", "track.smoothing_Hz is 0");
        if (scene.track->publish)
            e.uses("OpenIGTLink server", fmt::format("track.publish: port {}", scene.track->publish->port));
        else
            e.leaves_out("OpenIGTLink server", "no track.publish, no --publish: no socket");
    } else {
        e.leaves_out("tracker", "no track section: no thread, no filter");
    }
    if (scene.probes)
        e.uses("probes", scene.probes->points.string());
    else
        e.leaves_out("probes", "no probes section");
    if (scene.output.has_file())
        e.uses("result file", scene.output.file.string());
    else
        e.leaves_out("result file", "output.file: none");
    if (scene.materials.size() > 1)
        e.uses("materials", fmt::format("{}, by region", scene.materials.size()));
    else
        e.leaves_out("regions", "one material");

    explain_levels(hierarchy, multigrid);
    const int iterations = scene.solver.relative_tolerance > 1e-4 ? 7 : 15;
    fmt::print(
        "\nEach linearisation, with about {} iterations to {:.0e}: {:.0f} ms (measured on one core of a 2.4 GHz EPYC; "
        "yours will differ)\n",
        multigrid ? fmt::format("{}", iterations) : "an unknown number of", scene.solver.relative_tolerance,
        (1.5e-4 + 6e-5 * iterations) * tets);
}

}  // namespace

void add_explain_command(CLI::App& app) {
    CLI::App* command =
        app.add_subcommand("explain", "Says what a scene builds, what it leaves out and why, and what that takes");
    auto scene = std::make_shared<std::filesystem::path>();
    command->add_option("scene", *scene, "scene file (YAML)")->required();
    command->callback([scene] { explain(*scene); });
}

}  // namespace livetet
