// Patterns of forces: totals, transposes, supports.

#include "solvers/inverse/force_basis.hpp"

#include <gtest/gtest.h>

#include "base/error.hpp"
#include "solvers/inverse/block_fixture.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

class ForceBasisTest : public testing::Test {
  protected:
    static Vector3 sum(const std::vector<Vector3>& f) {
        Vector3 s = Vector3::Zero();
        for (const Vector3& v : f) s += v;
        return s;
    }
    const TetMesh mesh = test::block({6, 6, 2}, Vector3(0.12, 0.12, 0.04));
    const std::vector<std::int32_t> top =
        test::nodes_where(mesh, [](const Vector3& x) { return x.z() > 0.039; });
};

TEST_F(ForceBasisTest, TotalIsTheSumOfTheNodalForces) {
    for (const ForceBasis& basis : {uniform_forces(top), smooth_forces(mesh.nodes, top, 5)}) {
        Eigen::VectorXd p(static_cast<Eigen::Index>(basis.size()));
        for (Eigen::Index j = 0; j < p.size(); ++j) p[j] = 0.3 * static_cast<double>(j) - 1;
        EXPECT_LT((sum(basis.force(p, mesh.nodes.size())) - basis.total(p)).norm(), 1e-12);
    }
}

TEST_F(ForceBasisTest, UniformForcesAreEqualAtEachNode) {
    const auto f = uniform_forces(top).force(Eigen::Vector3d(1, -2, 3), mesh.nodes.size());
    const Vector3 one = Vector3(1, -2, 3) / static_cast<double>(top.size());
    for (const std::int32_t n : top) EXPECT_LT((f[n] - one).norm(), 1e-15);
    EXPECT_LT((sum(f) - Vector3(1, -2, 3)).norm(), 1e-12);
}

TEST_F(ForceBasisTest, ProjectionIsTheTranspose) {
    const ForceBasis basis = smooth_forces(mesh.nodes, top, 4);
    ASSERT_EQ(basis.size(), 12U);
    const Eigen::VectorXd p = Eigen::VectorXd::LinSpaced(12, -1, 2);
    const auto f = basis.force(p, mesh.nodes.size());
    double work = 0;
    for (std::size_t n = 0; n < f.size(); ++n) work += f[n].dot(mesh.nodes[n]);
    const Eigen::VectorXd places = test::as_column(mesh.nodes);
    EXPECT_NEAR(p.dot(basis.project(places).col(0)), work, 1e-14);
    EXPECT_NEAR((basis.matrix(mesh.nodes.size()) * p).dot(places), work, 1e-14);
}

TEST_F(ForceBasisTest, SmoothForcesReachEveryNodeAndNoOther) {
    const ForceBasis basis = smooth_forces(mesh.nodes, top, 6);
    const auto f = basis.force(Eigen::VectorXd::Ones(18), mesh.nodes.size());
    for (std::size_t n = 0; n < f.size(); ++n)
        EXPECT_EQ(f[n].minCoeff() > 0, mesh.nodes[n].z() > 0.039);
}

TEST_F(ForceBasisTest, ACentreAtEachNodeGivesNodalForces) {
    const std::vector<std::int32_t> few(top.begin(), top.begin() + 4);
    const ForceBasis basis = smooth_forces(mesh.nodes, few, few.size());
    for (std::size_t j = 0; j < basis.size(); ++j) EXPECT_EQ(basis.column(j).nodes.size(), 1U);
}

TEST_F(ForceBasisTest, RefusesPatternsWithoutForce) {
    ForceBasis basis;
    const std::vector<double> none{1, -1}, one{1};
    EXPECT_THROW(basis.add_pattern(std::span(top).first(2), none), Error);
    EXPECT_THROW(basis.add_pattern(std::span(top).first(2), one), Error);
    EXPECT_THROW(smooth_forces(mesh.nodes, std::span(top).first(2), 3), Error);
    EXPECT_THROW(smooth_forces(mesh.nodes, top, 0), Error);
}

}  // namespace
}  // namespace livetet
