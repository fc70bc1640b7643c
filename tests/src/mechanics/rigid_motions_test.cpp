#include "mechanics/rigid_motions.hpp"

#include <gtest/gtest.h>

#include "mesh/quadratic.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

const TetMesh mesh = test::block({2, 2, 2}, {0.1, 0.1, 0.1});

std::vector<std::uint8_t> held(const TetMesh& m,
                               std::initializer_list<std::pair<Vector3, std::uint8_t>> nodes) {
    std::vector<std::uint8_t> components(m.nodes.size(), 0);
    for (const auto& [x, which] : nodes)
        for (const std::int32_t n :
             test::nodes_where(m, [&](const Vector3& y) { return (x - y).norm() < 1e-9; }))
            components[n] |= which;
    return components;
}

TEST(RigidMotions, AFreeBodyHasSixAndAHeldOneNone) {
    EXPECT_EQ(free_rigid_motions(mesh, held(mesh, {})).size(), 6u);
    EXPECT_TRUE(
        free_rigid_motions(mesh, held(mesh, {{{0, 0, 0}, 7}, {{0.1, 0, 0}, 6}, {{0, 0.1, 0}, 4}}))
            .empty());
    const TetMesh quadratic = quadratic_mesh(mesh);
    EXPECT_TRUE(
        free_rigid_motions(quadratic,
                           held(quadratic, {{{0, 0, 0}, 7}, {{0.05, 0, 0}, 6}, {{0, 0.1, 0}, 4}}))
            .empty());
}

TEST(RigidMotions, NamesWhatIsFree) {
    // Held at two points of an edge along x: it turns about that edge.
    const auto hinge = free_rigid_motions(mesh, held(mesh, {{{0, 0, 0}, 7}, {{0.1, 0, 0}, 7}}));
    ASSERT_EQ(hinge.size(), 1u);
    EXPECT_NE(hinge[0].description.find("rotation about (1, 0, 0) through"), std::string::npos)
        << hinge[0].description;
    EXPECT_NE(hinge[0].description.find(", 0.0, 0.0) mm"), std::string::npos)
        << hinge[0].description;
    // Sliding on a rail along z.
    std::vector<std::uint8_t> rail(mesh.nodes.size(), 3);
    const auto slide = free_rigid_motions(mesh, rail);
    ASSERT_EQ(slide.size(), 1u);
    EXPECT_EQ(slide[0].description, "translation along (0, 0, 1)");
    // Held at one point: three rotations.
    EXPECT_EQ(free_rigid_motions(mesh, held(mesh, {{{0, 0, 0}, 7}})).size(), 3u);
}

TEST(RigidMotions, LooksAtEachPieceByItself) {
    TetMesh two = mesh;
    const auto shift = static_cast<std::int32_t>(mesh.nodes.size());
    for (const Vector3& x : mesh.nodes) two.nodes.push_back(x + Vector3(1, 0, 0));
    for (Tet t : mesh.tets) {
        for (std::int32_t& n : t) n += shift;
        two.tets.push_back(t);
    }
    std::vector<std::uint8_t> components(two.nodes.size(), 7);
    std::fill(components.begin() + shift, components.end(), 0);
    const auto free = free_rigid_motions(two, components);
    ASSERT_EQ(free.size(), 6u);
    EXPECT_NE(free[0].description.find("of the piece with node 27"), std::string::npos)
        << free[0].description;
}

}  // namespace
}  // namespace livetet
