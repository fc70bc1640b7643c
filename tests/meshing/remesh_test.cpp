#ifdef LIVETET_IMAGES

#include "meshing/remesh.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <random>

#include "base/error.hpp"
#include "mesh/shapes.hpp"
#include "meshing/shells.hpp"
#include "meshing/surface_check.hpp"
#include "meshing/wrap.hpp"

namespace livetet {
namespace {

std::string error_of(const std::function<void()>& work) {
    try {
        work();
    } catch (const Error& error) {
        return error.what();
    }
    return {};
}

/// Separates the triangles' nodes, as in an STL file.
TriangleMesh torn(const TriangleMesh& surface) {
    TriangleMesh soup;
    for (const Triangle& t : surface.triangles) {
        const auto n = static_cast<std::int32_t>(soup.nodes.size());
        for (const std::int32_t corner : t) soup.nodes.push_back(surface.nodes[corner]);
        soup.triangles.push_back({n, n + 1, n + 2});
    }
    return soup;
}

TEST(Repair, merges_the_nodes_of_a_torn_sphere) {
    const TriangleMesh sphere = shapes::sphere(0.05, 3);
    const TriangleMesh repaired = repair_surface(torn(sphere));
    EXPECT_EQ(repaired.nodes.size(), sphere.nodes.size());
    EXPECT_TRUE(check_topology(repaired).closed());
    EXPECT_NEAR(signed_volume(repaired), signed_volume(sphere), 1e-12);
}

TEST(Repair, turns_an_inside_out_or_jumbled_surface_outwards) {
    const TriangleMesh sphere = shapes::sphere(0.05, 3);
    TriangleMesh inside_out = sphere, jumbled = sphere;
    for (std::size_t i = 0; i < sphere.triangles.size(); ++i) {
        std::swap(inside_out.triangles[i][0], inside_out.triangles[i][1]);
        if (i % 3 == 0) std::swap(jumbled.triangles[i][0], jumbled.triangles[i][1]);
    }
    for (const TriangleMesh& wrong : {inside_out, jumbled}) {
        const TriangleMesh repaired = repair_surface(wrong);
        EXPECT_TRUE(check_topology(repaired).closed());
        EXPECT_NEAR(signed_volume(repaired), signed_volume(sphere), 1e-12);
    }
}

TEST(Repair, drops_degenerate_triangles_and_double_ones_and_fills_a_small_hole) {
    TriangleMesh surface = shapes::sphere(0.05, 3);
    const double volume = signed_volume(surface);
    surface.triangles.push_back({5, 5, 9});
    surface.triangles.push_back(surface.triangles[100]);
    surface.triangles.erase(surface.triangles.begin() + 7);
    const TriangleMesh repaired = repair_surface(surface);
    EXPECT_TRUE(check_topology(repaired).closed());
    EXPECT_NEAR(signed_volume(repaired), volume, 0.01 * volume);
}

TEST(Repair, refuses_half_a_sphere_and_counts_its_border) {
    TriangleMesh surface = shapes::sphere(0.05, 3, {0.1, 0.2, 0.3});
    std::erase_if(surface.triangles,
                  [&](const Triangle& t) { return surface.nodes[t[0]].z() > 0.3; });
    const std::int64_t border = check_topology(surface).border_edges;
    ASSERT_GT(border, 0);
    const std::string text = error_of([&] { repair_surface(surface); });
    EXPECT_NE(text.find(fmt::format("{} border edges", border)), std::string::npos) << text;
    EXPECT_NE(text.find(") mm"), std::string::npos) << text;
}

TEST(Repair, refuses_a_non_manifold_edge_within_seconds) {
    // A fin: a triangle standing on an edge of the sphere.
    TriangleMesh surface = shapes::sphere(0.05, 4);
    const Triangle t = surface.triangles[40];
    surface.nodes.push_back(1.3 * surface.nodes[t[0]]);
    surface.triangles.push_back({t[0], t[1], static_cast<std::int32_t>(surface.nodes.size()) - 1});
    const auto start = std::chrono::steady_clock::now();
    const std::string text = error_of([&] { repair_surface(surface); });
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
    EXPECT_NE(text.find("1 non-manifold edges"), std::string::npos) << text;
    EXPECT_NE(text.find(place_mm((surface.nodes[t[0]] + surface.nodes[t[1]]) / 2)),
              std::string::npos)
        << text;
}

/// A ball whose nodes are shaken; its edges are 2.6 mm long.
TriangleMesh crumpled(double by) {
    TriangleMesh surface = shapes::sphere(0.05, 5);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> push(-by, by);
    for (Vector3& x : surface.nodes) x += Vector3(push(random), push(random), push(random));
    return surface;
}

TEST(Repair, counts_and_refuses_a_surface_of_many_cuts_within_seconds) {
    const TriangleMesh surface = crumpled(0.004);  // tens of thousands of cuts
    const auto start = std::chrono::steady_clock::now();
    const std::string text = error_of([&] { repair_surface(surface); });
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
    for (const char* words : {"pairs of its 20480 triangles cut each other", ") mm", "--wrap"})
        EXPECT_NE(text.find(words), std::string::npos) << text;
}

/// Of an open ball whose triangles also cut each other.
TEST(Wrap, encloses_what_is_open_and_crossing_and_states_the_distance) {
    TriangleMesh surface = crumpled(0.0015);
    std::erase_if(surface.triangles,
                  [&](const Triangle& t) { return surface.nodes[t[0]].z() > 0.049; });
    const WrappedSurface wrap = wrap_surface(surface, 0.015);
    EXPECT_TRUE(check_topology(wrap.surface).closed());
    EXPECT_EQ(find_self_intersections(wrap.surface).pairs, 0);
    const double ball = signed_volume(shapes::sphere(0.05, 5));
    EXPECT_NEAR(signed_volume(wrap.surface), ball, 0.1 * ball);
    EXPECT_GT(wrap.distance.to_body.max_m, 0.0005);
    EXPECT_LT(wrap.distance.to_body.max_m, 0.01);
    EXPECT_LT(wrap.distance.from_body.max_m, 0.01);
}

TEST(Repair, refuses_surfaces_without_sense) {
    EXPECT_THROW(repair_surface({}), Error);
    TriangleMesh surface = shapes::sphere(0.05, 1);
    surface.triangles[3][1] = 1000;
    EXPECT_THROW(repair_surface(surface), Error);
    surface = shapes::sphere(0.05, 1);
    surface.nodes[2].x() = std::nan("");
    EXPECT_THROW(repair_surface(surface), Error);
    for (Vector3& x : surface.nodes) x = Vector3(1, 2, 3);
    EXPECT_THROW(repair_surface(surface), Error);
}

TEST(RepairSurface, says_what_it_leaves_out_or_fills) {
    const auto notes_of = [](const TriangleMesh& surface) {
        std::vector<std::string> notes;
        repair_surface(surface, {}, &notes);
        return notes;
    };
    const TriangleMesh sphere = shapes::sphere(0.05, 3);
    EXPECT_TRUE(notes_of(sphere).empty());
    const auto with = [&](const TriangleMesh& other) {
        TriangleMesh both = sphere;
        const auto first = static_cast<std::int32_t>(sphere.nodes.size());
        both.nodes.insert(both.nodes.end(), other.nodes.begin(), other.nodes.end());
        for (const auto& [a, b, c] : other.triangles)
            both.triangles.push_back({first + a, first + b, first + c});
        return both;
    };
    const TriangleMesh spleen = shapes::sphere(0.03, 3, {0.2, 0, 0});
    const auto parts = notes_of(with(spleen));
    ASSERT_EQ(parts.size(), 1u);
    EXPECT_NE(parts[0].find(
                  fmt::format("{:.4g} ml in the others are left out", 1e6 * signed_volume(spleen))),
              std::string::npos)
        << parts[0];
    EXPECT_NE(parts[0].find("(170.00, "), std::string::npos) << parts[0];
    const auto hollow = notes_of(with(shapes::sphere(0.03, 3)));
    ASSERT_EQ(hollow.size(), 1u);
    EXPECT_NE(hollow[0].find("1 cavity of 112.1 ml kept"), std::string::npos) << hollow[0];
    TriangleMesh open = sphere;
    open.triangles.erase(open.triangles.begin() + 100);
    const auto hole = notes_of(open);
    ASSERT_EQ(hole.size(), 1u);
    EXPECT_NE(hole[0].find("1 hole filled"), std::string::npos) << hole[0];
}

/// A surface file's inner shell, however it is wound.
TEST(RepairSurface, takes_an_inner_shell_for_a_cavity) {
    const std::array<TriangleMesh, 2> shells{shapes::sphere(0.03, 3), shapes::sphere(0.05, 3)};
    const double hollow = signed_volume(shells[0]), whole = signed_volume(shells[1]);
    const TriangleMesh kept = repair_surface(joined(shells));
    EXPECT_NEAR(signed_volume(kept), whole - hollow, 1e-12);
    EXPECT_EQ(count_shells(pieces_of(kept)), (ShellCount{1, 1}));
    EXPECT_NEAR(signed_volume(repair_surface(joined(shells), {.cavities = Cavities::fill})), whole,
                1e-12);
}

TEST(RepairSurface, takes_all_parts_where_it_is_asked_to_and_drops_specks) {
    const std::array<TriangleMesh, 3> shells{shapes::sphere(0.05, 3),
                                             shapes::sphere(0.03, 3, {0.2, 0, 0}),
                                             shapes::sphere(0.002, 3, {0.3, 0, 0})};
    std::vector<std::string> notes;
    const TriangleMesh both = repair_surface(joined(shells), {.parts = Parts::all}, &notes);
    EXPECT_NEAR(signed_volume(both), signed_volume(shells[0]) + signed_volume(shells[1]), 1e-12);
    ASSERT_EQ(notes.size(), 2u);
    EXPECT_NE(notes[0].find("1 shell of 0.03"), std::string::npos) << notes[0];
    EXPECT_NE(notes[1].find("part_2"), std::string::npos) << notes[1];
}

TEST(Remesh, keeps_the_volume_of_each_shell) {
    TriangleMesh hole = shapes::sphere(0.03, 4);
    for (Triangle& t : hole.triangles) std::swap(t[0], t[1]);
    const std::array<TriangleMesh, 2> shells{shapes::sphere(0.05, 4), hole};
    double edge = 0.012;
    const std::vector<BodyPiece> pieces = pieces_of(remesh_surface(joined(shells), edge, 5, 6));
    ASSERT_EQ(count_shells(pieces), (ShellCount{1, 1}));
    const double outer = signed_volume(shells[0]), inner = signed_volume(hole);
    EXPECT_NEAR(signed_volume(pieces[0].outer), outer, 1e-4 * outer);
    EXPECT_NEAR(signed_volume(pieces[0].cavities[0]), inner, 1e-4 * std::abs(inner));
}

TEST(Remesh, gives_edges_of_the_length_asked_for) {
    const TriangleMesh sphere = shapes::sphere(0.05, 4);
    for (const double edge : {0.003, 0.008, 0.02}) {
        double made = edge;
        const TriangleMesh result = remesh_surface(sphere, made, 5, 6);
        EXPECT_TRUE(check_topology(result).closed());
        EXPECT_EQ(find_self_intersections(result).pairs, 0);
        EXPECT_EQ(made, edge);
        EXPECT_NEAR(shapes::mean_edge(result), edge, 0.2 * edge);
        EXPECT_GT(signed_volume(result), 0.9 * signed_volume(sphere));
    }
}

TEST(Remesh, makes_the_edges_smaller_where_the_ones_asked_for_are_too_coarse) {
    const TriangleMesh sphere = shapes::sphere(0.05, 4);
    double edge = 0.15;
    const TriangleMesh result = remesh_surface(sphere, edge, 5, 12);
    EXPECT_TRUE(check_topology(result).closed());
    EXPECT_GT(signed_volume(result), 0.5 * signed_volume(sphere));
    EXPECT_LT(edge, 0.15);
    edge = 100;
    EXPECT_THROW(remesh_surface(sphere, edge, 5, 2), Error);
}

TEST(Remesh, sees_triangles_that_cut_each_other) {
    TriangleMesh surface = shapes::sphere(0.05, 2);
    EXPECT_EQ(find_self_intersections(surface).pairs, 0);
    surface.nodes[0] *= -1.5;  // moved through the opposite wall
    const SelfIntersections cuts = find_self_intersections(surface);
    EXPECT_GT(cuts.pairs, 0);
    EXPECT_LT(cuts.place.norm(), 0.08);
}

}  // namespace
}  // namespace livetet

#endif
