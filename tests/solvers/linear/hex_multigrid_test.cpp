// The operator and the bounds of a grid's multigrid. Its cycle is tested with HexSolver.

#include "solvers/linear/hex_multigrid.hpp"

#include <gtest/gtest.h>

#include "mesh/hex_hierarchy.hpp"
#include "support/hex_grids.hpp"
#include "support/level_forces.hpp"
#include "support/ranks.hpp"

namespace livetet {
namespace {

/// Of one material, given by lambda and mu, Pa.
HexCells cells_of(const TetMesh& grid, std::pair<double, double> moduli) {
    const LevelAssembler level(distribute_mesh(PETSC_COMM_SELF, grid, {}),
                               std::vector<Material>{{}}, "linear", Formulation::displacement,
                               GeometryOnly{});
    HexCells cells;
    cells.frame = level.element(0);
    cells.frame.volume = cell_volume(grid);
    cells.shares = grid.shares;
    cells.moduli = {moduli};
    cells.material.assign(grid.hexahedra.size(), 0);
    return cells;
}

/// Where cells have dilations of their own, they take the place of the volume's part of the
/// reference stiffness: V lambda b b^T by each cell's share.
TEST(HexMultigrid, TakesTheDilationsOfCells) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    TetMesh grid = test::hex_grid({3, 2, 2}, {0.03, 0.02, 0.02});
    grid.shares[4] = 0.4;
    const std::size_t nodes = grid.nodes.size(), count = grid.hexahedra.size();
    constexpr double lambda = 20000, mu = 1000;
    const auto product = [&](double lambda_of_cells, std::span<const CellDilation> dilations) {
        HexCells cells = cells_of(grid, {lambda_of_cells, mu});
        cells.dilation = Dilation::of_cell;
        HexMultigrid multigrid(hex_levels(grid, 600), cells, 4);
        multigrid.set_constrained(std::vector<std::uint8_t>(nodes, 0));
        multigrid.update(2, {}, std::vector<Eigen::Matrix3d>(count, Eigen::Matrix3d::Identity()),
                         dilations);
        std::vector<double> x, y(3 * nodes);
        for (const Vector3& v : test::rough_values(nodes, 1, 7))
            x.insert(x.end(), v.begin(), v.end());
        multigrid.multiply(x, y);
        return y;
    };
    std::vector<CellDilation> dilations(count);
    std::vector<double> expected = product(0, {});
    const std::vector<Vector3> x = test::rough_values(nodes, 1, 7);
    for (std::size_t e = 0; e < count; ++e) {
        const auto rough = test::rough_values(8, 100, static_cast<std::uint32_t>(e));
        double change = 0;
        for (int c = 0; c < 8; ++c) {
            dilations[e].col(c) = rough[c];
            change += rough[c].dot(x[grid.hexahedra[e][c]]);
        }
        for (int c = 0; c < 8; ++c)
            for (int d = 0; d < 3; ++d)
                expected[3 * grid.hexahedra[e][c] + d] +=
                    2 * grid.shares[e] * cell_volume(grid) * lambda * change * rough[c][d];
    }
    const std::vector<double> found = product(lambda, dilations);
    double size = 0;
    for (const double y : expected) size = std::max(size, std::abs(y));
    for (std::size_t i = 0; i < found.size(); ++i)
        ASSERT_NEAR(found[i], expected[i], 1e-10 * size) << i;
}

/// The bounds are those of the first operator. One whose diagonal weighs far less has higher ones:
/// its cycle is not positive until they are taken anew.
TEST(HexMultigrid, TakesSurerBoundsWhereItsCycleIsNotPositive) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    const TetMesh grid = test::hex_grid({12, 12, 12}, {0.1, 0.1, 0.1});
    const Material material{.young_Pa = 3000, .poisson = 0.4};
    HexMultigrid multigrid(hex_levels(grid, 30), cells_of(grid, {material.lambda(), material.mu()}),
                           4);
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
