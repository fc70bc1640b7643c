// What a program gives a body wrongly ends in an Error that says so, on every rank.

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "solvers/nonlinear/deformable_body.hpp"
#include "solvers/parallel/partition.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

std::string body_refusal(const std::function<void()>& work) {
    try {
        work();
    } catch (const Error& e) {
        return e.what();
    }
    return "accepted";
}

MeshHierarchy two_levels() {
    return make_hierarchy(
        {test::block({6, 3, 3}, test::beam_size), test::block({3, 2, 2}, test::beam_size)}, "");
}

std::string refusal_of(const Material& material) {
    const MeshHierarchy hierarchy = two_levels();
    return body_refusal([&] {
        DeformableBody({PETSC_COMM_SELF, hierarchy}, {{&material, 1}}, {}, {});
    });
}

/// Before main has made a session.
const std::string without_session = refusal_of({});

TEST(BadInput, ABodyNeedsASession) {
    EXPECT_EQ(without_session,
              "a DeformableBody needs PETSc: found no PetscSession, expected one made before");
}

TEST(BadInput, MaterialsAreCheckedAsThoseOfAScene) {
    EXPECT_EQ(refusal_of({}), "accepted");
    EXPECT_EQ(refusal_of({.young_Pa = -1}), "materials[0].young_Pa = -1 Pa must be greater than 0");
    EXPECT_NE(refusal_of({.young_Pa = 0}), "accepted");
    EXPECT_NE(refusal_of({.young_Pa = std::nan("")}), "accepted");
    EXPECT_NE(refusal_of({.density_kg_per_m3 = -1}), "accepted");
    for (const double poisson : {0.5, 0.7})
        EXPECT_EQ(refusal_of({.poisson = poisson}).find("materials[0].poisson = 0."), 0u);
    const MeshHierarchy hierarchy = two_levels();
    EXPECT_EQ(body_refusal([&] {
                  DeformableBody({PETSC_COMM_SELF, hierarchy}, {}, {}, {});
              }),
              "materials: found none, expected at least one");
    const Material soft;
    EXPECT_EQ(body_refusal([&] {
                  DeformableBody({PETSC_COMM_SELF, hierarchy}, {{&soft, 1}, ModelChoice()}, {}, {});
              }),
              "materials[0] and its body name no constitutive model, expected one");
}

TEST(BadInput, OptionsAreCheckedAsThoseOfAScene) {
    const MeshHierarchy hierarchy = two_levels();
    const Material soft;
    EXPECT_EQ(body_refusal([&] {
                  DeformableBody({PETSC_COMM_SELF, hierarchy}, {{&soft, 1}}, {.beta = 0}, {});
              }),
              "time.beta = 0 must be above 0 and at most 1");
    EXPECT_EQ(
        body_refusal([&] {
            DeformableBody({PETSC_COMM_SELF, hierarchy}, {{&soft, 1}}, {}, {.max_iterations = 0});
        }),
        "solver.max_iterations = 0 must be at least 1");
}

TEST(BadInput, MeshesAreCheckedThatMakeHierarchyHasNotSeen) {
    const Material soft;
    const auto refused = [&](const MeshHierarchy& hierarchy) {
        return body_refusal([&] {
            DeformableBody({PETSC_COMM_SELF, hierarchy}, {{&soft, 1}}, {}, {});
        });
    };
    EXPECT_NE(refused({}), "accepted");
    MeshHierarchy inverted = two_levels();
    std::swap(inverted.levels[0].tets[3][0], inverted.levels[0].tets[3][1]);
    EXPECT_NE(refused(inverted).find("mesh hierarchy, level 0: tet 3"), std::string::npos);
    MeshHierarchy unconnected = two_levels();
    unconnected.transfers.clear();
    EXPECT_NE(refused(unconnected), "accepted");
}

TEST(BadInput, SeveralRanksNeedAPartOfEachTet) {
    const int ranks = test::rank_count();
    if (ranks == 1) GTEST_SKIP() << "one rank needs no parts";
    const Material soft;
    const MeshHierarchy hierarchy = two_levels();
    auto parts = partition_levels(PETSC_COMM_WORLD, hierarchy, Partitioner::metis);
    const auto refused = [&](SolverKind kind = SolverKind::automatic) {
        return body_refusal([&] {
            DeformableBody({PETSC_COMM_WORLD, hierarchy, parts}, {{&soft, 1}}, {}, {.kind = kind});
        });
    };
    EXPECT_EQ(refused(), "accepted");
    EXPECT_EQ(refused(SolverKind::live),
              fmt::format("solver.kind = live: found {} ranks, expected one", ranks));
    parts[0][3] = ranks;
    EXPECT_NE(refused().find("found parts 0 to"), std::string::npos);
    parts[0].pop_back();
    EXPECT_NE(refused().find("found parts of "), std::string::npos);
    parts.clear();
    EXPECT_NE(refused().find("found parts of 0 levels"), std::string::npos);
}

static_assert(!std::is_constructible_v<DistributedHierarchy, MPI_Comm, MeshHierarchy>,
              "a body would read the temporary hierarchy after its end");

class BadCall : public testing::Test {
  protected:
    explicit BadCall(const TimeOptions& time = {})
        : body({PETSC_COMM_WORLD, hierarchy, parts}, {{&soft, 1}}, time,
               {.kind = SolverKind::multigrid}) {
        Constraints constraints(mesh.nodes.size());
        constraints.prescribe(held, Vector3::Zero());
        constraints.prescribe(pressed, {0, 0, -0.001});
        body.set_constraints(constraints);
    }
    const MeshHierarchy hierarchy = two_levels();
    const std::vector<std::vector<std::int32_t>> parts =
        partition_levels(PETSC_COMM_WORLD, hierarchy, Partitioner::metis);
    const TetMesh& mesh = hierarchy.levels.front();
    const std::vector<std::int32_t> held =
        test::nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; });
    const std::vector<std::int32_t> pressed =
        test::nodes_where(mesh, [](const Vector3& x) { return x.x() > 0.1999; });
    const Material soft;
    test::WholeBody body;
};

class BadDynamicCall : public BadCall {
  protected:
    BadDynamicCall() : BadCall({.scheme = TimeScheme::newmark}) {}
};

TEST_F(BadCall, SizesAreChecked) {
    if (test::rank_count() > 1) GTEST_SKIP() << "on several ranks sizes are of a rank's nodes";
    DeformableBody& body = this->body;
    const std::size_t nodes = mesh.nodes.size();
    const std::vector<Vector3> few(10, Vector3::Zero());
    EXPECT_EQ(body_refusal([&] { body.set_constraints(Constraints(10)); }),
              fmt::format("set_constraints: components: found 10 values, expected {}, one for each "
                          "node",
                          nodes));
    Constraints half(nodes);
    half.values.resize(10);
    EXPECT_NE(body_refusal([&] { body.set_constraints(half); }), "accepted");
    EXPECT_NE(body_refusal([&] { body.set_external_force(few); }), "accepted");
    EXPECT_EQ(body_refusal([&] { body.set_external_force({}); }), "accepted");
    EXPECT_NE(body_refusal([&] { body.set_displacement(few); }), "accepted");
    EXPECT_NE(body_refusal([&] {
                  body.set_springs({std::vector<double>(nodes, 1), few});
              }),
              "accepted");
    EXPECT_NE(body_refusal([&] {
                  body.set_springs({std::vector<double>(10, 1), few});
              }),
              "accepted");
    EXPECT_TRUE(body.solve(0, {}).converged) << "a refused call has changed something";
}

TEST_F(BadCall, OnlyConstrainedNodesMove) {
    if (test::rank_count() > 1) GTEST_SKIP() << "on several ranks nodes have a rank's numbers";
    DeformableBody& body = this->body;
    const std::vector<Vector3> one{Vector3(0, 0, -0.002)};
    const auto moved = [&](std::int32_t n) {
        return body_refusal([&] { body.move_constraints(std::span(&n, 1), one); });
    };
    const auto count = static_cast<std::int32_t>(mesh.nodes.size());
    const std::int32_t free =
        test::nodes_where(mesh, [](const Vector3& x) { return x.x() > 0.09; }).front();
    EXPECT_EQ(moved(pressed.front()), "accepted");
    EXPECT_EQ(moved(free), fmt::format("move_constraints: node {} is not constrained: call "
                                       "set_constraints first",
                                       free));
    EXPECT_NE(moved(-1), "accepted");
    EXPECT_NE(moved(count), "accepted");
    EXPECT_EQ(body_refusal([&] { body.move_constraints(pressed, one); }),
              fmt::format("move_constraints: found 1 values, expected {}, one for each node given",
                          pressed.size()));
}

TEST_F(BadCall, AStaticBodyHasNoVelocity) {
    const std::vector<Vector3> rest(mesh.nodes.size(), Vector3::Zero());
    EXPECT_EQ(body_refusal([&] { (void)body.velocity(); }),
              "velocity: a static body has no velocity, expected a dynamic TimeOptions::scheme");
    EXPECT_NE(body_refusal([&] { body.set_velocity(rest); }), "accepted");
    EXPECT_TRUE(body.solve(0, {}).converged) << "dt is not used";
}

TEST_F(BadCall, AStateOfAnotherSchemeIsRefused) {
    EXPECT_NE(body_refusal([&] { body.return_to_kept_state(); }), "accepted");
    test::WholeBody moving({PETSC_COMM_WORLD, hierarchy, parts}, {{&soft, 1}},
                           {.scheme = TimeScheme::newmark}, {.kind = SolverKind::multigrid});
    EXPECT_NE(body_refusal([&] { moving.copy_state(body); }), "accepted");
    EXPECT_NE(body_refusal([&] { body.copy_state(moving); }), "accepted");
}

TEST_F(BadCall, ValuesThatAreNotFiniteKeepTheOldState) {
    ASSERT_TRUE(body.solve(0, {}).converged);
    const std::vector<Vector3> before = body.displacement();
    std::vector<Vector3> values(pressed.size(), Vector3(0, 0, -0.002));
    for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
        values.back().z() = bad;
        body.move_constraints(pressed, values);
        for (const StepReport& report : {body.advance(0, {}), body.solve(0, {})}) {
            EXPECT_TRUE(report.kept_old && !report.converged);
            EXPECT_STREQ(report.reason, "a prescribed displacement is not finite");
        }
    }
    EXPECT_EQ(body.displacement(), before);
    values.back().z() = -0.002;
    body.move_constraints(pressed, values);
    EXPECT_TRUE(body.solve(0, {}).converged);
}

TEST_F(BadCall, ABodyThatIsNotHeldSaysSo) {
    body.set_constraints(Constraints(mesh.nodes.size()));
    body.set_external_force(std::vector<Vector3>(mesh.nodes.size(), Vector3(1e9, 0, 0)));
    const StepReport report = body.advance(0, {});
    EXPECT_TRUE(report.kept_old);
    EXPECT_NE(std::string_view(report.reason), "");
}

TEST_F(BadDynamicCall, AStepNeedsALength) {
    EXPECT_TRUE(body.solve(0.01, {}).converged);
    for (const double dt : {0.0, -0.01, std::nan("")}) {
        EXPECT_NE(body_refusal([&] { (void)body.advance(dt, {}); }), "accepted") << dt;
        EXPECT_NE(body_refusal([&] { (void)body.solve(dt, {}); }), "accepted") << dt;
    }
    EXPECT_EQ(body_refusal([&] { (void)body.solve(0, {}); }),
              "time step: found 0 s, expected more than 0 s in a dynamic body");
    EXPECT_EQ(body.velocity().size(), mesh.nodes.size());
    DeformableBody& plain = body;
    EXPECT_NE(body_refusal([&] { plain.set_velocity(std::vector<Vector3>(3, Vector3::Zero())); }),
              "accepted");
}

}  // namespace
}  // namespace livetet
