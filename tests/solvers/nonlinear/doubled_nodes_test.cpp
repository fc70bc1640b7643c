// The state of a body whose mesh is cut on the way.

#include "solvers/nonlinear/doubled_nodes.hpp"

#include <gtest/gtest.h>

#include "base/error.hpp"
#include "mesh/hex_cut.hpp"
#include "support/hex_grids.hpp"

namespace livetet {
namespace {

constexpr double g = 2, step_s = 0.02;

/// A grid, or its halves beyond a cut.
struct CutBox {
    MeshHierarchy hierarchy;
    std::vector<std::int32_t> originals;
    std::vector<Material> materials;
    std::unique_ptr<DeformableBody> body;

    CutBox(TimeScheme scheme, double cut_at, double poisson = 0.3,
           SolverKind kind = SolverKind::live)
        : materials{{.young_Pa = 3000, .poisson = poisson}} {
        TetMesh mesh = test::hex_grid({6, 3, 3}, {0.06, 0.03, 0.03});
        const HexLevel level = hex_level_of(mesh, "box");
        OpenedGrid opened = open_links(mesh, level,
                                       crossed_links(level, grid_frame(mesh, level),
                                                     PlanePatch{{cut_at, 0, 0}, {1, 0, 0}}, "cut"));
        originals = std::move(opened.originals);
        hierarchy = make_hierarchy({std::move(opened.mesh)}, "a box");
        SolverOptions options;
        options.kind = kind;
        options.threads = 1;
        TimeOptions time;
        time.scheme = scheme;
        body =
            std::make_unique<DeformableBody>(DistributedHierarchy{PETSC_COMM_SELF, hierarchy, {}},
                                             ElasticModel{materials, "corotated"}, time, options);
        body->set_external_force(weight());
    }
    std::size_t nodes() const { return hierarchy.levels.front().nodes.size(); }
    /// m g downwards at each node.
    std::vector<Vector3> weight() const {
        std::vector<Vector3> force;
        for (const double m : body->node_mass()) force.emplace_back(0, 0, -m * g);
        return force;
    }
    void fall(int steps) {
        for (int k = 0; k < steps; ++k) (void)body->advance(step_s, {.linear_tolerance = 1e-8});
    }
};

/// Nothing tells a body in free fall that it was cut: it goes on as one that is whole.
TEST(DoubledNodes, ABodyThatIsCutInFreeFallFallsOn) {
    for (const TimeScheme scheme :
         {TimeScheme::newmark, TimeScheme::generalized_alpha, TimeScheme::implicit_euler}) {
        CutBox whole(scheme, -1), cut(scheme, 0.03), going_on(scheme, -1);
        ASSERT_EQ(whole.originals.size(), 0U);
        ASSERT_EQ(cut.originals.size(), 16U);
        whole.fall(5);
        going_on.fall(5);
        carry_state(*whole.body, *cut.body, {{}, cut.originals});
        const auto u = whole.body->displacement(), v = whole.body->velocity();
        const auto u_cut = cut.body->displacement(), v_cut = cut.body->velocity();
        ASSERT_EQ(u_cut.size(), u.size() + 16);
        for (std::size_t k = 0; k < 16; ++k) {
            EXPECT_EQ(u_cut[u.size() + k], u[cut.originals[k]]);
            EXPECT_EQ(v_cut[u.size() + k], v[cut.originals[k]]);
        }
        cut.fall(5);
        going_on.fall(5);
        const double expected = going_on.body->displacement()[0].z();
        EXPECT_LT(expected, -0.005);
        for (const Vector3& moved : cut.body->displacement()) {
            EXPECT_NEAR(moved.z(), expected, 1e-5 * std::abs(expected)) << static_cast<int>(scheme);
            EXPECT_NEAR(moved.x(), 0, 1e-7);
        }
    }
}

/// Pressed between two plates: each cell keeps its pressure, however the body is cut, and a solver
/// that eliminates pressures takes the rest of the state.
TEST(DoubledNodes, CellsKeepTheirPressures) {
    CutBox whole(TimeScheme::newmark, -1, 0.499), cut(TimeScheme::newmark, 0.03, 0.499),
        eliminated(TimeScheme::newmark, 0.03, 0.499, SolverKind::automatic);
    const TetMesh& mesh = whole.hierarchy.levels.front();
    Constraints constraints(mesh.nodes.size());
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
        const auto node = static_cast<std::int32_t>(n);
        const double x = mesh.nodes[n].x();
        if (x < 1e-9 || x > 0.0599)
            constraints.prescribe(std::span(&node, 1), Vector3(x < 1e-9 ? 0 : -0.002, 0, 0));
    }
    whole.body->set_constraints(constraints);
    whole.fall(3);
    const BodySnapshot before = whole.body->gather_state();
    ASSERT_EQ(before.pressure.size(), mesh.hexahedra.size());
    EXPECT_GT(std::abs(before.pressure[10]), 1);  // Pa
    carry_state(*whole.body, *cut.body, {{}, cut.originals});
    EXPECT_EQ(cut.body->gather_state().pressure, before.pressure);
    carry_state(*whole.body, *eliminated.body, {{}, eliminated.originals});
    EXPECT_TRUE(eliminated.body->gather_state().pressure.empty());
    EXPECT_EQ(eliminated.body->displacement(), cut.body->displacement());
}

TEST(DoubledNodes, ABodyOfAnotherMeshOrSchemeIsRefused) {
    CutBox whole(TimeScheme::newmark, -1), cut(TimeScheme::newmark, 0.03),
        other(TimeScheme::generalized_alpha, 0.03);
    EXPECT_THROW(carry_state(*whole.body, *cut.body, {}), Error);
    EXPECT_THROW(carry_state(*whole.body, *other.body, {{}, cut.originals}), Error);
}

}  // namespace
}  // namespace livetet
