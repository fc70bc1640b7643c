#include "mesh/packed_mesh.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "base/error.hpp"

namespace livetet {
namespace {

TetMesh tet_with_sets() {
    TetMesh mesh;
    mesh.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    mesh.tets = {{0, 1, 2, 3}};
    mesh.regions = {7};
    mesh.node_sets["tip"] = {3};
    mesh.node_sets["none"] = {};
    mesh.triangle_sets["bottom"] = {{0, 2, 1}};
    return mesh;
}

TEST(PackedMesh, comes_back_as_it_was) {
    const TetMesh mesh = tet_with_sets(), back = unpacked_mesh(packed(mesh), "it");
    EXPECT_EQ(back.nodes, mesh.nodes);
    EXPECT_EQ(back.tets, mesh.tets);
    EXPECT_EQ(back.regions, mesh.regions);
    EXPECT_EQ(back.node_sets, mesh.node_sets);
    EXPECT_EQ(back.triangle_sets, mesh.triangle_sets);
}

TEST(PackedMesh, too_few_or_too_many_bytes_are_an_error) {
    std::vector<char> bytes = packed(tet_with_sets());
    for (std::size_t n = 0; n < bytes.size(); ++n)
        EXPECT_THROW(unpacked_mesh(std::span(bytes).first(n), "it"), Error) << n;
    bytes.push_back('x');
    EXPECT_THROW(unpacked_mesh(bytes, "it"), Error);
}

TEST(PackedMesh, counts_are_believed_only_as_far_as_there_are_bytes) {
    std::vector<char> bytes = packed(tet_with_sets());
    for (const std::uint64_t count :
         {std::uint64_t(5), std::uint64_t(1) << 60, ~std::uint64_t(0)}) {
        std::memcpy(bytes.data(), &count, sizeof count);
        EXPECT_THROW(unpacked_mesh(bytes, "it"), Error) << count;
    }
}

TEST(PackedMesh, sets_of_nodes_that_are_not_there_are_errors) {
    TetMesh mesh = tet_with_sets();
    mesh.node_sets["tip"] = {4};
    EXPECT_THROW(unpacked_mesh(packed(mesh), "it"), Error);
    mesh = tet_with_sets();
    mesh.triangle_sets["bottom"] = {{0, -1, 1}};
    EXPECT_THROW(unpacked_mesh(packed(mesh), "it"), Error);
}

}  // namespace
}  // namespace livetet
