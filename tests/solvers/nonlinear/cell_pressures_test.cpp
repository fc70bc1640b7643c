// Pressures of a grid's cells in Newton's method.

#include "solvers/nonlinear/cell_pressures.hpp"

#include <gtest/gtest.h>

#include "mesh/hex_grid.hpp"
#include "support/bent_block.hpp"
#include "support/hex_grids.hpp"
#include "support/ranks.hpp"

namespace livetet {
namespace {

/// Along du = 0, from pressures that are off by q = lambda d theta : v to those of the state,
/// r . du is zero, and g . dp = (V / lambda) (1 - a) q^2 at the length a.
TEST(CellPressures, SlopeOfPressuresThatAreOff) {
    if (test::rank_count() > 1) GTEST_SKIP() << "one rank";
    TetMesh grid = test::hex_grid({4, 2, 2}, {0.04, 0.02, 0.02});
    grid.shares[5] = 0.3;
    const MeshHierarchy hierarchy = make_hierarchy({grid}, "a grid");
    test::BentBlock block(hierarchy, "neohookean", Formulation::mixed,
                          TimeScheme::static_equilibrium);
    const LevelAssembler& level = block.balance.level();
    CellPressures pressures(block.balance);
    EXPECT_EQ(pressures.get(), nullptr);
    pressures.begin();
    ASSERT_TRUE(pressures.are_used());
    const double imbalance = block.balance.evaluate();

    const auto v = level.make_vector(), none = level.make_vector();
    LIVETET_PETSC(VecCopy(block.state.u.get(), v.get()));
    const auto at_u = level.make_cell_vector(), at_v = level.make_cell_vector();
    level.find_cell_pressures(block.balance.configuration(), nullptr, at_u.get());
    level.find_cell_pressures(block.balance.configuration(), v.get(), at_v.get());
    double expected = 0;
    {
        const ReadArray p(at_u.get()), off(at_v.get());
        for (std::size_t e = 0; e < grid.hexahedra.size(); ++e)
            expected += grid.shares[e] * cell_volume(grid) / level.lame_moduli(e).first *
                        (off[e] - p[e]) * (off[e] - p[e]);
    }
    pressures.step(v.get());
    const auto before = pressures.aim(none.get());
    EXPECT_NEAR(before.slope, expected, 1e-10 * expected);
    EXPECT_GT(std::abs(before.norm - imbalance), 1e-3 * imbalance);
    EXPECT_NEAR(pressures.at(0.5).slope, 0.5 * expected, 1e-10 * expected);
    const auto after = pressures.at(1);
    EXPECT_NEAR(after.slope, 0, 1e-10 * expected);
    EXPECT_NEAR(after.norm, imbalance, 1e-10 * imbalance);
    pressures.take(1);
    EXPECT_NEAR(pressures.aim(none.get()).slope, 0, 1e-10 * expected);
    pressures.end();
    EXPECT_EQ(pressures.get(), nullptr);
}

}  // namespace
}  // namespace livetet
