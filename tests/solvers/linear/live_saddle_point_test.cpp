// LiveSaddlePoint: live frames of nearly incompressible bodies, with pressures, against the plain
// path. On one rank, as the live solver is.

#include <gtest/gtest.h>

#include <cmath>

#include "mesh/quadratic.hpp"
#include "solvers/linear/linear_solver.hpp"
#include "solvers/nonlinear/deformable_body.hpp"
#include "support/beam_press.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

struct MixedCase {
    const char* model;
    bool has_ten_nodes;
    double poisson;
};

class LiveMixed : public testing::TestWithParam<MixedCase> {
  protected:
    void SetUp() override {
        if (test::rank_count() > 1) GTEST_SKIP() << "the live solver is for one rank";
        if (GetParam().has_ten_nodes) hierarchy = with_quadratic_level(std::move(hierarchy));
        materials = {{.young_Pa = 3000,
                      .poisson = GetParam().poisson,
                      .density_kg_per_m3 = 1000,
                      .region = 0}};
    }
    std::unique_ptr<DeformableBody> body(const SolverOptions& options,
                                         const TimeOptions& time = {}) const {
        auto b = std::make_unique<DeformableBody>(
            DistributedHierarchy{PETSC_COMM_WORLD, hierarchy},
            ElasticModel{materials, GetParam().model, Formulation::mixed}, time, options);
        b->set_constraints(pressed(1));
        return b;
    }
    Constraints pressed(double part) const {
        return test::pressed_beam(hierarchy.levels.front(), 0.03, part * Vector3(0, 0.002, -0.01));
    }
    /// Pressed slowly, then let go on.
    void follow(DeformableBody& live, const FrameControls& effort, int rest) const {
        for (int k = 1; k <= 10; ++k) {
            live.set_constraints(pressed(k / 10.0));
            (void)live.advance(0, effort);
        }
        for (int frame = 0; frame < rest; ++frame) (void)live.advance(0, effort);
    }

    MeshHierarchy hierarchy = make_hierarchy(
        {test::block({8, 4, 4}, test::beam_size), test::block({4, 2, 2}, test::beam_size)},
        "a beam");
    std::vector<Material> materials;
};

TEST_P(LiveMixed, AgreesWithThePlainPathTo1e6WhenLetGoOn) {
    const auto plain = body({.kind = SolverKind::multigrid});
    ASSERT_TRUE(plain->solve(0, {.max_newton = 60, .tolerance = 1e-10, .linear_tolerance = 1e-6})
                    .converged);
    for (const int threads : {1, 2}) {
        const auto live = body({.kind = SolverKind::live, .threads = threads});
        follow(*live, {.linear_tolerance = 1e-3}, 40);
        EXPECT_LT(test::largest_gap(live->displacement(), plain->displacement()), 1e-6 * 0.0102)
            << threads << " threads";
    }
}

TEST_P(LiveMixed, GivesTheSameBitsOnAnyNumberOfThreads) {
    std::vector<Vector3> expected;
    for (const int threads : {1, 2, 4}) {
        const auto live = body({.kind = SolverKind::live, .threads = threads});
        follow(*live, {.max_iterations = 3}, 2);
        if (threads == 1) expected = live->displacement();
        EXPECT_EQ(live->displacement(), expected) << threads << " threads";
    }
}

TEST_P(LiveMixed, AgreesWithThePlainPathInTime) {
    const TimeOptions time{.scheme = TimeScheme::newmark, .rayleigh_alpha = 5};
    const auto plain = body({.kind = SolverKind::multigrid, .relative_tolerance = 1e-9}, time);
    const auto live = body({.kind = SolverKind::live, .threads = 2}, time);
    const FrameControls effort{.newton_iterations = 8, .linear_tolerance = 1e-6};
    for (int k = 1; k <= 4; ++k)
        for (DeformableBody* b : {plain.get(), live.get()}) {
            b->set_constraints(pressed(k / 4.0));
            (void)b->advance(0.02, effort);
        }
    EXPECT_LT(test::largest_gap(live->displacement(), plain->displacement()), 3e-5 * 0.0102);
}

/// The operator of a bent body, in a Newmark step with damping, mass and springs.
TEST_P(LiveMixed, ProductsAreThoseOfTheAssembledMatrix) {
    const TetMesh& mesh = hierarchy.levels.front();
    const std::vector<Material> two{
        {.young_Pa = 3000, .poisson = GetParam().poisson, .density_kg_per_m3 = 900},
        {.young_Pa = 9000, .poisson = 0.45, .density_kg_per_m3 = 1200, .region = 1}};
    for (TetMesh& level : hierarchy.levels)
        for (const Tet& t : level.tets) level.regions.push_back(level.nodes[t[0]].x() > 0.1);
    std::vector<std::uint8_t> held(mesh.nodes.size());
    std::vector<double> springs(mesh.nodes.size());
    std::vector<Vector3> bent;
    for (std::size_t i = 0; i < held.size(); ++i) {
        const Vector3& x = mesh.nodes[i];
        held[i] = x.x() < 1e-9 ? 7 : x.x() > 0.199 ? 2 : 0;
        springs[i] = x.z() < 1e-9 ? 40 : 0;
        bent.push_back({0.1 * x.y() * x.z(), 0, -1.5 * x.x() * x.x()});
    }
    std::vector<double> products[2];
    for (const SolverKind kind : {SolverKind::multigrid, SolverKind::live}) {
        const auto solver =
            make_linear_solver({PETSC_COMM_SELF, hierarchy},
                               {two, GetParam().model, Formulation::mixed}, {.kind = kind});
        solver->set_constrained(held);
        solver->set_springs(springs);
        solver->find_mass();
        const PetscHandle<Vec> u = make_vector(solver->fine().share()),
                               p = make_vector(*solver->fine().pressure_space());
        test::fill(solver->fine().share(), bent, u.get());
        {
            WriteArray pressures(p.get());
            for (std::size_t i = 0; i < pressures.span().size(); ++i)
                pressures[i] = 800 * std::sin(3.0 * static_cast<double>(i));
        }
        ElementRotations rotations = solver->fine().make_rotations();
        solver->update_rotations(u.get(), rotations);
        const bool turns = GetParam().model == std::string_view("corotated");
        solver->assemble({u.get(), p.get(), &rotations},
                         {.stiffness = 1.3,
                          .mass = 900,
                          .tangent = turns ? Tangent::frozen_rotation : Tangent::exact});
        PetscHandle<Vec> x, y;
        LIVETET_PETSC(MatCreateVecs(solver->matrix(), x.out(), y.out()));
        {
            WriteArray values(x.get());
            for (std::size_t i = 0; i < values.span().size(); ++i)
                values[i] = i < 3 * held.size() && (held[i / 3] >> (i % 3) & 1)
                                ? 0
                                : std::cos(1.7 * static_cast<double>(i));
        }
        LIVETET_PETSC(MatMult(solver->matrix(), x.get(), y.get()));
        const ReadArray of(y.get());
        products[kind == SolverKind::live].assign(of.span().begin(), of.span().end());
    }
    double largest = 0;
    for (const double v : products[0]) largest = std::max(largest, std::abs(v));
    for (std::size_t i = 0; i < products[0].size(); ++i)
        ASSERT_NEAR(products[1][i], products[0][i], 2e-5 * largest) << i;
}

/// What a prescribed motion adds to the residual: of the tets around constrained nodes alone, and
/// of all of them.
TEST_P(LiveMixed, ProductsOfPrescribedMotionsAreThoseOfAllTets) {
    const TetMesh& mesh = hierarchy.levels.front();
    std::vector<std::uint8_t> held(mesh.nodes.size());
    std::vector<Vector3> bent, moved;
    for (std::size_t i = 0; i < held.size(); ++i) {
        const Vector3& x = mesh.nodes[i];
        held[i] = x.x() < 1e-9 || x.x() > 0.199 ? 7 : 0;
        bent.push_back({0.1 * x.y() * x.z(), 0, -1.5 * x.x() * x.x()});
        moved.push_back(held[i] ? Vector3(0.01, x.y(), -x.z()) : Vector3(0, 0, 0));
    }
    for (const Formulation formulation : {Formulation::displacement, Formulation::mixed}) {
        const auto solver = make_linear_solver({PETSC_COMM_SELF, hierarchy},
                                               {materials, GetParam().model, formulation},
                                               {.kind = SolverKind::live});
        solver->set_constrained(held);
        const LevelAssembler& fine = solver->fine();
        const PetscHandle<Vec> u = make_vector(fine.share()), v = make_vector(fine.share()),
                               of_all = make_vector(fine.share()),
                               of_some = make_vector(fine.share());
        PetscHandle<Vec> p;
        if (fine.pressure_space()) p = make_vector(*fine.pressure_space());
        test::fill(fine.share(), bent, u.get());
        test::fill(fine.share(), moved, v.get());
        ElementRotations rotations = fine.make_rotations();
        solver->update_rotations(u.get(), rotations);
        const Configuration at{u.get(), p.get(), &rotations};
        fine.add_stiffness_times(1.3, at, v.get(), of_all.get());
        fine.add_stiffness_times(1.3, at, v.get(), of_some.get(), Support::constrained);
        PetscReal size = 0, gap = 0;
        LIVETET_PETSC(VecNorm(of_all.get(), NORM_2, &size));
        LIVETET_PETSC(VecAXPY(of_some.get(), -1, of_all.get()));
        LIVETET_PETSC(VecNorm(of_some.get(), NORM_2, &gap));
        EXPECT_GT(size, 0);
        EXPECT_LT(gap, 1e-6 * size);
    }
}

/// Cells ten times as wide as high: the entries of the cycle's 16-bit blocks differ the most.
TEST_P(LiveMixed, SolvesOnFlatTets) {
    const Vector3 size(0.1, 0.1, 0.004);
    hierarchy = make_hierarchy({test::block({10, 10, 4}, size), test::block({5, 5, 2}, size)}, "");
    if (GetParam().has_ten_nodes) hierarchy = with_quadratic_level(std::move(hierarchy));
    const TetMesh& mesh = hierarchy.levels.front();
    Constraints constraints(mesh.nodes.size());
    const auto side = [&](double z) {
        return test::nodes_where(mesh,
                                 [z](const Vector3& x) { return std::abs(x.z() - z) < 1e-9; });
    };
    constraints.prescribe(side(0), Vector3::Zero());
    constraints.prescribe(side(size.z()), Vector3(0.0005, 0, 0));
    int iterations[2];
    for (const SolverKind kind : {SolverKind::multigrid, SolverKind::live}) {
        DeformableBody body(DistributedHierarchy{PETSC_COMM_WORLD, hierarchy},
                            ElasticModel{materials, GetParam().model, Formulation::mixed}, {},
                            {.kind = kind});
        body.set_constraints(constraints);
        const StepReport report = body.advance(0, {.linear_tolerance = 1e-4});
        ASSERT_TRUE(report.converged) << report.reason;
        iterations[kind == SolverKind::live] = report.iterations;
    }
    EXPECT_LE(iterations[1], 8 * iterations[0]);  // one smoothing step instead of six
}

/// Where the body is pressed at constant speed, the steps before leave little to solve.
TEST_P(LiveMixed, GoesOnFromTheStepsBefore) {
    const auto live = body({.kind = SolverKind::live});
    double first = 0;
    StepReport report;
    for (int k = 1; k <= 6; ++k) {
        live->set_constraints(pressed(k / 60.0));
        report = live->advance(0, {.linear_tolerance = 1e-9, .max_iterations = 2});
        if (k == 1) first = report.linear_residual;
    }
    EXPECT_LT(report.linear_residual, 0.3 * first);
    EXPECT_GT(report.linear_error, 0);
}

TEST_P(LiveMixed, ADeadlineThatIsPastLeavesOneIterationAndAUsableIterate) {
    const auto live = body({.kind = SolverKind::live, .threads = 2});
    const StepReport report = live->advance(
        0, {.linear_tolerance = 1e-9, .deadline = Clock::now() - std::chrono::seconds(1)});
    EXPECT_EQ(report.iterations, 1);
    EXPECT_TRUE(report.cut_short);
    EXPECT_TRUE(report.converged);
    for (const Vector3& u : live->displacement())
        ASSERT_TRUE(u.allFinite() && u.norm() < 0.05) << u.transpose();
}

/// Shortened by two fifths, a beam wants to buckle.
TEST_P(LiveMixed, GoesOnWhereTheTangentIsNotPositive) {
    const auto live = body({.kind = SolverKind::live, .threads = 2});
    for (int k = 1; k <= 40; ++k) {
        live->set_constraints(test::shortened_beam(hierarchy.levels.front(), k / 100.0));
        const StepReport report = live->advance(0, {.linear_tolerance = 1e-3});
        ASSERT_TRUE(report.converged) << k << ": " << report.reason;
        ASSERT_FALSE(report.kept_old) << k;
    }
    for (const Vector3& u : live->displacement()) ASSERT_LT(u.norm(), 0.2);
}

INSTANTIATE_TEST_SUITE_P(
    All, LiveMixed,
    testing::Values(MixedCase{"corotated", false, 0.4999}, MixedCase{"linear", false, 0.49},
                    MixedCase{"neohookean", false, 0.499},
                    MixedCase{"mooney_rivlin", false, 0.4999}, MixedCase{"corotated", true, 0.499},
                    MixedCase{"linear", true, 0.4999}, MixedCase{"neohookean", true, 0.4999},
                    MixedCase{"mooney_rivlin", true, 0.49}),
    [](const auto& info) {
        return std::string(info.param.model) +
               (info.param.has_ten_nodes ? "_ten_nodes" : "_four_nodes");
    });

}  // namespace
}  // namespace livetet
