// What a scene does not need is not built, and not computed again.

#include <gtest/gtest.h>
#include <petscksp.h>

#include "solvers/nonlinear/deformable_body.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

const Material tissue{.young_Pa = 3000, .poisson = 0.4, .density_kg_per_m3 = 1000};
const SolveControls to_the_end{.max_newton = 20, .tolerance = 1e-9, .linear_tolerance = 1e-10};

/// On one rank: what is counted is the same on each.
class LeftOut : public testing::Test {
  protected:
    void SetUp() override {
        const int ranks = test::rank_count();
        if (ranks > 1) GTEST_SKIP() << "counts one rank's";
    }
    std::unique_ptr<DeformableBody> body(const ModelChoice& strain, TimeScheme scheme,
                                         SolverKind kind) const {
        TimeOptions time{.scheme = scheme, .rayleigh_alpha = 0.1, .rayleigh_beta = 0.01};
        return std::make_unique<DeformableBody>(
            DistributedHierarchy{PETSC_COMM_SELF,
                                 kind == SolverKind::direct ? one_level : hierarchy},
            ElasticModel{std::span(&tissue, 1), strain, Formulation::displacement}, time,
            SolverOptions{.kind = kind});
    }
    Constraints pressed(double share, double wider = 0) const {
        const TetMesh& mesh = hierarchy.levels.front();
        Constraints constraints(mesh.nodes.size());
        constraints.prescribe(
            test::nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }),
            Vector3::Zero());
        constraints.prescribe(test::nodes_where(mesh,
                                                [&](const Vector3& x) {
                                                    return x.z() > 0.0999 &&
                                                           std::abs(x.x() - 0.1) < 0.03 + wider;
                                                }),
                              share * Vector3(0, 0.002, -0.01));
        return constraints;
    }
    const MeshHierarchy hierarchy = make_hierarchy(
        {test::block({8, 4, 4}, test::beam_size), test::block({4, 2, 2}, test::beam_size)},
        "a block");
    const MeshHierarchy one_level = make_hierarchy({hierarchy.levels.front()}, "a block");
};

TEST_F(LeftOut, AStaticBodyHasNoMassAndNoVelocities) {
    for (const SolverKind kind : {SolverKind::multigrid, SolverKind::live, SolverKind::direct}) {
        const auto at_rest = body("corotated", TimeScheme::static_equilibrium, kind);
        const auto moving = body("corotated", TimeScheme::newmark, kind);
        for (DeformableBody* b : {at_rest.get(), moving.get()}) {
            b->set_constraints(pressed(1));
            ASSERT_FALSE(b->advance(0.1, {}).kept_old);
        }
        EXPECT_TRUE(at_rest->linear_solver().fine().node_mass().empty());
        EXPECT_EQ(at_rest->costs().solver.mass.bytes, 0);
        EXPECT_EQ(at_rest->costs().velocities.bytes, 0);
        const double nodes = static_cast<double>(hierarchy.levels.front().nodes.size());
        EXPECT_GE(moving->costs().solver.mass.bytes, 8 * nodes);
        EXPECT_GE(moving->costs().velocities.bytes, 3 * 24 * nodes);
    }
}

TEST_F(LeftOut, ALinearBodyComputesNoRotationsAndKeepsNone) {
    for (const SolverKind kind : {SolverKind::multigrid, SolverKind::live}) {
        const auto linear = body("linear", TimeScheme::static_equilibrium, kind);
        const auto corotated = body("corotated", TimeScheme::static_equilibrium, kind);
        for (DeformableBody* b : {linear.get(), corotated.get()}) {
            b->set_constraints(pressed(1));
            (void)b->advance(0, {});
        }
        EXPECT_EQ(linear->costs().solver.rotations.times, 0);
        EXPECT_LT(linear->costs().solver.rotations.bytes,
                  0.02 * corotated->costs().solver.rotations.bytes);
        EXPECT_GT(corotated->costs().solver.rotations.times, 0);
    }
}

/// How often PETSc has factored a matrix so far.
int factorisations() {
    PetscLogEvent event = 0;
    PetscEventPerfInfo info{};
    EXPECT_EQ(PetscLogEventGetId("MatCholFctrNum", &event), 0);
    EXPECT_EQ(PetscLogEventGetPerfInfo(0, event, &info), 0);
    return info.count;
}

TEST_F(LeftOut, ALinearBodyFactorsOnceUntilItsOperatorChanges) {
    ASSERT_EQ(PetscLogDefaultBegin(), 0);
    const auto linear = body("linear", TimeScheme::newmark, SolverKind::direct);
    const auto expect = [&](int more, const char* when, auto&& change) {
        const int before = factorisations();
        change();
        EXPECT_EQ(factorisations() - before, more) << when;
    };
    const auto steps = [&](double dt, int count) {
        for (int k = 0; k < count; ++k) EXPECT_TRUE(linear->solve(dt, to_the_end).converged);
    };
    linear->set_constraints(pressed(0));
    expect(1, "ten steps of one length", [&] {
        for (int k = 1; k <= 10; ++k) {
            linear->set_constraints(pressed(0.1 * k));
            steps(0.02, 1);
        }
    });
    expect(1, "another length", [&] { steps(0.05, 3); });
    expect(1, "other constraints",
           [&] { linear->set_constraints(pressed(1, 0.03)), steps(0.05, 3); });
    expect(1, "springs", [&] {
        const std::size_t nodes = hierarchy.levels.front().nodes.size();
        linear->set_springs(
            {std::vector<double>(nodes, 0.1), std::vector<Vector3>(nodes, Vector3::Zero())});
        steps(0.05, 3);
    });
    const auto turning = body("corotated", TimeScheme::newmark, SolverKind::direct);
    turning->set_constraints(pressed(1));
    const int before = factorisations();
    for (int k = 0; k < 3; ++k) (void)turning->solve(0.02, to_the_end);
    EXPECT_GT(factorisations() - before, 3);
}

/// The kept operator is the one that a new body would have.
TEST_F(LeftOut, ALinearBodyThatKeepsItsOperatorGoesWhereANewOneDoes) {
    for (const SolverKind kind : {SolverKind::multigrid, SolverKind::live, SolverKind::direct}) {
        const auto kept = body("linear", TimeScheme::newmark, kind);
        const auto compare = [&](const Constraints& constraints, double dt) {
            const auto fresh = body("linear", TimeScheme::newmark, kind);
            fresh->copy_state(*kept);
            for (DeformableBody* b : {kept.get(), fresh.get()}) {
                b->set_constraints(constraints);
                (void)b->solve(dt, to_the_end);
            }
            const auto a = kept->displacement(), b = fresh->displacement();
            for (std::size_t i = 0; i < a.size(); ++i)
                ASSERT_LT((a[i] - b[i]).norm(), kind == SolverKind::live ? 2e-7 : 1e-9)
                    << "node " << i;
        };
        for (int k = 1; k <= 3; ++k) compare(pressed(0.3 * k), 0.02);
        compare(pressed(1), 0.05);
        compare(pressed(1, 0.03), 0.05);
        compare(pressed(1, 0.03), 0.02);
    }
}

/// Along a straight way the first load step says what the rest will be.
TEST_F(LeftOut, ALinearBodysLoadStepsGoOnFromTheLast) {
    const auto linear = body("linear", TimeScheme::static_equilibrium, SolverKind::multigrid);
    std::vector<int> iterations;
    for (int k = 1; k <= 4; ++k) {
        linear->set_constraints(pressed(0.25 * k));
        const StepReport report = linear->solve(0, to_the_end);
        EXPECT_TRUE(report.converged);
        iterations.push_back(report.iterations);
    }
    for (int k = 1; k < 4; ++k) EXPECT_LT(2 * iterations[k], iterations[0]) << "step " << k;
}

/// Let go it is nearer to rest by the solves' tolerance in each frame: down to numbers that
/// processors are slow with.
TEST_F(LeftOut, ABodyAtRestIsNotSolvedAnyMore) {
    for (const SolverKind kind : {SolverKind::multigrid, SolverKind::live}) {
        const auto linear = body("linear", TimeScheme::static_equilibrium, kind);
        int iterations = 0;
        for (int frame = 0; frame < 60; ++frame) {
            linear->set_constraints(pressed(frame < 3));
            const int more = linear->advance(0, {}).iterations;
            if (frame >= 40) iterations += more;
        }
        EXPECT_EQ(iterations, 0);
        for (const Vector3& u : linear->displacement()) ASSERT_LT(u.norm(), 1e-15);
    }
}

TEST_F(LeftOut, CoarseOperatorsAreByTheContrast) {
    std::vector<TetMesh> levels = hierarchy.levels;
    for (TetMesh& level : levels)
        for (const Tet& t : level.tets) {
            double z = 0;
            for (const std::int32_t n : t) z += level.nodes[n].z() / 4;
            level.regions.push_back(z > 0.06);
        }
    const MeshHierarchy halves = make_hierarchy(std::move(levels), "two halves");
    const auto coarse_of = [&](double contrast) -> std::string {
        const Material materials[] = {tissue,
                                      {.young_Pa = contrast * tissue.young_Pa,
                                       .poisson = 0.4,
                                       .density_kg_per_m3 = 1000,
                                       .region = 1}};
        DeformableBody two({PETSC_COMM_SELF, halves}, {materials, "linear"},
                           {.scheme = TimeScheme::static_equilibrium},
                           {.kind = SolverKind::multigrid});
        two.set_constraints(pressed(1));
        EXPECT_TRUE(two.solve(0, to_the_end).converged);
        const std::string name = two.linear_solver().name();
        EXPECT_NE(name.find("galerkin") == std::string::npos,
                  name.find("rediscretised") == std::string::npos)
            << name;
        return name.find("galerkin") == std::string::npos ? "rediscretised" : "galerkin";
    };
    EXPECT_EQ(coarse_of(1), "rediscretised");
    EXPECT_EQ(coarse_of(99), "rediscretised");
    EXPECT_EQ(coarse_of(101), "galerkin");
    EXPECT_EQ(coarse_of(1e8), "galerkin");
}

}  // namespace
}  // namespace livetet
