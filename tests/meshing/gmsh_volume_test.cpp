#include "meshing/gmsh_volume.hpp"

#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <set>

#include "base/error.hpp"
#include "mesh/shapes.hpp"
#include "meshing/shells.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {
namespace {

using Places = std::set<std::array<double, 3>>;

Places places(const std::vector<Vector3>& nodes, const std::vector<std::int32_t>& which) {
    Places found;
    for (const std::int32_t n : which) found.insert({nodes[n].x(), nodes[n].y(), nodes[n].z()});
    return found;
}

TEST(FillSurface, keeps_the_surface_to_the_last_bit) {
    const TriangleMesh sphere = shapes::sphere(0.05, 3, {0.1, -0.2, 0.3});
    const TetMesh mesh = fill_surface(sphere, 0.008);
    check_tet_mesh(mesh, "sphere");
    EXPECT_NEAR(volume(mesh), signed_volume(sphere), 1e-12);
    const std::vector<Triangle> boundary = boundary_triangles(mesh.tets);
    EXPECT_EQ(boundary.size(), sphere.triangles.size());
    EXPECT_EQ(places(mesh.nodes, nodes_of(boundary)),
              places(sphere.nodes, nodes_of(sphere.triangles)));
    EXPECT_GT(mesh.nodes.size(), sphere.nodes.size());
}

/// Two balls, one of which is hollow with a ball in the hollow.
TEST(FillSurface, leaves_cavities_empty_and_fills_each_piece) {
    TriangleMesh hole = shapes::sphere(0.03, 3, {0.004, 0, 0});
    for (Triangle& t : hole.triangles) std::swap(t[0], t[1]);
    const std::array<TriangleMesh, 4> shells{shapes::sphere(0.012, 2), shapes::sphere(0.05, 3),
                                             shapes::sphere(0.02, 3, {0.1, 0, 0}), hole};
    const TriangleMesh surface = joined(shells);
    for (const bool sized : {false, true}) {
        GmshOptions options;
        if (sized) options.edge_length_at = [](const Vector3&) { return 0.008; };
        const TetMesh mesh = fill_surface(surface, 0.008, options);
        check_tet_mesh(mesh, "hollow");
        EXPECT_NEAR(volume(mesh), signed_volume(surface), 1e-12) << sized;
        EXPECT_EQ(boundary_triangles(mesh.tets).size(), surface.triangles.size());
    }
}

TEST(FillSurface, is_the_same_every_time_whatever_the_heap_looks_like) {
    const TriangleMesh sphere = shapes::sphere(0.05, 4);
    const TetMesh first = fill_surface(sphere, 0.005);
    for (int again = 0; again < 2; ++again) {
        // Frees every second block, so that new ones come in another order.
        std::vector<std::vector<char>> holes;
        for (int i = 0; i < 20000; ++i) holes.emplace_back(16 + 16 * (i * 7 % 40));
        for (std::size_t i = 0; i < holes.size(); i += 2) std::vector<char>().swap(holes[i]);
        const TetMesh other = fill_surface(sphere, 0.005);
        EXPECT_EQ(first.nodes, other.nodes);
        EXPECT_EQ(first.tets, other.tets);
    }
}

TEST(FillSurface, falls_back_to_delaunay_when_hxt_crashes) {
    GmshOptions options;
    int calls = 0;
    options.run = [&](const std::function<int(int)>& work, double limit) {
        if (++calls == 1) return run_in_child([](int) -> int { std::abort(); }, limit);
        return run_in_child(work, limit);
    };
    const TetMesh mesh = fill_surface(shapes::sphere(0.05, 2), 0.015, options);
    EXPECT_EQ(calls, 2);
    check_tet_mesh(mesh, "sphere");
}

TEST(FillSurface, kills_a_hanging_gmsh_and_says_so) {
    GmshOptions options;
    options.time_limit_s = 0.4;
    int calls = 0;
    options.run = [&](const std::function<int(int)>&, double limit) {
        ++calls;
        return run_in_child([](int) { return static_cast<int>(::sleep(600)); }, limit);
    };
    try {
        fill_surface(shapes::sphere(0.05, 2), 0.015, options);
        FAIL() << "it hung";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("HXT did not end within 0.2 s and was killed"),
                  std::string::npos)
            << error.what();
    }
    EXPECT_EQ(calls, 2);  // each gets half of the time
}

TEST(FillSurface, passes_on_the_last_words_of_gmsh) {
    GmshOptions options;
    options.run = [&](const std::function<int(int)>&, double limit) {
        return run_in_child(
            [](int) {
                std::fprintf(stderr, "Info    : meshing\nError   : the moon is full\n");
                return 1;
            },
            limit);
    };
    try {
        fill_surface(shapes::sphere(0.05, 2), 0.015, options);
        FAIL() << "it failed";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("the moon is full"), std::string::npos)
            << error.what();
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
}

TEST(FillSurface, passes_on_an_error_of_the_edge_lengths) {
    GmshOptions options;
    options.edge_length_at = [](const Vector3& x) -> double {
        fail("no edge length is known at {:.0f} mm", 1e3 * x.norm());
    };
    try {
        fill_surface(shapes::sphere(0.05, 2), 0.015, options);
        FAIL() << "it meshed";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("no edge length is known at"), std::string::npos)
            << error.what();
    }
}

TEST(FillSurface, refuses_an_open_surface_without_asking_gmsh) {
    TriangleMesh surface = shapes::sphere(0.05, 2);
    surface.triangles.pop_back();
    GmshOptions options;
    options.run = [](const std::function<int(int)>&, double) -> ChildResult {
        throw std::logic_error("asked");
    };
    EXPECT_THROW(fill_surface(surface, 0.01, options), Error);
}

TEST(FillSurface, fails_on_a_surface_that_cuts_itself) {
    TriangleMesh surface = shapes::sphere(0.05, 2);
    surface.nodes[0] *= -1.5;
    EXPECT_THROW(fill_surface(surface, 0.015, {.time_limit_s = 20}), Error);
}

}  // namespace
}  // namespace livetet
