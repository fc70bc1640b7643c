// Live bodies of hexahedra: the cycle, and frames against the plain path. On one rank.

#include "solvers/linear/grid_cycle.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>

#include <cmath>

#include "base/error.hpp"
#include "mesh/hex_cut.hpp"
#include "mesh/hierarchy.hpp"
#include "solvers/linear/live_solver.hpp"
#include "solvers/linear/live_support.hpp"
#include "solvers/nonlinear/deformable_body.hpp"
#include "support/beam_press.hpp"
#include "support/cycles.hpp"
#include "support/hex_grids.hpp"
#include "support/ranks.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

const Vector3 beam_box(0.2, 0.1, 0.1);

/// A beam of 20 x 10 x 10 cells with a step, cut halfway through, of two materials.
TetMesh cut_beam() {
    TetMesh mesh = test::hex_grid({20, 10, 10}, beam_box,
                                  [](const Vector3& x) { return x.x() < 0.15 || x.z() < 0.07; });
    for (const Hexahedron& cell : mesh.hexahedra)
        mesh.regions.insert(mesh.regions.end(), tets_per_hexahedron,
                            mesh.nodes[cell[0]].x() > 0.12);
    for (std::size_t e = 0; e < mesh.shares.size(); e += 7) mesh.shares[e] = 0.3;
    const HexLevel level = hex_level_of(mesh, "a beam");
    PlanePatch plane{.point = {0.08, 0.05, 0.1}, .normal = Vector3::UnitX()};
    plane.edges = {Vector3(0, 0.2, 0), Vector3(0, 0, 0.1)};
    return without_links(mesh, level,
                         crossed_links(level, grid_frame(mesh, level), plane, "a cut"));
}

class LiveGrid : public testing::TestWithParam<const char*> {
  protected:
    void SetUp() override {
        if (test::rank_count() > 1) GTEST_SKIP() << "the live solver is for one rank";
    }
    std::unique_ptr<DeformableBody> body(const SolverOptions& options,
                                         const TimeOptions& time = {}) {
        auto made = std::make_unique<DeformableBody>(
            DistributedHierarchy{PETSC_COMM_SELF, hierarchy},
            ElasticModel{materials, GetParam(), Formulation::displacement}, time, options);
        made->set_constraints(pressed(1));
        return made;
    }
    Constraints pressed(double part) const {
        const TetMesh& mesh = hierarchy.levels.front();
        Constraints constraints(mesh.nodes.size());
        for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
            const Vector3& x = mesh.nodes[n];
            const auto node = static_cast<std::int32_t>(n);
            if (x.x() < 1e-9) constraints.prescribe(std::span(&node, 1), Vector3::Zero());
            if ((x - Vector3(0.2, 0.05, 0.07)).norm() < 0.025)
                constraints.prescribe(std::span(&node, 1), part * Vector3(0, 0.004, -0.015));
        }
        return constraints;
    }

    const MeshHierarchy hierarchy = make_hierarchy({cut_beam()}, "a cut beam");
    const std::vector<Material> materials{
        {.young_Pa = 3000, .poisson = 0.45, .density_kg_per_m3 = 1000, .region = 0},
        {.young_Pa = 60000, .poisson = 0.3, .density_kg_per_m3 = 1000, .region = 1}};
};

TEST_P(LiveGrid, AgreesWithThePlainPathTo1e6WhenConverged) {
    const auto plain = body({});
    ASSERT_TRUE(plain->solve(0, {.max_newton = 60, .tolerance = 1e-10, .linear_tolerance = 1e-6})
                    .converged);
    for (const int threads : {1, 2}) {
        const auto live = body({.kind = SolverKind::live, .threads = threads});
        EXPECT_EQ(live->linear_solver().kind(), SolverKind::live);
        for (int k = 1; k <= 10; ++k) {
            live->set_constraints(pressed(k / 10.0));
            (void)live->advance(0, {.linear_tolerance = 1e-4});
        }
        for (int frame = 0; frame < 50; ++frame) (void)live->advance(0, {.linear_tolerance = 1e-4});
        EXPECT_LT(test::largest_gap(live->displacement(), plain->displacement()), 1e-6 * 0.0155)
            << threads << " threads";
    }
}

TEST_P(LiveGrid, GivesTheSameBitsOnAnyNumberOfThreads) {
    std::vector<Vector3> expected;
    for (const int threads : {1, 2, 4}) {
        const auto live = body({.kind = SolverKind::live, .threads = threads},
                               {.scheme = TimeScheme::newmark, .rayleigh_alpha = 10});
        for (int k = 1; k <= 12; ++k) {
            live->set_constraints(pressed(std::min(k, 8) / 8.0));
            (void)live->advance(0.05, {.max_iterations = 3});
        }
        if (threads == 1) expected = live->displacement();
        EXPECT_EQ(live->displacement(), expected) << threads << " threads";
    }
}

/// A dynamic body follows the same path as with the plain solver, step by step.
TEST_P(LiveGrid, MovesAsThePlainPathDoes) {
    const TimeOptions time{.scheme = TimeScheme::newmark, .rayleigh_alpha = 10};
    const auto live = body({.kind = SolverKind::live}, time), plain = body({}, time);
    for (int k = 1; k <= 10; ++k) {
        for (const auto& each : {live.get(), plain.get()}) {
            each->set_constraints(pressed(k / 10.0));
            for (int iteration = 0; iteration < 1; ++iteration)
                (void)each->advance(0.02, {.newton_iterations = 4, .linear_tolerance = 1e-6});
        }
        ASSERT_LT(test::largest_gap(live->displacement(), plain->displacement()), 1e-5 * 0.0155)
            << k;
    }
}

/// A solve to 1e-2, as frames have it, takes few iterations, though the body is cut and of two
/// moduli, and much of its border is partly outside.
TEST_P(LiveGrid, TakesFewIterationsAFrame) {
    const auto live = body({.kind = SolverKind::live});
    int most = 0;
    for (int k = 1; k <= 10; ++k) {
        live->set_constraints(pressed(k / 10.0));
        most = std::max(most, live->advance(0, {.linear_tolerance = 1e-2}).iterations);
    }
    EXPECT_LE(most, 14);
}

/// The solver hands on to its cycle that a solve begins with a start.
TEST_P(LiveGrid, TakesAnotherFirstCycleAfterAStart) {
    const auto live = body({.kind = SolverKind::live});
    (void)live->advance(0, {.linear_tolerance = 1e-2});
    // Bodies show their solver for reading alone.
    auto& solver = dynamic_cast<LiveSolver&>(const_cast<LinearSolver&>(live->linear_solver()));
    const Eigen::VectorXd r = test::wave(solver.fine(), 0.01), whole = test::cycled(solver, r);
    solver.begin_solve(true);
    const Eigen::VectorXd first = test::cycled(solver, r);
    EXPECT_NE(first, whole);
    EXPECT_EQ(test::cycled(solver, r), whole);
}

INSTANTIATE_TEST_SUITE_P(Laws, LiveGrid, testing::Values("linear", "corotated", "neohookean"),
                         [](const auto& info) { return std::string(info.param); });

/// The cycle on a bent, clamped grid with springs and mass.
class GridCycleTest : public testing::Test {
  protected:
    void SetUp() override {
        if (test::rank_count() > 1) GTEST_SKIP() << "it is for one rank";
        for (const TetMesh& mesh : grid.meshes.levels) {
            auto level = std::make_unique<LevelAssembler>(
                distribute_mesh(PETSC_COMM_SELF, mesh, {}), materials, "corotated",
                Formulation::displacement, SinglePrecision{});
            std::vector<std::uint8_t> held;
            std::vector<double> springs;
            for (const Vector3& x : mesh.nodes) {
                held.push_back(x.x() < 1e-9 ? 7 : 0);
                springs.push_back(x.x() > 0.1999 ? 5.0 : 0.0);
            }
            level->set_constrained(held);
            level->set_springs(springs);
            level->find_mass();
            levels.push_back(std::move(level));
        }
        std::vector<LevelAssembler*> all;
        for (const auto& level : levels) all.push_back(level.get());
        cycle = std::make_unique<GridCycle>(all, grid.levels, 2, ThreadTeam::alone());
        cycle->set_constrained();
        fine = std::make_unique<MatrixFreeOperator>(*levels[0], ThreadTeam::alone());
        fine->set_constrained();
        const TetMesh& mesh = grid.meshes.levels.front();
        n = 3 * static_cast<Eigen::Index>(mesh.nodes.size());
        const auto u = make_vector(levels[0]->share());
        std::vector<Vector3> bent;
        for (const Vector3& x : mesh.nodes)
            bent.push_back({0.3 * x.x() * x.y(), x.x() * x.z(), -2 * x.x() * x.x()});
        test::fill(levels[0]->share(), bent, u.get());
        rotations = levels[0]->make_rotations();
        levels[0]->update_rotations(u.get(), rotations);
        (void)cycle->update(rotations, 1.2, 3e4);
        fine->update(rotations, 1.2, 3e4);
    }
    Eigen::VectorXd wave(double frequency) const { return test::wave(*levels[0], frequency); }
    Eigen::VectorXd cycled(const Eigen::VectorXd& r) { return test::cycled(*cycle, r); }

    const GridHierarchy grid = grid_hierarchy(cut_beam(), 100);
    const std::vector<Material> materials{
        {.young_Pa = 4000, .poisson = 0.45, .density_kg_per_m3 = 1000}};
    std::vector<std::unique_ptr<LevelAssembler>> levels;
    ElementRotations rotations;
    std::unique_ptr<GridCycle> cycle;
    std::unique_ptr<MatrixFreeOperator> fine;
    Eigen::Index n = 0;
};

TEST_F(GridCycleTest, IsSymmetricAndPositive) {
    ASSERT_GE(grid.levels.size(), 3);
    const Eigen::VectorXd a = wave(0.7), b = wave(1.9), Ca = cycled(a), Cb = cycled(b);
    EXPECT_NEAR(b.dot(Ca), a.dot(Cb), 1e-4 * std::sqrt(a.dot(Ca) * b.dot(Cb)));
    EXPECT_GT(a.dot(Ca), 0);
    EXPECT_GT(b.dot(Cb), 0);
    for (Eigen::Index i = 0; i < n; ++i)
        if (levels[0]->constrained()[i / 3]) {
            ASSERT_EQ(Ca[i], 0) << i;
        }
}

/// The first cycle after a start reduces a smooth error, along the line that a frame's first
/// iteration takes, to 0.21 of its energy's norm, others to 0.13; it alone is such a cycle.
TEST_F(GridCycleTest, AfterAStartSmoothsItsFinestLevelOnlyAfterwards) {
    const auto times = [&](const Eigen::VectorXd& x) {
        Eigen::VectorXd y(n);
        fine->multiply(std::span(x.data(), n), std::span(y.data(), n));
        return y;
    };
    const Eigen::VectorXd error = wave(0.01), r = times(error);
    const auto left = [&](const Eigen::VectorXd& z) {  // of the energy
        const double along = r.dot(z);
        return std::sqrt(1 - along * along / (z.dot(times(z)) * error.dot(r)));
    };
    const Eigen::VectorXd whole = cycled(r);
    cycle->begin_solve(true);
    const Eigen::VectorXd first = cycled(r), second = cycled(r);
    EXPECT_LT(left(first), 0.25);
    EXPECT_LT(left(first), 2 * left(whole));
    EXPECT_GT((first - whole).norm(), 1e-3 * whole.norm());
    EXPECT_EQ(second, whole);
    cycle->begin_solve(true);
    cycle->begin_solve(false);
    EXPECT_EQ(cycled(r), whole);
}

TEST(LiveGridSupport, RefusesWhatItCannotTake) {
    const MeshHierarchy plain =
        make_hierarchy({test::hex_grid({4, 4, 4}, {0.1, 0.1, 0.1})}, "a grid");
    const std::vector<Material> soft{{.young_Pa = 3000, .poisson = 0.45}},
        nearly_incompressible{{.young_Pa = 3000, .poisson = 0.4999}};
    EXPECT_EQ(why_not_live({soft, "corotated"}, plain), "");
    EXPECT_EQ(why_not_live({nearly_incompressible, "corotated"}, plain), "");
    // A sheet of single cells that hang together nowhere.
    const MeshHierarchy loose =
        make_hierarchy({test::hex_grid({40, 40, 1}, {0.4, 0.4, 0.01},
                                       [](const Vector3& x) {
                                           const auto cell = static_cast<int>(x.x() * 100) +
                                                             static_cast<int>(x.y() * 100);
                                           return cell % 2 == 0;
                                       })},
                       "a checkerboard");
    EXPECT_NE(why_not_live({soft, "corotated"}, loose).find("hang together too little"),
              std::string::npos);
}

}  // namespace
}  // namespace livetet
