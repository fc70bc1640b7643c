// LiveSaddlePoint: live frames of nearly incompressible bodies, with pressures, against the plain
// path. On one rank: there they live.

#include <gtest/gtest.h>

#include "mesh/quadratic.hpp"
#include "solvers/nonlinear/deformable_body.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"

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
        const TetMesh& mesh = hierarchy.levels.front();
        Constraints constraints(mesh.nodes.size());
        constraints.prescribe(
            test::nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }),
            Vector3::Zero());
        constraints.prescribe(test::nodes_where(mesh,
                                                [](const Vector3& x) {
                                                    return x.z() > 0.0999 &&
                                                           std::abs(x.x() - 0.1) < 0.03 &&
                                                           std::abs(x.y() - 0.05) < 0.03;
                                                }),
                              part * Vector3(0, 0.002, -0.01));
        return constraints;
    }
    /// Pressed slowly, then let go on.
    void follow(DeformableBody& live, const FrameControls& effort, int rest) const {
        for (int k = 1; k <= 10; ++k) {
            live.set_constraints(pressed(k / 10.0));
            (void)live.advance(0, effort);
        }
        for (int frame = 0; frame < rest; ++frame) (void)live.advance(0, effort);
    }
    static double largest_gap(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
        double largest = 0;
        for (std::size_t i = 0; i < a.size(); ++i)
            largest = std::max(largest, (a[i] - b[i]).norm());
        return largest;
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
        EXPECT_LT(largest_gap(live->displacement(), plain->displacement()), 1e-6 * 0.0102)
            << threads << " threads";
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
    EXPECT_LT(largest_gap(live->displacement(), plain->displacement()), 3e-5 * 0.0102);
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
    const TetMesh& mesh = hierarchy.levels.front();
    for (int k = 1; k <= 40; ++k) {
        Constraints shortened(mesh.nodes.size());
        for (const double end : {0.0, 0.2})
            shortened.prescribe(
                test::nodes_where(mesh,
                                  [&](const Vector3& x) { return std::abs(x.x() - end) < 1e-9; }),
                Vector3(-k / 100.0 * end, 0, 0));
        live->set_constraints(shortened);
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
