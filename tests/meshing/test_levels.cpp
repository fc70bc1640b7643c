#ifdef LIVETET_IMAGES

#include "meshing/levels.hpp"

#include <gtest/gtest.h>

#include "base/error.hpp"
#include "meshing/surface_check.hpp"
#include "shapes.hpp"

namespace livetet {
namespace {

/// A sphere pressed to the size of a liver, with a dent.
TriangleMesh organ() {
    TriangleMesh surface = shapes::sphere(1, 5);
    for (Vector3& x : surface.nodes) {
        x *= 1 - 0.25 * std::exp(-8 * (x - Vector3(0, 0, -1)).squaredNorm());
        x = x.cwiseProduct(Vector3(0.075, 0.055, 0.04));
    }
    return surface;
}

void expect_valid(const HierarchyResult& result) {
    const MeshHierarchy& h = result.hierarchy;
    ASSERT_EQ(h.levels.size(), result.levels.size());
    ASSERT_EQ(h.transfers.size() + 1, h.levels.size());
    for (std::size_t l = 0; l < h.levels.size(); ++l) {
        check_tet_mesh(h.levels[l], fmt::format("level {}", l));
        EXPECT_EQ(result.levels[l].quality.tets, static_cast<std::int64_t>(h.levels[l].tets.size()));
        EXPECT_GT(result.levels[l].quality.min_radius_ratio, 0.02);
        if (l == 0) continue;
        EXPECT_LT(h.levels[l].tets.size(), 0.75 * h.levels[l - 1].tets.size());
        EXPECT_EQ(h.transfers[l - 1].size(), h.levels[l - 1].nodes.size());
        for (const double d : h.transfers[l - 1].distance) EXPECT_LT(d, result.levels[l].remesh.edge_length_m);
    }
}

TEST(Hierarchy, has_the_number_of_tets_asked_for) {
    for (const auto& [tets, levels] : {std::pair{1500, 3u}, {8000, 3u}, {30000, 4u}}) {
        MeshingOptions options;
        options.target_tets = tets;
        const HierarchyResult result = build_hierarchy(organ(), options);
        expect_valid(result);
        EXPECT_EQ(result.levels.size(), levels);
        EXPECT_LT(result.levels.back().quality.tets, 200);
        EXPECT_NEAR(static_cast<double>(result.levels[0].quality.tets), static_cast<double>(tets), 0.1 * tets);
        const double ratio = static_cast<double>(result.levels[0].quality.tets) / result.levels[1].quality.tets;
        EXPECT_GT(ratio, 5);
        EXPECT_LT(ratio, 11);
        EXPECT_TRUE(result.notes.empty());
    }
}

TEST(Hierarchy, goes_down_to_about_150_tets_where_no_number_of_levels_is_given) {
    EXPECT_EQ(automatic_levels(8000, 2), 3);
    EXPECT_EQ(automatic_levels(60000, 2), 4);
    EXPECT_EQ(automatic_levels(360000, 2), 5);
    EXPECT_EQ(automatic_levels(8 * 150, 2), 2);
    EXPECT_EQ(automatic_levels(8 * 150 + 1, 2), 3);
    EXPECT_EQ(automatic_levels(60000, 4), 3);
    for (const std::int64_t tiny : {1, 100, 150, 151}) EXPECT_EQ(automatic_levels(tiny, 2), 2);
    EXPECT_EQ(automatic_levels(60000, 1.01), 12);
}

TEST(Hierarchy, has_the_number_of_levels_given) {
    MeshingOptions options;
    options.target_tets = 3000;
    for (options.levels = 1; options.levels <= 3; ++options.levels) {
        const HierarchyResult result = build_hierarchy(organ(), options);
        expect_valid(result);
        EXPECT_EQ(result.levels.size(), static_cast<std::size_t>(options.levels));
    }
}

TEST(Hierarchy, takes_the_edge_lengths_given) {
    MeshingOptions options;
    options.edge_lengths_mm = {6, 9};
    std::vector<double> fractions;
    const HierarchyResult result =
        build_hierarchy(organ(), options, [&](double f, std::string_view) { fractions.push_back(f); });
    expect_valid(result);
    ASSERT_EQ(result.levels.size(), 2u);
    EXPECT_NEAR(result.levels[0].remesh.mean_edge_length_m, 6e-3, 1e-3);
    EXPECT_NEAR(result.levels[1].remesh.mean_edge_length_m, 9e-3, 1.5e-3);
    EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
    EXPECT_EQ(fractions.back(), 1);
}

TEST(Hierarchy, leaves_out_levels_that_would_not_be_coarser) {
    MeshingOptions options;
    options.target_tets = 300;
    options.levels = 6;
    const HierarchyResult result = build_hierarchy(organ(), options);
    expect_valid(result);
    EXPECT_LT(result.levels.size(), 6u);
    EXPECT_FALSE(result.notes.empty());
}

TEST(Hierarchy, refuses_options_out_of_range_by_name) {
    const auto refused = [](const std::function<void(MeshingOptions&)>& change, const std::string& name) {
        MeshingOptions options;
        change(options);
        try {
            build_hierarchy(organ(), options);
            ADD_FAILURE() << name;
        } catch (const Error& error) {
            EXPECT_NE(std::string(error.what()).find("meshing." + name), std::string::npos) << error.what();
        }
    };
    refused([](MeshingOptions& o) { o.levels = -1; }, "levels");
    refused([](MeshingOptions& o) { o.levels = 13; }, "levels");
    refused([](MeshingOptions& o) { o.target_tets = 0; }, "target_tets");
    refused([](MeshingOptions& o) { o.coarsening = 1; }, "coarsening");
    refused([](MeshingOptions& o) { o.voxel_mm = std::nan(""); }, "voxel_mm");
    refused([](MeshingOptions& o) { o.edge_lengths_mm = {8, 4}; }, "edge_lengths_mm[1]");
    refused([](MeshingOptions& o) { o.gmsh_time_limit_s = 0; }, "gmsh_time_limit_s");
}

}  // namespace
}  // namespace livetet

#endif
