// The operator without a matrix, and the cycle for tets of ten nodes.

#include "solvers/linear/quadratic_cycle.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>

#include <cmath>

#include "mesh/quadratic.hpp"
#include "support/cycles.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

/// A bent block of ten-node tets, clamped at one end, on springs at the other, with mass.
class QuadraticCycleTest : public testing::TestWithParam<const char*> {
  protected:
    static constexpr double s = 1.2, m = 3e4;

    void SetUp() override {
        if (test::rank_count() > 1) GTEST_SKIP() << "it is for one rank";
        for (std::size_t l = 0; l < hierarchy.levels.size(); ++l)
            levels.push_back(make(l, SinglePrecision{}, l == 0 ? GetParam() : "corotated"));
        prepare(*plain, hierarchy.levels[0]);
        for (std::size_t l = 0; l < levels.size(); ++l) prepare(*levels[l], hierarchy.levels[l]);
        n = 3 * static_cast<Eigen::Index>(hierarchy.levels.front().nodes.size());
        u = make_vector(plain->share());
        bend(0, 1);
        auto multigrid = std::make_unique<SinglePrecisionMultigrid>(
            std::vector<LevelAssembler*>{levels[1].get(), levels[2].get()},
            std::vector<const BarycentricMap*>{&hierarchy.transfers[1]}, 1, ThreadTeam::alone());
        operator_ = std::make_unique<MatrixFreeOperator>(*levels[0], ThreadTeam::alone());
        cycle = std::make_unique<QuadraticCycle>(*operator_, *levels[1], std::move(multigrid),
                                                 hierarchy.transfers[0], 1, ThreadTeam::alone());
        cycle->set_constrained();
        operator_->set_constrained();
        operator_->update(rotations, s, m);
        (void)cycle->update(rotations, s, m, RenewalExtent::whole);
    }
    /// Draws the block by this part of its size, and bends it to this part.
    void bend(double drawn, double bent) {
        std::vector<Vector3> values;
        for (const Vector3& x : hierarchy.levels.front().nodes)
            values.push_back(
                drawn * x + bent * Vector3(0.3 * x.x() * x.y(), x.x() * x.z(), -2 * x.x() * x.x()));
        test::fill(plain->share(), values, u.get());
        rotations = levels[0]->make_rotations();
        levels[0]->update_rotations(u.get(), rotations);
    }
    std::unique_ptr<LevelAssembler> make(std::size_t l, LevelStorage storage, const char* model) {
        const TetMesh& mesh = hierarchy.levels[l];
        return std::make_unique<LevelAssembler>(distribute_mesh(PETSC_COMM_SELF, mesh, {}),
                                                materials, model, Formulation::displacement,
                                                storage);
    }
    static void prepare(LevelAssembler& level, const TetMesh& mesh) {
        std::vector<std::uint8_t> held;
        std::vector<double> springs;
        for (const Vector3& x : mesh.nodes) {
            held.push_back(x.x() < 1e-9 ? 7 : 0);
            springs.push_back(x.x() > 0.1999 ? 5.0 : 0.0);
        }
        level.set_constrained(held);
        level.set_springs(springs);
        level.find_mass();
    }
    Eigen::VectorXd wave(double frequency) const { return test::wave(*levels[0], frequency); }
    Eigen::VectorXd times(const Eigen::VectorXd& x) {
        Eigen::VectorXd y(n);
        operator_->multiply(std::span(x.data(), n), std::span(y.data(), n));
        return y;
    }
    Eigen::VectorXd cycled(const Eigen::VectorXd& r) { return test::cycled(*cycle, r); }

    const MeshHierarchy hierarchy = with_quadratic_level(make_hierarchy(
        {test::block({8, 4, 4}, test::beam_size), test::block({4, 2, 2}, test::beam_size)}, ""));
    const std::vector<Material> materials{
        {.young_Pa = 4000, .poisson = 0.45, .density_kg_per_m3 = 1000}};
    std::unique_ptr<LevelAssembler> plain = make(0, MatrixLayout::scalars, GetParam());
    std::vector<std::unique_ptr<LevelAssembler>> levels;
    ElementRotations rotations;
    PetscHandle<Vec> u;
    std::unique_ptr<MatrixFreeOperator> operator_;
    std::unique_ptr<QuadraticCycle> cycle;
    Eigen::Index n = 0;
};

TEST_P(QuadraticCycleTest, TheOperatorIsTheAssembledOne) {
    if (std::string_view(GetParam()) == "neohookean") {
        bend(0.02, 0.02);  // where nothing is pressed, its tangent is not bounded
        operator_->update(rotations, s, m);
    }
    ElementRotations plain_rotations = plain->make_rotations();
    plain->update_rotations(u.get(), plain_rotations);
    const bool corotated = std::string_view(GetParam()) == "corotated";
    plain->assemble({.u = u.get(), .rotations = &plain_rotations},
                    {.stiffness = s,
                     .mass = m,
                     .tangent = corotated ? Tangent::frozen_rotation : Tangent::exact});
    const auto x = make_vector(plain->share()), y = make_vector(plain->share());
    const Eigen::VectorXd values = wave(0.7);
    std::copy_n(values.data(), n, WriteArray(x.get()).span().data());
    LIVETET_PETSC(MatMult(plain->matrix(), x.get(), y.get()));
    const ReadArray expected(y.get());
    const Eigen::VectorXd got = times(values);
    const double largest = got.lpNorm<Eigen::Infinity>();
    ASSERT_GT(largest, 0);
    for (Eigen::Index i = 0; i < n; ++i) ASSERT_NEAR(got[i], expected[i], 1e-5 * largest) << i;
}

TEST_P(QuadraticCycleTest, TheCycleIsSymmetricAndPositive) {
    const Eigen::VectorXd a = wave(0.7), b = wave(1.9), Ca = cycled(a), Cb = cycled(b);
    EXPECT_NEAR(b.dot(Ca), a.dot(Cb), 1e-4 * std::sqrt(a.dot(Ca) * b.dot(Cb)));
    EXPECT_GT(a.dot(Ca), 0);
    EXPECT_GT(b.dot(Cb), 0);
}

/// Iterations x += C (b - A x): what a cycle leaves of the residual.
TEST_P(QuadraticCycleTest, TheCycleWithConjugateGradientsReducesTheResidualFast) {
    const Eigen::VectorXd b = times(wave(0.01));
    Eigen::VectorXd x = Eigen::VectorXd::Zero(n), r = b, z = cycled(r), p = z;
    double rz = r.dot(z);
    for (int k = 0; k < 12; ++k) {
        const Eigen::VectorXd Ap = times(p);
        const double length = rz / p.dot(Ap);
        x += length * p;
        r -= length * Ap;
        z = cycled(r);
        const double next = r.dot(z);
        p = z + next / rz * p;
        rz = next;
    }
    EXPECT_LT(r.norm(), 3e-3 * b.norm());
}

INSTANTIATE_TEST_SUITE_P(Laws, QuadraticCycleTest,
                         testing::Values("linear", "corotated", "neohookean"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace livetet
