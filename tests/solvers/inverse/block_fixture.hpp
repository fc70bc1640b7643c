#pragma once

#include <gtest/gtest.h>

#include "solvers/inverse/force_basis.hpp"
#include "solvers/nonlinear/deformable_body.hpp"
#include "support/shapes.hpp"

namespace livetet::test {

/// Three numbers a node, as one column.
inline Eigen::VectorXd as_column(const std::vector<Vector3>& field) {
    return Eigen::Map<const Eigen::VectorXd>(field.front().data(), 3 * std::ssize(field));
}

/// A block of 80 x 80 x 40 mm, fixed below, that is pulled about the middle of its top.
struct PulledBlock {
    MeshHierarchy hierarchy = make_hierarchy({block({6, 6, 3}, Vector3(0.08, 0.08, 0.04))}, "it");
    std::vector<Material> materials;
    std::vector<Triangle> surface = boundary_triangles(mesh().tets);
    std::vector<std::int32_t> zone = nodes_where(mesh(), [](const Vector3& x) {
        return x.z() > 0.0399 && (x - Vector3(0.04, 0.04, 0.04)).norm() < 0.02;
    });
    DeformableBody body;

    explicit PulledBlock(const ModelChoice& model,
                         Formulation formulation = Formulation::displacement, double stiffer = 1,
                         SolverKind kind = SolverKind::direct)
        : materials{{.young_Pa = 3000 * stiffer, .poisson = 0.4}},
          body({PETSC_COMM_SELF, hierarchy}, {materials, model, formulation}, {}, {.kind = kind}) {
        Constraints constraints(mesh().nodes.size());
        constraints.prescribe(nodes_where(mesh(), [](const Vector3& x) { return x.z() < 1e-9; }),
                              Vector3::Zero());
        body.set_constraints(constraints);
    }
    const TetMesh& mesh() const { return hierarchy.levels.front(); }

    /// Positions in equilibrium with f = B p.
    std::vector<Vector3> equilibrium(const ForceBasis& basis, const Eigen::VectorXd& p) {
        const std::size_t nodes = mesh().nodes.size();
        body.set_external_force(basis.force(p, nodes));
        const StepReport report = body.solve(0, {.tolerance = 1e-11, .linear_tolerance = 1e-8});
        EXPECT_TRUE(report.converged) << report.reason;
        std::vector<Vector3> x = mesh().nodes, u = body.displacement();
        for (std::size_t n = 0; n < nodes; ++n) x[n] += u[n];
        return x;
    }

    /// Points at these weights in every triangle of the top at `positions`, `off` m outside.
    std::vector<Vector3> points_on_top(std::span<const Vector3> positions, double off) const {
        std::vector<Vector3> points;
        for (const Triangle& t : surface) {
            if (mesh().nodes[t[0]].z() < 0.0399 || mesh().nodes[t[1]].z() < 0.0399 ||
                mesh().nodes[t[2]].z() < 0.0399)
                continue;
            const Vector3 &a = positions[t[0]], &b = positions[t[1]], &c = positions[t[2]];
            points.push_back(0.3 * a + 0.4 * b + 0.3 * c + off * (b - a).cross(c - a).normalized());
        }
        return points;
    }
};

}  // namespace livetet::test
