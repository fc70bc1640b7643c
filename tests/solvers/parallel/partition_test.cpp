#include "solvers/parallel/partition.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/error.hpp"
#include "mesh/refine.hpp"
#include "solvers/parallel/exchange.hpp"
#include "support/partitioners.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

TEST(Partition, is_balanced_and_the_same_every_time) {
    const TetMesh mesh = test::block({12, 10, 8}, Vector3(0.15, 0.11, 0.08));
    for (const int parts : {2, 3, 7}) {
        const std::vector<std::int32_t> part = partition_tets(mesh.tets, parts);
        ASSERT_EQ(part.size(), mesh.tets.size());
        EXPECT_EQ(part, partition_tets(mesh.tets, parts));
        const double fair = static_cast<double>(mesh.tets.size()) / parts;
        for (int p = 0; p < parts; ++p)
            EXPECT_NEAR(static_cast<double>(std::count(part.begin(), part.end(), p)), fair,
                        0.06 * fair);
    }
}

TEST(Partition, cuts_a_bar_across_its_length) {
    const TetMesh mesh = test::block({40, 2, 2}, Vector3(0.4, 0.02, 0.02));
    const std::vector<std::int32_t> part = partition_tets(mesh.tets, 2);
    std::size_t cut = 0;
    for (const auto& side : {0, 1}) {
        std::vector<Tet> tets;
        for (std::size_t e = 0; e < part.size(); ++e)
            if (part[e] == side) tets.push_back(mesh.tets[e]);
        cut += boundary_triangles(tets).size();
    }
    cut = (cut - boundary_triangles(mesh.tets).size()) /
          2;  // faces between the parts; a straight cut has 8
    EXPECT_GE(cut, 8u);
    EXPECT_LE(cut, 24u);
}

TEST(Partition, handles_one_part_and_refuses_nonsense) {
    const TetMesh mesh = test::block({1, 1, 1}, Vector3(1, 1, 1));
    EXPECT_EQ(partition_tets(mesh.tets, 1), std::vector<std::int32_t>(6, 0));
    EXPECT_THROW(partition_tets(mesh.tets, 0), Error);
    EXPECT_THROW(partition_tets(mesh.tets, 7), Error);
    EXPECT_THROW(partition_tets(std::vector<Tet>{{0, 1, 2, -3}, {0, 1, 2, 3}}, 2), Error);
}

TEST(Partition, in_parallel_is_balanced_and_cuts_few_faces) {
    if (test::partitioners().size() < 2) GTEST_SKIP() << "PTScotch has 32-bit indices";
    const TetMesh mesh = test::block({12, 10, 8}, Vector3(0.15, 0.11, 0.08));
    for (const int parts : {1, 2, 5}) {
        const std::vector<std::int32_t> part = of_all_ranks(
            PETSC_COMM_WORLD, partition_tets_in_parallel(PETSC_COMM_WORLD, test::rows_of(mesh).tets,
                                                         test::size_of(mesh), parts));
        ASSERT_EQ(part.size(), mesh.tets.size());
        const double fair = static_cast<double>(mesh.tets.size()) / parts;
        std::size_t faces = 0;
        for (int p = 0; p < parts; ++p) {
            EXPECT_NEAR(static_cast<double>(std::count(part.begin(), part.end(), p)), fair,
                        0.1 * fair);
            std::vector<Tet> tets;
            for (std::size_t e = 0; e < part.size(); ++e)
                if (part[e] == p) tets.push_back(mesh.tets[e]);
            faces += boundary_triangles(tets).size();
        }
        const std::size_t cut = (faces - boundary_triangles(mesh.tets).size()) / 2;
        EXPECT_LE(
            cut,
            2u * 120 *
                (parts - 1));  // straight cuts have at most 120 quadrilaterals, of two faces each
    }
}

TEST(Partition, a_refined_level_takes_the_parts_of_the_tets_it_was_cut_from) {
    const int ranks = test::rank_count();
    const MeshHierarchy hierarchy = with_refined_levels(
        make_hierarchy({test::block({8, 6, 6}, Vector3(0.2, 0.1, 0.1))}, "a block"), 1);
    for (const Partitioner partitioner : test::partitioners()) {
        const auto parts = partition_levels(PETSC_COMM_WORLD, hierarchy, partitioner);
        ASSERT_EQ(parts.size(), 2u);
        ASSERT_EQ(parts[0].size(), hierarchy.levels[0].tets.size());
        std::vector<int> found(ranks, 0);
        for (std::size_t e = 0; e < parts[0].size(); ++e) {
            const std::int32_t parent = hierarchy.parents[0][e];
            EXPECT_EQ(parts[0][e], parts[1][parent]);
            ++found[parts[0][e]];
            // What it was cut from holds its middle.
            Vector3 middle = Vector3::Zero(), centre = Vector3::Zero();
            double size = 0;
            for (const std::int32_t n : hierarchy.levels[0].tets[e])
                middle += hierarchy.levels[0].nodes[n] / 4;
            const Tet& whole = hierarchy.levels[1].tets[parent];
            for (const std::int32_t n : whole) centre += hierarchy.levels[1].nodes[n] / 4;
            for (const std::int32_t n : whole)
                size = std::max(size, (hierarchy.levels[1].nodes[n] - centre).norm());
            EXPECT_LT((middle - centre).norm(), 0.7 * size);
        }
        EXPECT_GT(*std::min_element(found.begin(), found.end()), 0);
    }
}

/// The owners of all nodes.
std::vector<std::int32_t> owners_of(const TetMesh& whole, const std::vector<std::int32_t>& parts) {
    return of_all_ranks(PETSC_COMM_WORLD,
                        node_owners(PETSC_COMM_WORLD, test::rows_of(whole), test::size_of(whole),
                                    test::table_rows(parts), "mesh"));
}

TEST(Partition, ANodeBelongsToThePartOfMostTetsAtIt) {
    TetMesh mesh = test::block({2, 1, 1}, Vector3(0.2, 0.1, 0.1));
    std::vector<std::int32_t> parts;
    for (const Tet& t : mesh.tets) {
        double middle = 0;
        for (const std::int32_t n : t) middle += mesh.nodes[n].x() / 4;
        parts.push_back(middle > 0.1 ? 5 : 2);
    }
    const std::vector<std::int32_t> owner = owners_of(mesh, parts);
    ASSERT_EQ(owner.size(), mesh.nodes.size());
    for (std::size_t n = 0; n < owner.size(); ++n) {
        int of_two = 0, of_five = 0;
        for (std::size_t e = 0; e < parts.size(); ++e)
            if (std::count(mesh.tets[e].begin(), mesh.tets[e].end(), static_cast<int>(n)) > 0)
                ++(parts[e] == 5 ? of_five : of_two);
        EXPECT_EQ(owner[n], of_five > of_two ? 5 : 2) << n;
    }
}

/// Levels that were meshed each on its own: rows of a transfer find their columns on their own rank
/// (of a level partitioned by itself, only one in so many as there are ranks would).
TEST(Partition, ACoarserLevelIsCutWhereTheFinestIs) {
    const Vector3 size(0.2, 0.15, 0.1);
    const MeshHierarchy h =
        make_hierarchy({test::block({24, 18, 12}, size), test::block({13, 9, 7}, size),
                        test::block({5, 4, 3}, size)},
                       "blocks");
    const int ranks = test::rank_count();
    for (const Partitioner partitioner : test::partitioners()) {
        const auto parts = partition_levels(PETSC_COMM_WORLD, h, partitioner);
        std::vector<std::vector<std::int32_t>> owners;
        for (std::size_t l = 0; l < parts.size(); ++l) {
            ASSERT_EQ(parts[l].size(), h.levels[l].tets.size());
            const auto worth = std::clamp<std::size_t>(parts[l].size() / min_tets_per_rank, 1,
                                                       static_cast<std::size_t>(ranks));
            std::vector<std::size_t> tets(ranks, 0);
            for (const std::int32_t p : parts[l]) ++tets.at(p);
            EXPECT_EQ(static_cast<std::size_t>(ranks - std::count(tets.begin(), tets.end(), 0)),
                      worth)
                << "ranks at work on level " << l;
            const double fair = static_cast<double>(parts[l].size()) / static_cast<double>(worth);
            EXPECT_LT(static_cast<double>(*std::max_element(tets.begin(), tets.end())), 1.5 * fair);
            owners.push_back(owners_of(h.levels[l], parts[l]));
        }
        std::size_t own = 0, all = 0;
        for (std::size_t i = 0; i < h.transfers[0].size(); ++i)
            for (int k = 0; k < 4; ++k)
                if (h.transfers[0].weights[i][k] != 0) {
                    ++all;
                    own += owners[0][i] == owners[1][h.transfers[0].nodes[i][k]];
                }
        EXPECT_GT(static_cast<double>(own), 0.8 * static_cast<double>(all));
    }
}

/// On more ranks than it has tets, a mesh is left to one of them.
TEST(Partition, OfFewerTetsThanRanksIsOnOne) {
    const MeshHierarchy h = make_hierarchy({test::block({1, 1, 1}, Vector3(1, 1, 1))}, "a cube");
    EXPECT_EQ(partition_levels(PETSC_COMM_WORLD, h, Partitioner::metis),
              (std::vector<std::vector<std::int32_t>>{{0, 0, 0, 0, 0, 0}}));
}

}  // namespace
}  // namespace livetet
