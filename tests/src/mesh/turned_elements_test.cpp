#include "mesh/turned_elements.hpp"

#include <gtest/gtest.h>

#include "mesh/hex_grid.hpp"
#include "mesh/shapes.hpp"

namespace livetet {
namespace {

/// All elements in so many looks.
std::size_t count_in(TurnedElements& turned, const TetMesh& mesh,
                     const std::vector<Vector3>& displacement, int looks) {
    for (int i = 0; i < looks; ++i) turned.look(mesh, displacement);
    return turned.count();
}

TEST(TurnedElements, AreCountedInTurnsAndForgottenOnceTheyAreRight) {
    const TetMesh mesh = shapes::box({1, 1, 1}, {8, 8, 8});  // 3072 tets: two looks
    TurnedElements turned(mesh);
    std::vector<Vector3> u(mesh.nodes.size(), Vector3::Zero());
    EXPECT_EQ(count_in(turned, mesh, u, 2), 0u);
    // The lowest corner through its only tets, all six of one brick.
    u.front() = {0.3, 0.3, 0.3};
    EXPECT_EQ(count_in(turned, mesh, u, 1), 6u);
    // The highest, in the second look.
    u.front().setZero();
    u.back() = {-0.3, -0.3, -0.3};
    EXPECT_EQ(count_in(turned, mesh, u, 1), 12u) << "the first are not looked at again";
    EXPECT_EQ(count_in(turned, mesh, u, 1), 6u);
    u.back() = Vector3::Constant(NAN);
    EXPECT_EQ(count_in(turned, mesh, u, 2), 6u);
    u.back().setZero();
    EXPECT_EQ(count_in(turned, mesh, u, 2), 0u);
}

TEST(TurnedElements, OfAGridAreCellsThatAreMostlyInside) {
    TetMesh grid;
    for (int n = 0; n < 12; ++n) grid.nodes.emplace_back(n % 3, n / 3 % 2, n / 6);
    grid.hexahedra = {{0, 1, 3, 4, 6, 7, 9, 10}, {1, 2, 4, 5, 7, 8, 10, 11}};
    grid.shares = {1, 0.6};
    grid.tets = tets_of_hexahedra(grid.hexahedra);
    TurnedElements turned(grid);
    std::vector<Vector3> u(12, Vector3::Zero());
    EXPECT_EQ(count_in(turned, grid, u, 1), 0u);
    for (const int n : {1, 4, 7, 10}) u[n] = {1.2, 0, 0};  // their common face, past the far one
    EXPECT_EQ(count_in(turned, grid, u, 1), 1u);
    grid.shares[1] = 0.4;
    EXPECT_EQ(count_in(turned, grid, u, 1), 0u);
}

}  // namespace
}  // namespace livetet
