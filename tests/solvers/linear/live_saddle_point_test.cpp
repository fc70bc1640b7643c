// LiveSaddlePoint: live frames of nearly incompressible bodies, with pressures, against the plain
// path. On one rank, as the live solver is.

#include <gtest/gtest.h>

#include <cmath>

#include "mesh/quadratic.hpp"
#include "solvers/linear/linear_solver.hpp"
#include "solvers/nonlinear/deformable_body.hpp"
#include "support/beam_press.hpp"
#include "support/hex_grids.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

struct MixedCase {
    const char* model;
    int nodes;  ///< of a tet, or 8 of a hexahedron
    double poisson;
};

class LiveMixed : public testing::TestWithParam<MixedCase> {
  protected:
    void SetUp() override {
        if (test::rank_count() > 1) GTEST_SKIP() << "the live solver is for one rank";
        // Of more hexahedra than GridCycle factors at once.
        hierarchy = of_elements(GetParam().nodes == 8 ? std::array{12, 6, 6} : std::array{8, 4, 4},
                                test::beam_size);
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

    /// A block in n cells along each axis, or in six tets each, and half as many.
    static MeshHierarchy of_elements(const std::array<int, 3>& n, const Vector3& size) {
        if (GetParam().nodes == 8) return make_hierarchy({test::hex_grid(n, size)}, "a grid");
        MeshHierarchy of_tets = make_hierarchy(
            {test::block(n, size), test::block({n[0] / 2, n[1] / 2, n[2] / 2}, size)}, "a block");
        return GetParam().nodes == 10 ? with_quadratic_level(std::move(of_tets))
                                      : std::move(of_tets);
    }

    MeshHierarchy hierarchy;
    std::vector<Material> materials;
};

/// Those whose plain path has a matrix.
class LiveMixedTets : public LiveMixed {};
/// Those whose plain path has no pressures for unknowns.
class LiveMixedGrids : public LiveMixed {};

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
TEST_P(LiveMixedTets, ProductsAreThoseOfTheAssembledMatrix) {
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

/// Where a displacement is set, a grid's pressures are those that belong to it, as in a body that
/// eliminates them.
TEST_P(LiveMixedGrids, ADisplacementThatIsSetHasItsPressures) {
    std::vector<Vector3> bent;
    for (const Vector3& x : hierarchy.levels.front().nodes)
        bent.push_back({0.1 * x.y() * x.z() + 0.02 * x.x(), 0.05 * x.x(), -1.5 * x.x() * x.x()});
    const auto plain = body({}), live = body({.kind = SolverKind::live});
    for (const auto& each : {plain.get(), live.get()}) each->set_displacement(bent);
    EXPECT_NEAR(live->strain_energy(), plain->strain_energy(), 1e-4 * plain->strain_energy());
}

/// y = A x of x = {v, q}; an empty q is zero.
void multiply(const LinearSolver& solver, const std::vector<Vector3>& v, std::span<const double> q,
              Vec x, Vec y) {
    {
        WriteArray values(x);
        std::fill(values.span().begin(), values.span().end(), 0.0);
        for (std::size_t i = 0; i < v.size(); ++i)
            for (int c = 0; c < 3; ++c) values[3 * i + c] = v[i][c];
        std::copy(q.begin(), q.end(),
                  values.span().begin() + static_cast<std::ptrdiff_t>(3 * v.size()));
    }
    LIVETET_PETSC(MatMult(solver.matrix(), x, y));
}

/// The operator with its pressures eliminated, K + B^T C^-1 B, is that of the plain path: of a bent
/// grid with partial cells, two materials, mass and springs. Sheared cells are no boxes, so that
/// all points count in both.
TEST_P(LiveMixedGrids, ProductsWithEliminatedPressuresAreThoseOfThePlainPath) {
    TetMesh& mesh = hierarchy.levels.front();
    for (Vector3& x : mesh.nodes) x.x() += 0.3 * x.z();
    for (std::size_t e = 0; e < mesh.shares.size(); e += 7) mesh.shares[e] = 0.3;
    for (const Hexahedron& cell : mesh.hexahedra)
        mesh.regions.insert(mesh.regions.end(), tets_per_hexahedron, mesh.nodes[cell[0]].x() > 0.1);
    const std::vector<Material> two{
        {.young_Pa = 3000, .poisson = 0.45, .density_kg_per_m3 = 900},
        {.young_Pa = 9000, .poisson = 0.3, .density_kg_per_m3 = 1200, .region = 1}};
    const ElasticModel model{two, GetParam().model, Formulation::mixed};
    std::vector<std::uint8_t> held(mesh.nodes.size());
    std::vector<double> springs(mesh.nodes.size());
    std::vector<Vector3> bent, moved;
    for (std::size_t i = 0; i < held.size(); ++i) {
        const Vector3& x = mesh.nodes[i];
        held[i] = x.x() < 0.3 * x.z() + 1e-9 ? 7 : 0;
        springs[i] = x.z() < 1e-9 ? 40 : 0;
        bent.push_back({0.1 * x.y() * x.z(), 0.02 * x.y(), -1.5 * x.x() * x.x()});
        moved.push_back(held[i] ? Vector3(0, 0, 0)
                                : Vector3(std::sin(40 * x.y()), x.x(), std::cos(30 * x.x())));
    }
    std::vector<double> products[2];
    for (const SolverKind kind : {SolverKind::automatic, SolverKind::live}) {
        const bool is_live = kind == SolverKind::live;
        const auto solver = make_linear_solver({PETSC_COMM_SELF, hierarchy}, model, {.kind = kind});
        solver->set_constrained(held);
        solver->set_springs(springs);
        solver->find_mass();
        ASSERT_EQ(solver->is_mixed(), is_live);
        const LevelAssembler& fine = solver->fine();
        const PetscHandle<Vec> u = make_vector(fine.share());
        PetscHandle<Vec> p, g;
        test::fill(fine.share(), bent, u.get());
        ElementRotations rotations = fine.make_rotations();
        solver->update_rotations(u.get(), rotations);
        if (is_live) {  // p = lambda theta
            for (PetscHandle<Vec>* v : {&p, &g}) *v = make_vector(*fine.pressure_space());
            const PetscHandle<Vec> f = make_vector(fine.share());
            solver->coupling()->evaluate({u.get(), p.get(), &rotations}, f.get(), g.get());
            solver->coupling()->pressures_of(g.get(), p.get());
        }
        const bool turns = GetParam().model == std::string_view("corotated");
        solver->assemble({u.get(), p.get(), &rotations},
                         {.stiffness = 1,
                          .mass = 900,
                          .tangent = turns ? Tangent::frozen_rotation : Tangent::exact});
        PetscHandle<Vec> x, y;
        LIVETET_PETSC(MatCreateVecs(solver->matrix(), x.out(), y.out()));
        multiply(*solver, moved, {}, x.get(), y.get());
        if (is_live) {  // q = C^-1 B v makes the row of pressures zero
            {
                const ReadArray row(y.get());
                WriteArray volumes(g.get());
                for (std::size_t e = 0; e < volumes.span().size(); ++e)
                    volumes[e] = row[3 * moved.size() + e];
            }
            solver->coupling()->pressures_of(g.get(), p.get());
            LIVETET_PETSC(VecScale(p.get(), 1 / solver->coupling()->scale()));
            multiply(*solver, moved, ReadArray(p.get()).span(), x.get(), y.get());
        }
        const ReadArray of(y.get());
        products[is_live].assign(of.span().begin(),
                                 of.span().begin() + static_cast<std::ptrdiff_t>(3 * moved.size()));
    }
    double largest = 0;
    for (const double v : products[0]) largest = std::max(largest, std::abs(v));
    for (std::size_t i = 0; i < products[0].size(); ++i)
        if (!(held[i / 3] >> (i % 3) & 1)) {
            ASSERT_NEAR(products[1][i], products[0][i], 2e-5 * largest) << i;
        }
}

/// On tets iterations hardly depend on how nearly incompressible the body is. Q1-P0 is not stable:
/// they grow until nu is so near 1/2 that C is nothing beside what little resists a checkerboard.
TEST_P(LiveMixed, IterationsStayBoundedAsPoissonsRatioGrows) {
    int least = 0, most = 0;
    for (const double poisson : {0.3, 0.49, 0.4999, 0.499999}) {
        materials[0].poisson = poisson;
        const auto live = body({.kind = SolverKind::live});
        const StepReport report = live->advance(0, {.linear_tolerance = 1e-6});
        ASSERT_TRUE(report.converged) << report.reason;
        least = least == 0 ? report.iterations : std::min(least, report.iterations);
        most = std::max(most, report.iterations);
    }
    EXPECT_LE(most, (GetParam().nodes == 8 ? 4 : 2) * least);
}

/// Cells ten times as wide as high: the entries of the cycle's 16-bit blocks differ the most.
TEST_P(LiveMixed, SolvesOnFlatTets) {
    const Vector3 size(0.1, 0.1, 0.004);
    hierarchy = of_elements({10, 10, 4}, size);
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
    // One smoothing step instead of six; a grid of so few cells is factored on the plain path.
    EXPECT_LE(iterations[1], GetParam().nodes == 8 ? 35 : 8 * iterations[0]);
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

std::string case_name(const testing::TestParamInfo<MixedCase>& info) {
    const int nodes = info.param.nodes;
    return info.param.model + std::string(nodes == 8    ? "_hexahedra"
                                          : nodes == 10 ? "_ten_nodes"
                                                        : "_four_nodes");
}

const auto cases_of_tets =
    testing::Values(MixedCase{"corotated", 4, 0.4999}, MixedCase{"linear", 4, 0.49},
                    MixedCase{"neohookean", 4, 0.499}, MixedCase{"mooney_rivlin", 4, 0.4999},
                    MixedCase{"corotated", 10, 0.499}, MixedCase{"linear", 10, 0.4999},
                    MixedCase{"neohookean", 10, 0.4999}, MixedCase{"mooney_rivlin", 10, 0.49});

INSTANTIATE_TEST_SUITE_P(Tets, LiveMixed, cases_of_tets, case_name);
INSTANTIATE_TEST_SUITE_P(Tets, LiveMixedTets, cases_of_tets, case_name);
const auto cases_of_grids =
    testing::Values(MixedCase{"corotated", 8, 0.4999}, MixedCase{"linear", 8, 0.499},
                    MixedCase{"neohookean", 8, 0.4999}, MixedCase{"mooney_rivlin", 8, 0.49});

INSTANTIATE_TEST_SUITE_P(Grids, LiveMixed, cases_of_grids, case_name);
INSTANTIATE_TEST_SUITE_P(Grids, LiveMixedGrids, cases_of_grids, case_name);

}  // namespace
}  // namespace livetet
