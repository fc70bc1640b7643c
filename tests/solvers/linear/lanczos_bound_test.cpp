// Bounds of eigenvalues for Chebyshev's smoothing.

#include "solvers/linear/lanczos_bound.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "mesh/hex_hierarchy.hpp"
#include "solvers/assembly/level_assembler.hpp"
#include "solvers/linear/hex_multigrid.hpp"
#include "support/hex_grids.hpp"
#include "support/ranks.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

/// B A = diag(values), with B = diag(1, 2, 1, 2, ...).
struct DiagonalGradients {
    Eigen::VectorXd values, r, p, w;

    explicit DiagonalGradients(const Eigen::VectorXd& v) : values(v), r(v), p(v), w(v) {
        RoughValues rough;
        for (double& x : r) x = rough.next();
        p.setZero();
    }
    static double b(Eigen::Index i) { return 1.0 + static_cast<double>(i % 2); }
    double residual() {
        for (Eigen::Index i = 0; i < r.size(); ++i) w[i] = b(i) * r[i];
        return r.dot(w);
    }
    void turn(double beta) { p = w + beta * p; }
    double curvature() {
        for (Eigen::Index i = 0; i < r.size(); ++i) w[i] = values[i] / b(i) * p[i];
        return p.dot(w);
    }
    void advance(double alpha) { r -= alpha * w; }
};

/// 0.01 to 2.8 evenly, and 4.1: power iteration is at 2.9 after 14 steps. A smoother for that
/// amplifies what belongs to 4.1.
TEST(LanczosBound, FindsALoneEigenvalueInFewSteps) {
    constexpr Eigen::Index size = 20000;
    Eigen::VectorXd values = Eigen::VectorXd::LinSpaced(size, 0.01, 2.8);
    values[size / 3] = 4.1;
    DiagonalGradients gradients(values);
    const double found = lanczos_bound(bound_steps, gradients);
    EXPECT_GT(found, 4.1 / 1.05);
    EXPECT_LE(found, 4.1 * (1 + 1e-12)) << "it comes from below";
}

TEST(LanczosBound, OfNothingIsNothing) {
    DiagonalGradients gradients(Eigen::VectorXd::Zero(5));
    EXPECT_EQ(lanczos_bound(bound_steps, gradients), 0);
    DiagonalGradients three(Eigen::VectorXd::Constant(5, 3));
    EXPECT_NEAR(lanczos_bound(bound_steps, three), 3, 1e-12) << "all is said after one step";
}

/// The bounds are those of the first operator. One whose diagonal weighs far less has higher ones:
/// its cycle is not positive until they are taken anew.
TEST(HexMultigrid, TakesSurerBoundsWhereItsCycleIsNotPositive) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    const TetMesh grid = test::hex_grid({12, 12, 12}, {0.1, 0.1, 0.1});
    const MeshHierarchy hierarchy = make_hierarchy({grid}, "a grid");
    const std::vector<Material> materials{{.young_Pa = 3000, .poisson = 0.4}};
    const LevelAssembler level(distribute_mesh(PETSC_COMM_SELF, hierarchy.levels.front(), {}),
                               materials, "linear", Formulation::displacement, GeometryOnly{});
    HexCells cells;
    cells.frame = level.element(0);
    cells.frame.volume = cell_volume(grid);
    cells.shares = grid.shares;
    cells.moduli = {level.lame_moduli(0)};
    cells.material.assign(grid.hexahedra.size(), 0);
    HexMultigrid multigrid(hex_levels(grid, 30), cells, 4);
    const std::size_t nodes = grid.nodes.size();
    multigrid.set_constrained(std::vector<std::uint8_t>(nodes, 0));
    multigrid.update(1, std::vector<double>(nodes, 1e6), {});
    multigrid.update(1, std::vector<double>(nodes, 1), {});
    const auto least_positive = [&] {
        double least = 1;
        for (unsigned seed = 1; seed < 6; ++seed) {
            std::vector<double> r, z(3 * nodes);
            for (const Vector3& x : test::rough_values(nodes, 1, seed))
                r.insert(r.end(), x.begin(), x.end());
            multigrid.cycle(r, z);
            const Eigen::Map<const Eigen::VectorXd> of_r(r.data(), 3 * nodes),
                of_z(z.data(), 3 * nodes);
            least = std::min(least, of_r.dot(of_z) / (of_r.norm() * of_z.norm()));
        }
        return least;
    };
    EXPECT_LT(least_positive(), 0);
    EXPECT_TRUE(multigrid.take_surer_bounds());
    EXPECT_GT(least_positive(), 0);
    EXPECT_FALSE(multigrid.take_surer_bounds()) << "they are sure now";
}

}  // namespace
}  // namespace livetet
