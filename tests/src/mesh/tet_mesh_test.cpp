#include "mesh/tet_mesh.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "base/error.hpp"
#include "mesh/shapes.hpp"

namespace livetet {
namespace {

std::string set_refusal(const TetMesh& mesh) {
    try {
        (void)node_set(mesh, "fixed");
    } catch (const Error& e) {
        return e.what();
    }
    return "accepted";
}

TEST(TetMesh, ANodeSetThatThereIsNotIsSaidWithThoseThatThereAre) {
    TetMesh mesh = shapes::box({1, 1, 1}, {1, 1, 1});
    EXPECT_EQ(set_refusal(mesh), "no node set \"fixed\", found none");
    mesh.node_sets = {{"clamped", {0, 1}}, {"top", {7}}};
    EXPECT_EQ(set_refusal(mesh), "no node set \"fixed\", found clamped, top");
    mesh.node_sets["fixed"] = {3};
    EXPECT_EQ(node_set(mesh, "fixed"), std::vector<std::int32_t>{3});
}

/// Against a count of each face; among the faces are some of three tets.
TEST(BoundaryTriangles, AreTheFacesOfOneTetWoundOutwardsInTheOrderOfTheTets) {
    TetMesh mesh = shapes::box({0.3, 0.2, 0.1}, {3, 2, 2});
    std::mt19937 random(7);
    std::shuffle(mesh.tets.begin(), mesh.tets.end(), random);
    mesh.tets.push_back({mesh.tets[0][0], mesh.tets[0][1], mesh.tets[0][2], 0});
    const auto sorted = [](Triangle t) {
        std::sort(t.begin(), t.end());
        return t;
    };
    std::vector<Triangle> faces;
    for (const Tet& t : mesh.tets)  // each opposite a corner, seen from outside
        for (const Triangle& f : {Triangle{t[1], t[2], t[3]}, Triangle{t[0], t[3], t[2]},
                                  Triangle{t[0], t[1], t[3]}, Triangle{t[0], t[2], t[1]}})
            faces.push_back(f);
    std::map<Triangle, int> count;
    for (const Triangle& f : faces) ++count[sorted(f)];
    std::erase_if(faces, [&](const Triangle& f) { return count[sorted(f)] != 1; });
    EXPECT_GT(faces.size(), 60u);
    EXPECT_EQ(boundary_triangles(mesh.tets), faces);
    EXPECT_TRUE(boundary_triangles({}).empty());
}

}  // namespace
}  // namespace livetet
