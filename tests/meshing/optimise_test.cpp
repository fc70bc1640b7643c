#include "meshing/optimise.hpp"

#include <gtest/gtest.h>

#include <random>

#include "mesh/shapes.hpp"
#include "meshing/quality.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {
namespace {

TriangleMesh boundary(const TetMesh& mesh) { return {mesh.nodes, boundary_triangles(mesh.tets)}; }

OptimiseReport improve(TetMesh& mesh, double aim_deg) {
    const TriangleMesh surface = boundary(mesh);
    return raise_dihedral_angles(mesh, {surface.nodes, surface.triangles}, aim_deg);
}

/// Expects a closed manifold of positive tets with this volume.
void expect_whole(const TetMesh& mesh, double expected_volume) {
    check_tet_mesh(mesh, "improved");
    EXPECT_TRUE(check_topology(boundary(mesh)).closed());
    EXPECT_NEAR(volume(mesh), expected_volume, 3e-3 * expected_volume);
}

/// A block whose inner nodes are moved at random as far as no tet is inverted.
TetMesh shaken_block(unsigned seed) {
    TetMesh mesh = shapes::box({1, 1, 1}, {6, 6, 6});
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> push(-0.13, 0.13);
    for (Vector3& x : mesh.nodes) {
        if (x.minCoeff() < 1e-9 || x.maxCoeff() > 1 - 1e-9) continue;
        const Vector3 home = x;
        x += Vector3(push(random), push(random), push(random));
        for (const Tet& t : mesh.tets)
            if (signed_volume(mesh, t) <= 1e-7) x = home;
    }
    return mesh;
}

TEST(Optimise, lifts_shaken_blocks_above_the_aim) {
    OptimiseReport all;
    for (const unsigned seed : {1u, 2u, 3u}) {
        TetMesh mesh = shaken_block(seed);
        ASSERT_LT(measure_quality(mesh).min_dihedral_deg, 3);
        const OptimiseReport report = improve(mesh, 10);
        all.moves += report.moves;
        all.flips += report.flips;
        expect_whole(mesh, 1);
        EXPECT_GE(measure_quality(mesh).min_dihedral_deg, 10);
    }
    EXPECT_GT(all.moves, 0);
    EXPECT_GT(all.flips, 0);
}

TEST(Optimise, collapses_what_moves_and_flips_cannot_mend) {
    int collapses = 0;
    for (const unsigned seed : {1u, 2u, 3u}) {
        TetMesh mesh = shaken_block(seed);
        // More than a plain block can reach, so that all operations are tried.
        collapses += improve(mesh, 30).collapses;
        check_tet_mesh(mesh, "improved");
        EXPECT_TRUE(check_topology(boundary(mesh)).closed());
    }
    EXPECT_GT(collapses, 0);
}

TEST(Optimise, leaves_what_is_good_alone) {
    TetMesh mesh = shapes::box({1, 1, 1}, {3, 3, 3});
    const TetMesh before = mesh;
    improve(mesh, 10);
    EXPECT_EQ(mesh.nodes, before.nodes);
    EXPECT_EQ(mesh.tets, before.tets);
}

/// A flat tet on a face of a block, both outer faces on the boundary: moving nodes along the
/// surface cannot improve it.
TEST(Optimise, leaves_out_a_flat_tet_on_the_boundary) {
    TetMesh mesh = shapes::box({1, 1, 1}, {2, 2, 2});
    const std::vector<Triangle> faces = boundary_triangles(mesh.tets);
    for (const Triangle& f : faces)
        for (const Triangle& g : faces) {
            std::vector<std::int32_t> shared, rest;
            for (const std::int32_t n : f)
                (std::count(g.begin(), g.end(), n) ? shared : rest).push_back(n);
            for (const std::int32_t n : g)
                if (!std::count(f.begin(), f.end(), n)) rest.push_back(n);
            const bool top =
                std::all_of(f.begin(), f.end(), [&](int n) { return mesh.nodes[n].z() == 1; }) &&
                std::all_of(g.begin(), g.end(), [&](int n) { return mesh.nodes[n].z() == 1; });
            if (shared.size() != 2 || !top || rest.size() != 2) continue;
            // The shared edge sinks below the line of the other two nodes.
            mesh.nodes[rest[0]].z() += 1e-4;
            mesh.nodes[rest[1]].z() += 1e-4;
            Tet flat{shared[0], shared[1], rest[0], rest[1]};
            if (signed_volume(mesh, flat) < 0) std::swap(flat[2], flat[3]);
            mesh.tets.push_back(flat);
            ASSERT_LT(measure_quality(mesh).min_dihedral_deg, 1);
            const OptimiseReport report = improve(mesh, 10);
            EXPECT_EQ(report.peeled_tets, 1);
            expect_whole(mesh, 1);
            EXPECT_GT(measure_quality(mesh).min_dihedral_deg, 10);
            return;
        }
    FAIL() << "no two triangles on the top";
}

}  // namespace
}  // namespace livetet
