#include "solvers/linear/single_precision_multigrid.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>

#include <cmath>

#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

/// Two levels of a bent block, clamped at one end; and its finest level in double precision.
class SinglePrecisionMultigridTest : public testing::Test {
  protected:
    void SetUp() override {
        const int ranks = test::rank_count();
        if (ranks > 1) GTEST_SKIP() << "it is for one rank";
        for (std::size_t l = 0; l < 2; ++l) {
            const TetMesh& mesh = hierarchy.levels[l];
            levels.push_back(make(mesh, SinglePrecision{}));
            std::vector<std::uint8_t> held(mesh.nodes.size(), 0);
            for (const std::int32_t n :
                 test::nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }))
                held[n] = 7;
            levels.back()->set_constrained(held);
            if (l == 0) plain->set_constrained(held);
        }
        n = 3 * static_cast<Eigen::Index>(hierarchy.levels.front().nodes.size());
        u = make_vector(plain->share());
        std::vector<Vector3> bent;
        for (const Vector3& x : hierarchy.levels.front().nodes)
            bent.push_back({0, x.x() * x.z(), -2 * x.x() * x.x()});
        test::fill(plain->share(), bent, u.get());
        rotations = levels.front()->make_rotations();
        levels.front()->update_rotations(u.get(), rotations);
        multigrid = std::make_unique<SinglePrecisionMultigrid>(
            std::vector<LevelAssembler*>{levels[0].get(), levels[1].get()},
            std::vector<const BarycentricMap*>{&hierarchy.transfers.front()}, 1,
            ThreadTeam::alone());
        multigrid->set_constrained();
        multigrid->update(rotations, 1, 0);
    }
    std::unique_ptr<LevelAssembler> make(const TetMesh& mesh, LevelStorage storage) {
        return std::make_unique<LevelAssembler>(distribute_mesh(PETSC_COMM_SELF, mesh, {}),
                                                materials, "corotated", Formulation::displacement,
                                                storage);
    }
    Eigen::VectorXd wave(double frequency) const {
        Eigen::VectorXd x(n);
        for (Eigen::Index i = 0; i < n; ++i)
            x[i] = levels.front()->constrained()[i / 3]
                       ? 0
                       : std::sin(frequency * static_cast<double>(i));
        return x;
    }
    Eigen::VectorXd times(const Eigen::VectorXd& x) {
        Eigen::VectorXd y(n);
        multigrid->multiply(std::span(x.data(), n), std::span(y.data(), n));
        return y;
    }
    Eigen::VectorXd cycle(const Eigen::VectorXd& r) {
        Eigen::VectorXd z(n);
        multigrid->cycle(std::span(r.data(), n), std::span(z.data(), n));
        return z;
    }

    const MeshHierarchy hierarchy = make_hierarchy(
        {test::block({10, 5, 5}, test::beam_size), test::block({5, 3, 3}, test::beam_size)}, "");
    const std::vector<Material> materials{{.young_Pa = 4000, .poisson = 0.45}};
    std::unique_ptr<LevelAssembler> plain = make(hierarchy.levels.front(), MatrixLayout::scalars);
    std::vector<std::unique_ptr<LevelAssembler>> levels;
    ElementRotations rotations;
    PetscHandle<Vec> u;
    std::unique_ptr<SinglePrecisionMultigrid> multigrid;
    Eigen::Index n = 0;
};

TEST_F(SinglePrecisionMultigridTest, ItsOperatorIsTheOneInDoublePrecision) {
    ElementRotations in_double = plain->make_rotations();
    update_ghosts(u.get());
    plain->update_rotations(u.get(), in_double);
    plain->assemble({.u = u.get(), .rotations = &in_double}, {});
    const Eigen::VectorXd x = wave(0.7), got = times(x);
    const PetscHandle<Vec> in = make_vector(plain->share()), out = make_vector(plain->share());
    {
        WriteArray values(in.get());
        for (Eigen::Index i = 0; i < n; ++i) values[i] = x[i];
    }
    LIVETET_PETSC(MatMult(plain->matrix(), in.get(), out.get()));
    const ReadArray expected(out.get());
    double size = 0, error = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
        size += expected[i] * expected[i];
        error += (got[i] - expected[i]) * (got[i] - expected[i]);
    }
    EXPECT_LT(std::sqrt(error / size), 1e-3);  // blocks have 16 bits
}

TEST_F(SinglePrecisionMultigridTest, TheCycleIsSymmetricPositiveAndHalvesTheError) {
    const Eigen::VectorXd r = wave(0.3), s = wave(1.9);
    const Eigen::VectorXd by_r = cycle(r), by_s = cycle(s);
    EXPECT_NEAR(s.dot(by_r), r.dot(by_s), 1e-4 * std::sqrt(r.dot(by_r) * s.dot(by_s)));
    EXPECT_GT(r.dot(by_r), 0);
    // x <- x + B (b - A x) on an error made of all frequencies, in the energy's norm
    Eigen::VectorXd e = wave(0.05) + wave(1.1);
    const double before = e.dot(times(e));
    for (int k = 0; k < 4; ++k) e -= cycle(times(e));
    EXPECT_LT(std::sqrt(e.dot(times(e)) / before), std::pow(0.75, 4));
}

TEST_F(SinglePrecisionMultigridTest, TwoHalfRenewalsMakeAWholeOne) {
    std::vector<Vector3> more;
    for (const Vector3& x : hierarchy.levels.front().nodes)
        more.push_back({0, 2 * x.x() * x.z(), -3 * x.x() * x.x()});
    test::fill(plain->share(), more, u.get());
    levels.front()->update_rotations(u.get(), rotations);
    const Eigen::VectorXd x = wave(0.7), old = times(x);
    EXPECT_EQ(multigrid->update(rotations, 1, 0, RenewalExtent::half), RenewalExtent::half);
    const Eigen::VectorXd half = times(x);
    multigrid->update(rotations, 1, 0, RenewalExtent::half);
    const Eigen::VectorXd both = times(x);
    EXPECT_EQ(multigrid->update(rotations, 1, 0), RenewalExtent::whole);
    const Eigen::VectorXd whole = times(x);
    EXPECT_GT((half - old).norm(), 1e-3 * old.norm());
    EXPECT_GT((whole - half).norm(), 1e-3 * old.norm());
    EXPECT_LT((whole - both).norm(), 1e-6 * old.norm());
}

}  // namespace
}  // namespace livetet
