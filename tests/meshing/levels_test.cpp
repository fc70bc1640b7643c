#ifdef LIVETET_IMAGES

#include "meshing/levels.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <memory>

#include "base/error.hpp"
#include "mesh/shapes.hpp"
#include "meshing/body_mask.hpp"
#include "meshing/shells.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {
namespace {

/// A sphere deformed to the size of a liver, with a dent.
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
        EXPECT_EQ(result.levels[l].quality.tets,
                  static_cast<std::int64_t>(h.levels[l].tets.size()));
        EXPECT_GE(result.levels[l].quality.min_dihedral_deg, 5);
        EXPECT_NEAR(result.levels[l].volume_ratio, 1, l == 0 ? 0.01 : 0.4);
        EXPECT_LT(result.levels[l].distance.to_body.max_m, result.levels[l].edge_length_m);
        EXPECT_LT(result.levels[l].distance.from_body.max_m, result.levels[l].edge_length_m);
        if (l == 0) continue;
        EXPECT_LT(h.levels[l].tets.size(), 0.75 * h.levels[l - 1].tets.size());
        EXPECT_EQ(h.transfers[l - 1].size(), h.levels[l - 1].nodes.size());
        for (const double d : h.transfers[l - 1].distance)
            EXPECT_LT(d, result.levels[l].edge_length_m);
    }
}

/// An organ with two cavities, the smaller of which is too small for the coarser levels' edges.
TEST(Hierarchy, keeps_cavities_and_names_their_surfaces) {
    const std::array<TriangleMesh, 3> shells{organ(), shapes::sphere(0.02, 3, {0.03, 0, 0.005}),
                                             shapes::sphere(0.006, 2, {-0.04, 0, 0})};
    MeshingOptions options;
    options.target_tets = 8000;
    const HierarchyResult result = build_hierarchy(joined(shells), options);
    ASSERT_GE(result.hierarchy.levels.size(), 3u);
    const TetMesh& finest = result.hierarchy.levels.front();
    EXPECT_NEAR(volume(finest),
                signed_volume(shells[0]) - signed_volume(shells[1]) - signed_volume(shells[2]),
                0.01 * volume(finest));
    for (const std::int32_t n : node_set(finest, "cavity_1"))
        EXPECT_NEAR((finest.nodes[n] - Vector3(0.03, 0, 0.005)).norm(), 0.02, 0.002);
    const std::size_t on_boundary = boundary_triangles(finest.tets).size();
    EXPECT_EQ(finest.triangle_sets.at("cavity").size() + finest.triangle_sets.at("outer").size(),
              on_boundary);
    EXPECT_EQ(result.levels.front().shells, (ShellCount{1, 2}));
    EXPECT_EQ(result.levels[2].shells, (ShellCount{1, 1}));
    const auto said = [&](const char* words) {
        return std::any_of(result.notes.begin(), result.notes.end(),
                           [&](const auto& n) { return n.find(words) != n.npos; });
    };
    EXPECT_TRUE(said("2 cavities of"));
    EXPECT_TRUE(said("level 2: has 1 of the body's 1 parts and 1 of its 2 cavities"));
    options.body.cavities = Cavities::fill;
    options.levels = 1;
    const TetMesh filled = build_hierarchy(joined(shells), options).hierarchy.levels.front();
    EXPECT_NEAR(volume(filled), signed_volume(shells[0]), 0.01 * volume(filled));
    EXPECT_TRUE(filled.node_sets.empty());
}

TEST(Hierarchy, has_the_number_of_tets_asked_for) {
    for (const auto& [tets, levels] : {std::pair{1500, 3u}, {8000, 3u}, {30000, 4u}}) {
        MeshingOptions options;
        options.target_tets = tets;
        const HierarchyResult result = build_hierarchy(organ(), options);
        expect_valid(result);
        EXPECT_EQ(result.levels.size(), levels);
        EXPECT_LT(result.levels.back().quality.tets, 200);
        EXPECT_NEAR(static_cast<double>(result.levels[0].quality.tets), static_cast<double>(tets),
                    0.1 * tets);
        const double ratio =
            static_cast<double>(result.levels[0].quality.tets) / result.levels[1].quality.tets;
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
    const HierarchyResult result = build_hierarchy(
        organ(), options, [&](double f, std::string_view) { fractions.push_back(f); });
    expect_valid(result);
    ASSERT_EQ(result.levels.size(), 2u);
    for (const int l : {0, 1}) {
        const TetMesh& mesh = result.hierarchy.levels[l];
        const double asked = 1e-3 * options.edge_lengths_mm[l];
        EXPECT_NEAR(shapes::mean_edge({mesh.nodes, boundary_triangles(mesh.tets)}), asked,
                    asked / 6);
    }
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

/// The real Gmsh, except that the first calls return nothing.
GmshOptions failing_at_first(int calls) {
    GmshOptions gmsh;
    gmsh.run = [left = std::make_shared<int>(calls)](const std::function<int(int)>& work,
                                                     double limit) {
        return (*left)-- > 0 ? ChildResult{ChildResult::End::failed, 1, {}, "Error   : no", 0}
                             : run_in_child(work, limit);
    };
    return gmsh;
}

TEST(Hierarchy, tries_other_ways_where_gmsh_fails_and_says_so) {
    MeshingOptions options;
    options.edge_lengths_mm = {9};
    for (const int failures : {1, 2}) {  // HXT; HXT and Delaunay
        const HierarchyResult result =
            build_hierarchy(organ(), options, {}, failing_at_first(failures));
        expect_valid(result);
        ASSERT_EQ(result.notes.size(), 1u);
        EXPECT_NE(result.notes[0].find(failures == 1 ? "level 0: filled by Delaunay"
                                                     : "level 0: not taken"),
                  std::string::npos)
            << result.notes[0];
    }
}

TEST(Hierarchy, that_cannot_be_made_names_the_place_and_hands_out_the_surface) {
    MeshingOptions options;
    options.target_tets = 1500;
    try {
        build_hierarchy(organ(), options, {}, failing_at_first(1000));
        FAIL() << "nothing filled it";
    } catch (const MeshingFailure& failure) {
        const std::string text = failure.what();
        double low[3], high[3];  // the bounding box; the failing position is unknown
        ASSERT_EQ(std::sscanf(text.c_str() + std::min(text.find("from ("), text.size()),
                              "from (%lf, %lf, %lf) mm to (%lf, %lf, %lf) mm", low, low + 1,
                              low + 2, high, high + 1, high + 2),
                  6)
            << text;
        EXPECT_NEAR(low[0], -75, 3);
        EXPECT_NEAR(low[1], -55, 3);
        EXPECT_NEAR(high[0], 75, 3);
        EXPECT_NEAR(high[2], 40, 3);
        EXPECT_TRUE(check_topology(failure.surface).closed());
        EXPECT_NEAR(signed_volume(failure.surface), signed_volume(organ()),
                    0.01 * signed_volume(organ()));
    }
}

/// Edges of a hundredth of the usual length everywhere: minutes of remeshing.
TEST(Hierarchy, gives_up_remeshing_at_the_time_limit) {
    MeshingOptions options;
    options.edge_lengths_mm = {9};
    options.finer = {{{0, 0, 0.04}, 0.1, 1e-8}};
    options.gmsh_time_limit_s = 1;
    const auto start = std::chrono::steady_clock::now();
    try {
        build_hierarchy(organ(), options);
        FAIL() << "within a second";
    } catch (const MeshingFailure& failure) {
        EXPECT_NE(std::string(failure.what()).find("remeshing"), std::string::npos)
            << failure.what();
        EXPECT_NE(std::string(failure.what()).find("killed"), std::string::npos) << failure.what();
        EXPECT_FALSE(failure.surface.triangles.empty());
    }
    EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 30);
}

TEST(Hierarchy, is_held_to_the_volume_of_the_voxels) {
    MeshingOptions options;
    options.edge_lengths_mm = {9};
    options.gmsh_time_limit_s = 20;
    const double surface_m3 = signed_volume(organ());
    const auto with_voxels = [&](double voxels_m3) {
        return build_hierarchy(organ(), options, {}, {}, {false, {}, voxels_m3});
    };
    EXPECT_NEAR(with_voxels(surface_m3 / 1.005).levels[0].volume_ratio, 1.005, 0.004);
    try {
        with_voxels(surface_m3 / 1.03);
        FAIL() << "3 % too much";
    } catch (const MeshingFailure& failure) {
        EXPECT_NE(std::string(failure.what()).find("ml of the body's"), std::string::npos)
            << failure.what();
    }
}

/// In a plate of 0.4 mm, tets with edges of 8 mm necessarily have angles of about 5 degrees.
TEST(Hierarchy, that_only_a_smaller_bound_would_let_pass_is_refused) {
    const TetMesh block = shapes::box({0.05, 0.05, 0.0004}, {12, 12, 1});
    const TriangleMesh plate{block.nodes, boundary_triangles(block.tets)};
    MeshingOptions options;
    options.edge_lengths_mm = {8};
    options.remesh_tries = 1;
    options.gmsh_time_limit_s = 20;
    options.min_dihedral_deg = 0;
    EXPECT_LT(build_hierarchy(plate, options).levels[0].quality.min_dihedral_deg, 8);
    options.min_dihedral_deg = 15;
    try {
        build_hierarchy(plate, options);
        FAIL() << "tets of 5 degrees passed for 15";
    } catch (const MeshingFailure& failure) {
        EXPECT_NE(std::string(failure.what()).find(") mm"), std::string::npos) << failure.what();
        EXPECT_FALSE(failure.surface.triangles.empty());
    }
}

/// Mean edge of the tets whose centre is in the sphere.
double mean_edge_in(const TetMesh& mesh, const FineSphere& s) {
    double sum = 0;
    int count = 0;
    for (const Tet& t : mesh.tets) {
        const Vector3 centre =
            (mesh.nodes[t[0]] + mesh.nodes[t[1]] + mesh.nodes[t[2]] + mesh.nodes[t[3]]) / 4;
        if ((centre - s.centre).norm() > s.radius_m) continue;
        for (const auto& [i, j] : tet_edges) sum += (mesh.nodes[t[i]] - mesh.nodes[t[j]]).norm();
        count += 6;
    }
    return sum / count;
}

TEST(Hierarchy, is_finer_near_a_place) {
    MeshingOptions options;
    options.edge_lengths_mm = {10};
    const FineSphere patch{{0, 0, 0.04}, 0.015, 0.003}, elsewhere{{0, 0, -0.02}, 0.015, 0.003};
    options.finer = {patch};
    const HierarchyResult result = build_hierarchy(organ(), options);
    expect_valid(result);
    EXPECT_LT(mean_edge_in(result.hierarchy.levels[0], patch), 0.0045);
    EXPECT_GT(mean_edge_in(result.hierarchy.levels[0], elsewhere), 0.008);
}

TEST(Hierarchy, is_finer_at_the_border_of_a_mask) {
    LabelImage mask{{10, 10, 10}, Eigen::Matrix4d::Identity(), std::vector<std::int32_t>(1000, 0)};
    mask.ras_from_voxel.topLeftCorner<3, 3>() *= 0.016;
    mask.ras_from_voxel.topRightCorner<3, 1>() = Vector3::Constant(-0.016 * 4.5);
    for (std::size_t v = 0; v < 1000; ++v)
        mask.values[v] = v % 10 < 7;  // the border is the plane x = 32 mm
    MeshingOptions options;
    options.edge_lengths_mm = {10};
    options.finer_at = mask_faces(mask);
    const FineSphere at_border{{0.032, 0, 0}, 0.008, 0}, elsewhere{{-0.02, 0, 0}, 0.015, 0};
    const HierarchyResult result = build_hierarchy(organ(), options);
    expect_valid(result);
    EXPECT_LT(mean_edge_in(result.hierarchy.levels[0], at_border),
              0.0085);  // 5 mm at the border, 7.4 mm at 8 mm from it
    EXPECT_GT(mean_edge_in(result.hierarchy.levels[0], elsewhere), 0.009);
    options.finer_at_ratio = 1;
    EXPECT_GT(mean_edge_in(build_hierarchy(organ(), options).hierarchy.levels[0], at_border),
              0.009);
}

/// The same number of tets as without patches, with shorter edges at the patch on two levels.
TEST(Hierarchy, is_graded_at_a_patch_at_the_same_number_of_tets) {
    MeshingOptions options;
    options.target_tets = 6000;
    options.levels = 2;
    options.grading.patches = {{{0, 0, 0.04}, 0.012}};
    const HierarchyResult result = build_hierarchy(organ(), options);
    expect_valid(result);
    ASSERT_EQ(result.levels.size(), 2u);
    EXPECT_NEAR(result.levels[0].quality.tets, 6000, 600);
    const FineSphere at_patch{{0, 0, 0.04}, 0.008, 0}, elsewhere{{0, 0, -0.02}, 0.015, 0};
    for (const TetMesh& level : result.hierarchy.levels)
        EXPECT_LT(mean_edge_in(level, at_patch), 0.6 * mean_edge_in(level, elsewhere));
    EXPECT_NE(result.hierarchy.provenance.find("edges times 0.25 on the surface within 12.000 mm"),
              std::string::npos)
        << result.hierarchy.provenance;
}

TEST(Hierarchy, grows_inside_as_far_as_asked) {
    MeshingOptions options;
    options.edge_lengths_mm = {5};
    std::vector<std::int64_t> tets;
    for (const double growth : {1.0, 3.0}) {
        options.inside_growth = growth;
        const HierarchyResult result = build_hierarchy(organ(), options);
        expect_valid(result);
        tets.push_back(result.levels[0].quality.tets);
    }
    EXPECT_LT(tets[1], 0.7 * tets[0]);
}

TEST(Hierarchy, fits_a_frame_budget) {
    EXPECT_EQ(tets_for_budget(6e-3), 60000);
    EXPECT_EQ(tets_for_budget(1e-9), min_tets);
    EXPECT_EQ(tets_for_budget(300), max_tets);
}

TEST(Hierarchy, refuses_options_out_of_range_by_name) {
    const auto refused = [](const std::function<void(MeshingOptions&)>& change,
                            const std::string& name) {
        MeshingOptions options;
        change(options);
        try {
            build_hierarchy(organ(), options);
            ADD_FAILURE() << name;
        } catch (const Error& error) {
            EXPECT_NE(std::string(error.what()).find(name + " = "), std::string::npos)
                << error.what();
        }
    };
    refused([](MeshingOptions& o) { o.levels = -1; }, "mesh.levels");
    refused([](MeshingOptions& o) { o.levels = 13; }, "mesh.levels");
    refused([](MeshingOptions& o) { o.target_tets = 0; }, "mesh.tets");
    refused([](MeshingOptions& o) { o.coarsening = 1; }, "MeshingOptions::coarsening");
    refused([](MeshingOptions& o) { o.voxel_mm = std::nan(""); }, "mesh.voxel_mm");
    refused([](MeshingOptions& o) { o.edge_lengths_mm = {8, 4}; }, "mesh.edge_lengths_mm[1]");
    refused([](MeshingOptions& o) { o.min_dihedral_deg = 40; }, "--min-dihedral-deg");
    refused([](MeshingOptions& o) { o.inside_growth = 0.5; }, "--inside-growth");
    refused([](MeshingOptions& o) { o.finer = {{}}; }, "--refine-sphere: radius in m");
    refused([](MeshingOptions& o) { o.finer_at_ratio = 0; }, "--fix-edge-ratio");
    refused([](MeshingOptions& o) { o.grading.patches = {{}}; }, "PatchGrading::Patch::radius_m");
    refused([](MeshingOptions& o) { o.grading.ratio = 0; }, "PatchGrading::ratio");
    refused([](MeshingOptions& o) { o.grading.growth = 2; }, "PatchGrading::growth");
    refused([](MeshingOptions& o) { o.gmsh_time_limit_s = 0; }, "--time-limit-s");
}

}  // namespace
}  // namespace livetet

#endif
