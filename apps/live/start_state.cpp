#include "apps/live/start_state.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "io/result_file.hpp"
#include "mesh/hex_grid.hpp"
#include "mesh/quadratic.hpp"
#include "solvers/nonlinear/held_force.hpp"

namespace livetet {

namespace {

/// Whether a solve came to its end, as its result says.
bool has_converged(const ResultReader& result, const std::string& file) {
    const auto about = nlohmann::json::parse(result.text("solve"), nullptr, false);
    const auto found = about.is_object() ? about.find("converged") : about.end();
    if (!about.is_object() || found == about.end() || !found->is_boolean())
        fail("{}: its description of the solve is damaged, expected \"converged\" there", file);
    return found->get<bool>();
}

/// Throws Error, naming the file, unless both have the same tets with corners at the same places.
void check_corners(const TetMesh& found, const TetMesh& mesh, const std::string& file) {
    constexpr double tolerance = 1e-6;  // m: results may be in single precision
    const auto corners = static_cast<std::size_t>(corner_count(mesh));
    if (static_cast<std::size_t>(corner_count(found)) != corners || found.tets != mesh.tets)
        fail(
            "{}: is of another mesh, or of one with other cuts, of {} and {} nodes, expected that "
            "of the scene, of {} and {} nodes",
            file, elements_text(found), found.nodes.size(), elements_text(mesh), mesh.nodes.size());
    for (std::size_t n = 0; n < corners; ++n)
        if (const double off = (found.nodes[n] - mesh.nodes[n]).norm(); !(off <= tolerance))
            fail(
                "{}: is of another mesh, whose node {} at rest lies {:.3g} mm away from that of "
                "mesh.file, expected at most {:g} mm",
                file, n, 1e3 * off, 1e3 * tolerance);
}

}  // namespace

std::vector<Vector3> read_start(const std::filesystem::path& file, const TetMesh& mesh) {
    const std::string name = "track.start = " + file.string();
    const ResultReader result(file);
    if (!result.has_text("solve") || result.frame_count() == 0)
        fail("{}: holds no equilibrium, expected the result of livetet register --deform or solve",
             name);
    if (!has_converged(result, name))
        fail("{}: that run did not converge, expected an equilibrium", name);
    check_corners(result.mesh(), mesh, name);
    std::vector<Vector3> u = result.displacement(result.frame_count() - 1);
    if (u.size() != mesh.nodes.size()) u = PointSampler(result.mesh(), mesh.nodes).sample(u);
    return u;
}

void hold_at(DeformableBody& body, const Constraints& constraints, std::span<const Vector3> u) {
    constexpr double tolerance = 1e-4;  // m
    const LinearSolver& solver = body.linear_solver();
    if (solver.is_mixed() && solver.fine().share().hexahedra.empty())
        fail(
            "track.start: found tets in the mixed form (a poisson of 0.49 or more, or "
            "formulation), expected displacements alone (formulation: displacement)");
    for (std::size_t n = 0; n < u.size(); ++n)
        for (int c = 0; c < 3; ++c)
            if (const double off = u[n][c] - constraints.values[n][c];
                (constraints.components[n] >> c & 1) != 0 && !(std::abs(off) <= tolerance))
                fail(
                    "track.start: node {} is held by fix or drive, and is {:.2f} mm away from "
                    "where they hold it, expected at most {:g} mm: hold it as the result's scene "
                    "did",
                    n, 1e3 * std::abs(off), 1e3 * tolerance);
    body.set_external_force({});
    body.set_displacement(u);
    body.set_external_force(held_force(body));
}

}  // namespace livetet
