// Bodies of hexahedra with cuts in them: as if they had been made so, and solved as quickly.

#include "mesh/hex_cut.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <cmath>
#include <map>
#include <random>

#include "mechanics/gravity_load.hpp"
#include "mechanics/rigid_motions.hpp"
#include "mesh/mesh_pieces.hpp"
#include "solvers/nonlinear/deformable_body.hpp"
#include "support/hex_grids.hpp"
#include "support/ranks.hpp"

namespace livetet {
namespace {

MeshHierarchy cut_alone(TetMesh mesh) { return make_hierarchy({std::move(mesh)}, "a cut grid"); }

TetMesh opened_by(const TetMesh& mesh, const CutSurface& surface) {
    const HexLevel level = hex_level_of(mesh, "grid");
    return without_links(mesh, level,
                         crossed_links(level, grid_frame(mesh, level), surface, "cut"));
}

template <class Where>
std::vector<std::int32_t> nodes_of_cut(const TetMesh& mesh, Where&& where) {
    std::vector<std::int32_t> nodes;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
        if (where(mesh.nodes[n])) nodes.push_back(static_cast<std::int32_t>(n));
    return nodes;
}

/// What a pull comes to.
struct Pulled {
    std::vector<Vector3> displacement;
    double energy = 0;
    int iterations = 0;
};

/// A box of 1 x 1 x 0.5 is held at x = 0 and its end drawn away by 0.05.
Pulled pulled_apart(const MeshHierarchy& hierarchy, const char* model = "linear",
                    SolverOptions options = {}) {
    const TetMesh& mesh = hierarchy.levels.front();
    const std::vector<Material> materials{{.young_Pa = 1000, .poisson = 0.3}};
    DeformableBody body({PETSC_COMM_SELF, hierarchy}, {materials, model}, {}, options);
    Constraints constraints(mesh.nodes.size());
    constraints.prescribe(nodes_of_cut(mesh, [](const Vector3& x) { return x.x() < 1e-9; }),
                          Vector3::Zero());
    constraints.prescribe(nodes_of_cut(mesh, [](const Vector3& x) { return x.x() > 1 - 1e-9; }),
                          Vector3(0.05, 0, 0));
    body.set_constraints(constraints);
    const StepReport report =
        body.solve(0, {.max_newton = 60, .tolerance = 1e-11, .linear_tolerance = 1e-10});
    EXPECT_TRUE(report.converged) << report.reason;
    return {body.displacement(), body.strain_energy(), report.iterations};
}

/// A box of n x n x n / 2 cells with a crack at x = 1/2 from y = 1/2 to 1: nodes of the crack but
/// its end have a copy for the cells at x > 1/2, numbered here, by no link.
TetMesh cracked_by_hand(int n) {
    TetMesh mesh;
    std::map<std::array<int, 4>, std::int32_t> number;
    for (int k = 0; k < n / 2; ++k)
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                Hexahedron& cell = mesh.hexahedra.emplace_back();
                for (int c = 0; c < 8; ++c) {
                    const std::array<int, 3> at{i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1)};
                    const bool is_copy = at[0] == n / 2 && at[1] > n / 2 && i >= n / 2;
                    const auto [found, fresh] =
                        number.try_emplace({at[0], at[1], at[2], is_copy},
                                           static_cast<std::int32_t>(mesh.nodes.size()));
                    if (fresh) mesh.nodes.push_back(Vector3(at[0], at[1], at[2]) / n);
                    cell[c] = found->second;
                }
            }
    mesh.shares.assign(mesh.hexahedra.size(), 1);
    mesh.tets = tets_of_hexahedra(mesh.hexahedra);
    return mesh;
}

/// The same crack, cut.
TetMesh cracked_by_cut(int n) {
    return opened_by(test::hex_grid({n, n, n / 2}, {1, 1, 0.5}),
                     PlanePatch{Vector3(0.5, 0.75, 0.25),
                                Vector3(1, 0, 0),
                                {},
                                {{Vector3(0, 0.5, 0), Vector3(0, 0, 1)}}});
}

TEST(HexCut, GivesTheAnswerOfAGridMadeWithTheCutInIt) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    const MeshHierarchy made = cut_alone(cracked_by_hand(12)), cut = cut_alone(cracked_by_cut(12));
    ASSERT_EQ(made.levels[0].nodes.size(), cut.levels[0].nodes.size());
    for (const char* model : {"linear", "corotated", "neohookean"}) {
        const Pulled a = pulled_apart(made, model), b = pulled_apart(cut, model);
        EXPECT_NEAR(a.energy / b.energy, 1, 1e-9) << model;
        for (std::size_t e = 0; e < cut.levels[0].hexahedra.size(); ++e)
            for (int c = 0; c < 8; ++c)
                ASSERT_LT((a.displacement[made.levels[0].hexahedra[e][c]] -
                           b.displacement[cut.levels[0].hexahedra[e][c]])
                              .norm(),
                          1e-8 * 0.05)
                    << model;
    }
}

/// Against tetrahedra with the crack's doubled nodes. The energies of both fall to that of the
/// body as the mesh is refined, by about as much as from twice the edge: the crack's end makes the
/// error one of first order. They agree within these two errors, and finer ones better.
TEST(HexCut, AgreesWithTetrahedraThatHaveTheCrack) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    const auto energy_of_tets = [](int n) {
        TetMesh mesh = cracked_by_hand(n);
        mesh.hexahedra.clear();
        mesh.shares.clear();
        return pulled_apart(cut_alone(std::move(mesh)), "linear", {.kind = SolverKind::direct})
            .energy;
    };
    double last_gap = 1;
    for (const int n : {8, 16}) {
        const double hexahedra = pulled_apart(cut_alone(cracked_by_cut(n))).energy,
                     coarser = pulled_apart(cut_alone(cracked_by_cut(n / 2))).energy;
        const double tets = energy_of_tets(n), coarser_tets = energy_of_tets(n / 2);
        EXPECT_LT(hexahedra, coarser);
        EXPECT_LT(tets, coarser_tets);
        const double gap = std::abs(tets - hexahedra) / hexahedra;
        EXPECT_LT(gap, (coarser - hexahedra + coarser_tets - tets) / hexahedra) << n;
        EXPECT_LT(gap, 0.7 * last_gap) << n;
        last_gap = gap;
        RecordProperty(fmt::format("gap_{}", n), std::to_string(gap));
    }
    EXPECT_LT(last_gap, 0.03);
}

/// The crack's lips part where it is open, by more towards its mouth, and the same pull takes less
/// energy than without the crack.
TEST(HexCut, ACrackOpensUnderAPull) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    constexpr int n = 12;
    const MeshHierarchy whole = cut_alone(test::hex_grid({n, n, n / 2}, {1, 1, 0.5})),
                        cut = cut_alone(cracked_by_cut(n));
    const Pulled before = pulled_apart(whole), after = pulled_apart(cut);
    EXPECT_LT(after.energy, 0.9 * before.energy);
    const std::size_t nodes = whole.levels[0].nodes.size();
    std::map<double, double> gap;  // at each y, the smallest
    for (std::size_t copy = nodes; copy < cut.levels[0].nodes.size(); ++copy) {
        const Vector3& x = cut.levels[0].nodes[copy];
        const auto first = std::find(cut.levels[0].nodes.begin(), cut.levels[0].nodes.end(), x) -
                           cut.levels[0].nodes.begin();
        const double opened = after.displacement[copy].x() - after.displacement[first].x();
        const auto [found, fresh] = gap.try_emplace(x.y(), opened);
        found->second = std::min(found->second, opened);
    }
    ASSERT_EQ(gap.size(), static_cast<std::size_t>(n / 2));
    double last = 0;
    for (const auto& [y, opened] : gap) {
        EXPECT_GT(opened, last) << y;
        last = opened;
    }
    EXPECT_GT(last, 0.02);
}

/// Iterations to 1e-8 of a bar bent by its weight.
int iterations_of(const MeshHierarchy& hierarchy, double poisson) {
    const TetMesh& mesh = hierarchy.levels.front();
    const std::vector<Material> materials{{.young_Pa = 3000, .poisson = poisson}};
    DeformableBody body({PETSC_COMM_SELF, hierarchy}, {materials, "linear"}, {}, {});
    Constraints constraints(mesh.nodes.size());
    constraints.prescribe(nodes_of_cut(mesh, [](const Vector3& x) { return x.x() < 1e-9; }),
                          Vector3::Zero());
    body.set_constraints(constraints);
    body.set_external_force(gravity_load(mesh, materials, Vector3(0, 0, -9.81)));
    const StepReport report =
        body.solve(0, {.max_newton = 1, .tolerance = 1e-7, .linear_tolerance = 1e-8});
    EXPECT_TRUE(report.converged) << report.reason;
    return report.iterations;
}

/// Bars cut to a bridge of an eighth of their width, along faces of coarse cells and not.
TEST(HexCut, ABodyCutNearlyThroughTakesTwiceTheIterationsAtMost) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    const TetMesh bar = test::hex_grid({48, 24, 24}, {0.1, 0.05, 0.05});
    for (const double poisson : {0.3, 0.45}) {
        const int whole = iterations_of(cut_alone(bar), poisson);
        RecordProperty(fmt::format("whole_{}", poisson), whole);
        int k = 0;
        for (const Vector3& normal : {Vector3(1, 0, 0), Vector3(1, 0.3, 0.2), Vector3(1, -1, 0)})
            for (const double x : {0.05, 0.0523}) {
                const Vector3 across =
                    (Vector3(0, 1, 0) - normal * normal.y() / normal.squaredNorm()).normalized();
                const Vector3 along = normal.normalized().cross(across);
                // From y = 1/8 of the width on.
                const TetMesh cut =
                    opened_by(bar, PlanePatch{Vector3(x, 0.05 / 8, 0.025) + 0.1 * across,
                                              normal,
                                              {},
                                              {{Vector3(0.2 * across), Vector3(0.2 * along)}}});
                ASSERT_EQ(mesh_pieces(cut).size(), 1U);
                ASSERT_GT(cut.nodes.size(), bar.nodes.size() + 400);
                const int iterations = iterations_of(cut_alone(cut), poisson);
                RecordProperty(fmt::format("cut_{}_{}", poisson, k++), iterations);
                EXPECT_LE(iterations, 2 * whole) << poisson << ", " << normal.transpose();
            }
    }
}

/// Random cuts through a small body whose pieces are all held: each solve ends, finite and
/// converged.
TEST(HexCut, RandomCutsAreSolved) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    const TetMesh mesh = test::hex_grid({8, 6, 6}, {0.08, 0.06, 0.06});
    const std::vector<Material> materials{{.young_Pa = 3000, .poisson = 0.4}};
    const auto force_of = [&](const TetMesh& of) {
        return gravity_load(of, materials, Vector3(0, 0, -9.81));
    };
    int solved = 0;
    for (std::uint32_t seed = 0; seed < 240; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> at(0, 1);
        TetMesh cut = mesh;
        for (int i = 0; i < 2; ++i) {
            const double a = at(random), b = at(random), c = at(random);
            const double p = at(random), q = at(random), r = at(random);
            PlanePatch patch{Vector3(0.08 * a, 0.06 * b, 0.06 * c), Vector3(p, q, r) * 2};
            patch.normal -= Vector3::Ones();
            if (random() % 4) patch.radius = 0.05 * at(random);
            cut = opened_by(cut, patch);
        }
        // What nothing would hold is left out.
        std::vector<std::uint8_t> left_out(cut.hexahedra.size(), 0);
        const auto is_held = [&](std::int32_t n) { return cut.nodes[n].x() < 1e-9; };
        for (const MeshPiece& piece : mesh_pieces(cut))
            if (std::ranges::none_of(piece.cells, [&](std::int32_t e) {
                    return std::ranges::any_of(cut.hexahedra[e], is_held);
                }))
                for (const std::int32_t e : piece.cells) left_out[e] = 1;
        const MeshHierarchy hierarchy = cut_alone(without_cells(cut, left_out));
        const TetMesh& rest = hierarchy.levels.front();
        Constraints constraints(rest.nodes.size());
        constraints.prescribe(nodes_of_cut(rest, [](const Vector3& x) { return x.x() < 1e-9; }),
                              Vector3::Zero());
        if (!free_rigid_motions(rest, constraints.components).empty()) continue;
        DeformableBody body({PETSC_COMM_SELF, hierarchy}, {materials, "linear"}, {}, {});
        body.set_constraints(constraints);
        body.set_external_force(force_of(rest));
        const StepReport report = body.solve(0, {.linear_tolerance = 1e-8});
        ASSERT_TRUE(report.converged) << report.reason;
        double largest = 0;
        for (const Vector3& u : body.displacement()) {
            ASSERT_TRUE(u.allFinite());
            largest = std::max(largest, u.norm());
        }
        EXPECT_GT(largest, 0);
        ++solved;
    }
    EXPECT_GT(solved, 200);
}

}  // namespace
}  // namespace livetet
