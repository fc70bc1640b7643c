#include "mesh/tet_mesh.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace livetet
