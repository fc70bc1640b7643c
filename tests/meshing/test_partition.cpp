#include "meshing/partition.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/error.hpp"
#include "shapes.hpp"

namespace livetet {
namespace {

TEST(Partition, is_balanced_and_the_same_every_time) {
    const TetMesh mesh = shapes::box({0.15, 0.11, 0.08}, {12, 10, 8});
    for (const int parts : {2, 3, 7}) {
        const std::vector<std::int32_t> part = partition_tets(mesh.tets, parts);
        ASSERT_EQ(part.size(), mesh.tets.size());
        EXPECT_EQ(part, partition_tets(mesh.tets, parts));
        const double fair = static_cast<double>(mesh.tets.size()) / parts;
        for (int p = 0; p < parts; ++p)
            EXPECT_NEAR(static_cast<double>(std::count(part.begin(), part.end(), p)), fair, 0.06 * fair);
    }
}

TEST(Partition, cuts_a_bar_across_its_length) {
    const TetMesh mesh = shapes::box({0.4, 0.02, 0.02}, {40, 2, 2});
    const std::vector<std::int32_t> part = partition_tets(mesh.tets, 2);
    std::size_t cut = 0;
    for (const auto& side : {0, 1}) {
        std::vector<Tet> tets;
        for (std::size_t e = 0; e < part.size(); ++e)
            if (part[e] == side) tets.push_back(mesh.tets[e]);
        cut += boundary_triangles(tets).size();
    }
    cut = (cut - boundary_triangles(mesh.tets).size()) / 2;  // faces between the parts; a straight cut has 8
    EXPECT_GE(cut, 8u);
    EXPECT_LE(cut, 24u);
}

TEST(Partition, handles_one_part_and_refuses_nonsense) {
    const TetMesh mesh = shapes::box({1, 1, 1}, {1, 1, 1});
    EXPECT_EQ(partition_tets(mesh.tets, 1), std::vector<std::int32_t>(6, 0));
    EXPECT_THROW(partition_tets(mesh.tets, 0), Error);
    EXPECT_THROW(partition_tets(mesh.tets, 7), Error);
    EXPECT_THROW(partition_tets(std::vector<Tet>{{0, 1, 2, -3}, {0, 1, 2, 3}}, 2), Error);
}

}  // namespace
}  // namespace livetet
