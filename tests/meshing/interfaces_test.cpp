#include "meshing/interfaces.hpp"

#include <gtest/gtest.h>

#include <random>

#include "base/error.hpp"
#include "mesh/shapes.hpp"
#include "meshing/optimise.hpp"
#include "meshing/quality.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {
namespace {

Vector3 centre(const TetMesh& mesh, const Tet& t) {
    return (mesh.nodes[t[0]] + mesh.nodes[t[1]] + mesh.nodes[t[2]] + mesh.nodes[t[3]]) / 4;
}

/// A unit block of 6 x 6 x 6 boxes; each tet has the region `region`(its centre).
TetMesh block(const std::function<std::int32_t(const Vector3&)>& region) {
    TetMesh mesh = shapes::box({1, 1, 1}, {6, 6, 6});
    for (const Tet& t : mesh.tets) mesh.regions.push_back(region(centre(mesh, t)));
    return mesh;
}

TEST(Interfaces, are_the_faces_between_regions_and_the_boundary) {
    const TetMesh mesh = block([](const Vector3& x) { return x.x() < 0.5 ? 7 : 3; });
    double between = 0, outer = 0;
    for (const InterfaceTriangle& f : interface_triangles(mesh)) {
        const Vector3& a = mesh.nodes[f.nodes[0]];
        const Vector3 area = (mesh.nodes[f.nodes[1]] - a).cross(mesh.nodes[f.nodes[2]] - a) / 2;
        if (f.outside == 0) {
            outer += area.norm();
            continue;
        }
        EXPECT_EQ(f.inside, 3);
        EXPECT_EQ(f.outside, 7);
        EXPECT_LT(area.x(), 0);  // outwards from region 3, which is at high x
        between += area.norm();
    }
    EXPECT_NEAR(between, 1, 1e-12);
    EXPECT_NEAR(outer, 6, 1e-12);
}

TEST(RegionVolumes, come_out_as_wanted) {
    TetMesh mesh = block([](const Vector3& x) { return x.x() < 0.5 ? (x.y() < 0.5 ? 1 : 2) : 3; });
    const std::map<std::int32_t, double> wanted{{1, 0.26}, {2, 0.235}, {3, 0.52}};
    keep_region_volumes(mesh, wanted, 10, 4);
    for (const auto& [region, volume] : region_volumes(mesh))
        EXPECT_NEAR(volume, wanted.at(region), 1e-4) << region;
    EXPECT_GE(measure_quality(mesh).min_dihedral_deg, 10);
}

TEST(RegionVolumes, of_a_mesh_without_regions_are_that_of_region_1) {
    const auto volumes = region_volumes(shapes::box({1, 1, 1}, {2, 2, 2}));
    ASSERT_EQ(volumes.size(), 1u);
    EXPECT_NEAR(volumes.at(1), 1, 1e-12);
}

TEST(RegionVolumes, give_way_to_angles) {
    TetMesh mesh = block([](const Vector3& x) { return x.x() < 0.5 ? 1 : 2; });
    keep_region_volumes(mesh, {{1, 0.05}, {2, 0.95}}, 20, 20);
    EXPECT_GE(measure_quality(mesh).min_dihedral_deg, 20);
    EXPECT_LT(region_volumes(mesh).at(1), 0.5);
}

/// Expects one body, closed and manifold at edges and nodes.
void expect_one_body(const TetMesh& mesh) {
    check_tet_mesh(mesh, "body");
    const TriangleMesh boundary{mesh.nodes, boundary_triangles(mesh.tets)};
    EXPECT_TRUE(check_topology(boundary).closed());
    const auto parts = connected_parts(boundary);
    EXPECT_EQ(*std::max_element(parts.begin(), parts.end()), 0);
    // Around each node the triangles must form one fan: edges at the node lead from each to the
    // next.
    for (const std::int32_t n : nodes_of(boundary.triangles)) {
        std::map<std::int32_t, std::int32_t> next;
        for (const Triangle& t : boundary.triangles) {
            const auto at = std::find(t.begin(), t.end(), n) - t.begin();
            if (at == 3) continue;
            EXPECT_TRUE(next.emplace(t[(at + 1) % 3], t[(at + 2) % 3]).second);
        }
        std::size_t steps = 0;
        std::int32_t at = next.begin()->first;
        do at = next.at(at), ++steps;
        while (at != next.begin()->first);
        EXPECT_EQ(steps, next.size());
    }
}

TEST(OneBody, cuts_what_hangs_on_by_an_edge_or_a_node) {
    for (const double z :
         // Connected by an edge; where the second block is also above, by a node.
         {0.5, 0.0}) {
        TetMesh mesh = block([&](const Vector3& x) {
            const bool big = x.x() < 0.5 && x.y() < 0.5 && x.z() < 0.5;
            const bool small = x.x() > 0.5 && x.y() > 0.5 && x.x() < 0.84 &&
                               (z == 0.5 ? x.z() < 0.5 : x.z() > 0.5);
            return big ? 1 : small ? 2 : 0;
        });
        make_one_body(mesh);
        expect_one_body(mesh);
        EXPECT_NEAR(volume(mesh), 0.125, 1e-12);
        EXPECT_FALSE(region_volumes(mesh).contains(2));
    }
}

TEST(OneBody, fills_hollows_and_closes_pinches) {
    TetMesh hollow = block([](const Vector3& x) {
        return (x - Vector3(0.5, 0.5, 0.5)).cwiseAbs().maxCoeff() < 0.17 ? 0 : 4;
    });
    make_one_body(hollow);
    expect_one_body(hollow);
    EXPECT_NEAR(volume(hollow), 1, 1e-12);
    // Two notches that meet along an edge in the middle of a slab.
    TetMesh pinched = block([](const Vector3& x) {
        const bool notch =
            x.z() > 0.5 && ((x.x() < 0.5 && x.y() < 0.5) || (x.x() > 0.5 && x.y() > 0.5));
        return notch ? 0 : 1;
    });
    make_one_body(pinched);
    expect_one_body(pinched);
    EXPECT_NEAR(volume(pinched), 0.75, 0.1);
}

TEST(OneBody, keeps_cavities_and_parts_of_the_size_that_it_is_told) {
    const auto mesh = [] {
        return block([](const Vector3& x) {
            const double from_centre = (x - Vector3(0.5, 0.5, 0.5)).cwiseAbs().maxCoeff();
            return from_centre < 0.17 ? 0 : 4;
        });
    };
    const double cavity = 1 - volume([&] {
                              TetMesh kept = mesh();
                              make_one_body(kept, {.cavity_m3 = 1e-3});
                              return kept;
                          }());
    EXPECT_NEAR(cavity, std::pow(2 / 6., 3), 1e-12);
    TetMesh filled = mesh();
    make_one_body(filled, {.cavity_m3 = 1.1 * cavity});
    EXPECT_NEAR(volume(filled), 1, 1e-12);
    TetMesh parts = block([](const Vector3& x) { return std::abs(x.x() - 0.5) < 0.17 ? 0 : 4; });
    make_one_body(parts, {.part_m3 = 0.1});
    EXPECT_NEAR(volume(parts), 4 / 6., 1e-12);
}

TEST(OneBody, that_is_one_stays_as_it_is) {
    TetMesh mesh = block([](const Vector3& x) {
        return (x - Vector3(0.5, 0.5, 0.5)).cwiseAbs().maxCoeff() < 0.34 ? 5 : 0;
    });
    make_one_body(mesh);
    expect_one_body(mesh);
    EXPECT_NEAR(volume(mesh), std::pow(4 / 6., 3), 1e-12);
}

/// Moves inner nodes at random; those on the plane x = 1/2 stay on it.
TetMesh shaken(unsigned seed) {
    TetMesh mesh = block([](const Vector3& x) { return x.x() < 0.5 ? 1 : x.y() < 0.5 ? 2 : 3; });
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> push(-0.13, 0.13);
    for (Vector3& x : mesh.nodes) {
        if (x.minCoeff() < 1e-9 || x.maxCoeff() > 1 - 1e-9) continue;
        if (std::abs(x.y() - 0.5) < 1e-9 && x.x() > 0.5 - 1e-9) continue;
        const Vector3 home = x;
        x += Vector3(std::abs(x.x() - 0.5) < 1e-9 ? 0 : push(random), push(random), push(random));
        for (const Tet& t : mesh.tets)
            if (signed_volume(mesh, t) <= 1e-7) x = home;
    }
    return mesh;
}

TEST(OptimiseRegions, raises_angles_and_keeps_interfaces) {
    int improved = 0;
    for (const unsigned seed : {1u, 2u, 3u, 4u}) {
        TetMesh mesh = shaken(seed);
        const auto before = region_volumes(mesh);
        const double worst = measure_quality(mesh).min_dihedral_deg;
        ASSERT_LT(worst, 3);
        raise_dihedral_angles(mesh, 10);
        check_tet_mesh(mesh, "improved");
        EXPECT_TRUE(check_topology({mesh.nodes, boundary_triangles(mesh.tets)}).closed());
        ASSERT_EQ(mesh.regions.size(), mesh.tets.size());
        for (const auto& [region, volume] : region_volumes(mesh))
            EXPECT_NEAR(volume, before.at(region), 5e-3);
        for (const InterfaceTriangle& f : interface_triangles(mesh))
            for (const std::int32_t n : f.nodes) {
                if (f.outside == 0) continue;
                const Vector3& x = mesh.nodes[n];
                EXPECT_LT(f.inside == 1 ? std::abs(x.x() - 0.5) : std::abs(x.y() - 0.5), 0.025);
            }
        if (measure_quality(mesh).min_dihedral_deg >= 10) ++improved;
    }
    EXPECT_GE(improved, 3);
}

}  // namespace
}  // namespace livetet
