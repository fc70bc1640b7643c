// Levels that were cut: which coarse tets are on the side of a fine node.

#include <gtest/gtest.h>

#include <random>

#include "mesh/cut_hierarchy.hpp"
#include "mesh/mesh_pieces.hpp"
#include "mesh/openable_tets.hpp"
#include "mesh/tet_links.hpp"
#include "support/shaken.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

const Vector3 shaken_middle(0.0293, 0.0312, 0.0304);

/// Three levels of a box of 60 mm whose tets do not fit each other.
std::vector<TetMesh> shaken_levels() {
    std::vector<TetMesh> levels;
    for (const int cells : {14, 8, 4})
        levels.push_back(test::shaken(test::block({cells, cells, cells}, Vector3::Constant(0.06)),
                                      0.012 / cells));
    return levels;
}

TriangleMesh plane_through_middle(const Vector3& normal) {
    const Vector3 a = 0.2 * normal.unitOrthogonal(), b = normal.cross(a);
    TriangleMesh plane;
    for (const Vector3& corner : {Vector3(-a - b), Vector3(a - b), Vector3(a + b), Vector3(b - a)})
        plane.nodes.push_back(shaken_middle + corner);
    plane.triangles = {{0, 1, 2}, {0, 2, 3}};
    return plane;
}

/// 1 for each node on the side that the normal points to, else -1, by the pieces.
std::vector<int> sides_of(const TetMesh& mesh, const Vector3& normal) {
    std::vector<int> sides(mesh.nodes.size(), 0);
    for (const MeshPiece& piece : mesh_pieces(mesh))
        for (const std::int32_t n : nodes_of_pieces({&piece, 1}, mesh))
            sides[n] = (piece.centroid - shaken_middle).dot(normal) > 0 ? 1 : -1;
    return sides;
}

/// Number of nodes that would take values from the other side of a cut through the whole body.
std::size_t nodes_across(const MeshHierarchy& levels, const Vector3& normal) {
    std::size_t across = 0;
    for (std::size_t l = 0; l + 1 < levels.levels.size(); ++l) {
        const auto fine = sides_of(levels.levels[l], normal);
        const auto coarse = sides_of(levels.levels[l + 1], normal);
        const BarycentricMap& map = levels.transfers[l];
        for (std::size_t n = 0; n < map.size(); ++n) across += fine[n] != coarse[map.nodes[n][0]];
    }
    return across;
}

TEST(TetLinks, FacesHaveATetOnEachSideButAtTheBoundary) {
    const TetMesh mesh = test::block({4, 3, 2}, {0.04, 0.03, 0.02});
    const auto across = tets_across(mesh.tets);
    std::size_t open = 0;
    for (std::size_t e = 0; e < across.size(); ++e)
        for (int k = 0; k < 4; ++k) {
            const std::int32_t other = across[e][k];
            open += other < 0;
            if (other < 0) continue;
            EXPECT_EQ(std::ranges::count(mesh.tets[other], mesh.tets[e][k]), 0);
            EXPECT_EQ(std::ranges::count(across[other], static_cast<std::int32_t>(e)), 1);
        }
    EXPECT_EQ(open, boundary_triangles(mesh.tets).size());
    EXPECT_EQ(links_of(mesh.tets).size(), (4 * mesh.tets.size() - open) / 2);
}

/// A tet that is there twice has no link to itself, and does not hide its neighbour.
TEST(TetLinks, ATetThatIsThereTwiceKeepsItsNeighbour) {
    const Tet a{0, 1, 2, 3}, b{1, 2, 3, 4};
    for (const std::vector<Tet>& tets : {std::vector{a, b, a}, {a, a, b}, {b, a, a}})
        EXPECT_EQ(links_of(tets).size(), 1U);
}

/// Cuts of a scene: no node. Those of a blade, whose levels do not follow its surface as near: a
/// few at edges of the box, where a coarse tet has one neighbour.
TEST(SideFinder, NodesTakeNoValuesFromAcrossACut) {
    std::mt19937 random(3);
    std::normal_distribution<double> any;
    for (int k = 0; k < 40; ++k) {
        const Vector3 normal = Vector3(any(random), any(random), any(random)).normalized();
        const TriangleMesh plane = plane_through_middle(normal);
        std::vector<TetMesh> cut = shaken_levels();
        cut_levels(cut, plane, "box");
        EXPECT_EQ(mesh_pieces(cut.back()).size(), 2U);
        EXPECT_EQ(nodes_across(with_cut_transfers(cut, "cut"), normal), 0U) << k;
        const std::vector<TetMesh> loaded = shaken_levels();
        OpenableTets tets(loaded, "box");
        tets.cut(plane);
        EXPECT_LE(nodes_across(with_cut_transfers(tets.open(loaded).levels, "cut"), normal), 3U)
            << k;
    }
}

/// Rigid motions are carried over as they are, also by nodes that changed their tet.
TEST(SideFinder, RotationsOfASideAreCarriedOver) {
    const Vector3 normal = Vector3(0.2, 0.3, 1).normalized();
    const std::vector<TetMesh> loaded = shaken_levels();
    OpenableTets tets(loaded, "box");
    tets.cut(plane_through_middle(normal));
    const MeshHierarchy levels = with_cut_transfers(tets.open(loaded).levels, "cut");
    const TetMesh &fine = levels.levels[0], &coarse = levels.levels[1];
    const auto side = sides_of(coarse, normal), fine_side = sides_of(fine, normal);
    const Vector3 axis(1, -2, 0.5);
    std::vector<Vector3> u;
    for (std::size_t n = 0; n < coarse.nodes.size(); ++n)
        u.push_back(side[n] * axis.cross(coarse.nodes[n]));
    for (std::size_t n = 0; n < fine.nodes.size(); ++n)
        EXPECT_LT(
            (interpolate(levels.transfers[0], n, u) - fine_side[n] * axis.cross(fine.nodes[n]))
                .norm(),
            1e-12);
}

}  // namespace
}  // namespace livetet
