#include "apps/live/response_body.hpp"

#include <algorithm>

#include "base/error.hpp"

namespace livetet {

namespace {

/// Of the solves' forces: far below the differences that are looked for.
constexpr double response_tolerance = 1e-3;

/// Displacement of a node by a unit motion of a patch: along an axis (0 to 2), or about one.
Vector3 unit_motion(const ResponsePatch& patch, int motion, const Vector3& place) {
    const Vector3 axis = Vector3::Unit(motion % 3);
    return motion < 3 ? axis : axis.cross(place - patch.centre);
}

/// A field of the corners, and on the edges of a ten-node mesh the means of their ends.
std::vector<Vector3> on_all_nodes(const TetMesh& mesh, std::vector<Vector3> field) {
    field.resize(mesh.nodes.size(), Vector3::Zero());
    for (std::size_t t = 0; t < mesh.edge_nodes.size(); ++t)
        for (std::size_t e = 0; e < std::size(tet_edges); ++e)
            field[mesh.edge_nodes[t][e]] =
                0.5 * (field[mesh.tets[t][tet_edges[e][0]]] + field[mesh.tets[t][tet_edges[e][1]]]);
    return field;
}

/// Of the corners; a midpoint is held as both ends of its edge are.
Holding on_all_nodes(const TetMesh& mesh, Holding held) {
    held.constraints.components.resize(mesh.nodes.size(), 0);
    held.constraints.values.resize(mesh.nodes.size(), Vector3::Zero());
    if (!held.springs.empty()) {
        held.springs.stiffness.resize(mesh.nodes.size(), 0);
        held.springs.target.resize(mesh.nodes.size(), Vector3::Zero());
    }
    for (std::size_t t = 0; t < mesh.edge_nodes.size(); ++t)
        for (std::size_t e = 0; e < std::size(tet_edges); ++e)
            held.constraints.components[mesh.edge_nodes[t][e]] =
                held.constraints.components[mesh.tets[t][tet_edges[e][0]]] &
                held.constraints.components[mesh.tets[t][tet_edges[e][1]]];
    return held;
}

const std::vector<std::int32_t>& held_nodes(const ResponsePatch& patch, bool wider) {
    return wider ? patch.wider_nodes : patch.nodes;
}

}  // namespace

ResponseBody::ResponseBody(const Scene& scene, const MeshHierarchy& hierarchy, Use use,
                           const Holding& held, std::span<const Vector3> samples)
    : body_(make_body(PETSC_COMM_SELF, scene, hierarchy, use)),
      held_(on_all_nodes(body_.mesh(), held)),
      sampler_(body_.mesh(), samples, Outside::extrapolated) {}

std::vector<Vector3> ResponseBody::solve(std::span<const ResponsePatch> patches, std::size_t moved,
                                         int motion, bool wider,
                                         const std::vector<Vector3>& start) {
    auto [constraints, springs] = held_;
    const std::vector<int> shared = patches_at_nodes(patches, wider);
    for (std::size_t p = 0; p < patches.size(); ++p)
        hold(patches[p], wider, p == moved ? motion : -1, shared, constraints, springs);
    body_.body->set_constraints(constraints);
    body_.body->set_springs(springs);
    body_.body->set_displacement(on_all_nodes(body_.mesh(), start));
    const StepReport report = body_.body->solve(
        0, {.max_newton = 8, .tolerance = response_tolerance, .linear_tolerance = 1e-2});
    if (!report.converged)
        fail("a static solve ended with {:.2g} of the forces out of balance, expected {:.2g}",
             report.imbalance, report.allowed_imbalance);
    return body_.body->displacement();
}

/// Number of prescribed patches that each node is in: it follows their mean.
std::vector<int> ResponseBody::patches_at_nodes(std::span<const ResponsePatch> patches,
                                                bool wider) const {
    std::vector<int> count(body_.mesh().nodes.size(), 0);
    for (const ResponsePatch& patch : patches)
        if (!patch.stiffness)
            for (const std::int32_t n : held_nodes(patch, wider)) ++count[n];
    return count;
}

/// Adds a patch to what holds the body. `motion`: of the patch; -1: it rests. `shared`: see
/// patches_at_nodes.
void ResponseBody::hold(const ResponsePatch& patch, bool wider, int motion,
                        std::span<const int> shared, Constraints& constraints,
                        Springs& springs) const {
    const TetMesh& mesh = body_.mesh();
    const std::vector<std::int32_t>& nodes = held_nodes(patch, wider);
    if (patch.stiffness) {
        springs.stiffness.resize(mesh.nodes.size(), 0);
        springs.target.resize(mesh.nodes.size(), Vector3::Zero());
    }
    for (const std::int32_t n : nodes) {
        Vector3 value = Vector3::Zero();
        if (motion >= 0) value = unit_motion(patch, motion, mesh.nodes[n]);
        if (patch.stiffness) {
            const double each = *patch.stiffness / static_cast<double>(nodes.size());
            springs.stiffness[n] += each;
            springs.target[n] += each / springs.stiffness[n] * (value - springs.target[n]);
        } else if (held_.constraints.components[n] == 0) {
            constraints.components[n] = 7;
            constraints.values[n] += value / shared[n];
        }
    }
}

}  // namespace livetet
