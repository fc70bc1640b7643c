#include "apps/scene/scene_forces.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "apps/scene/cuts.hpp"
#include "mesh/quadratic_hexahedra.hpp"
#include "support/hex_grids.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// Two cells of 10 mm side by side along x, the second a tenth inside of the body; a force on all
/// nodes.
Scene pulled_cells() {
    Scene scene;
    LoadOptions& load = scene.loads.emplace_back();
    load.half_space_mm = {0, 0, 100, 0, 0, 1};
    load.force_N = {0, 0, 3};
    return scene;
}
TetMesh two_cells() {
    TetMesh mesh = test::hex_grid({2, 1, 1}, {0.02, 0.01, 0.01});
    mesh.shares = {1, 0.1};
    return mesh;
}

TEST(SceneForces, NodesOfAGridBearThemByTheTissueAroundThem) {
    const TetMesh mesh = two_cells();
    const std::vector<Vector3> force = scene_forces(pulled_cells(), mesh);
    // By shares 1 : 1.1 : 0.1 of an eighth of a cell, four nodes each.
    for (std::size_t n = 0; n < force.size(); ++n) {
        const double x = mesh.nodes[n].x();
        const double share = x < 0.005 ? 1 : x < 0.015 ? 1.1 : 0.1;
        EXPECT_NEAR(force[n].z(), 3 * share / (4 * 2.2), 1e-12) << x;
    }
}

TEST(SceneForces, SoDoThoseOfOrderTwo) {
    const TetMesh mesh = quadratic_grid(two_cells());
    const std::vector<Vector3> force = scene_forces(pulled_cells(), mesh);
    double sum = 0;
    std::map<int, double> of_plane;  // of a node in the middle of the cell's faces along y and z
    for (std::size_t n = 0; n < force.size(); ++n) {
        sum += force[n].z();
        const Vector3 x = 1e3 * mesh.nodes[n];
        if (std::abs(x.y() - 5) < 1e-6 && std::abs(x.z() - 5) < 1e-6)
            of_plane[static_cast<int>(std::lround(x.x()))] = force[n].z();
    }
    EXPECT_NEAR(sum, 3, 1e-12);
    ASSERT_EQ(of_plane.size(), 5U);
    // On a face half of the tissue around is missing; a middle has its own cell alone.
    EXPECT_NEAR(of_plane[5] / of_plane[0], 2, 1e-9);
    EXPECT_NEAR(of_plane[10] / of_plane[0], 1.1, 1e-9);
    EXPECT_NEAR(of_plane[15] / of_plane[0], 0.2, 1e-9);
    EXPECT_NEAR(of_plane[20] / of_plane[0], 0.1, 1e-9);
}

/// The rim of a cut has nodes on the surface, and its wall faces between three of these.
TEST(SceneForces, APressureOnTheSurfaceActsOnNoWallOfACut) {
    const Vector3 size(0.08, 0.04, 0.04);
    for (TetMesh& mesh :
         std::vector<TetMesh>{test::block({8, 4, 4}, size), test::hex_grid({8, 4, 4}, size)}) {
        Scene scene;
        scene.fix.emplace_back().half_space_mm = {0.1, 0, 0, 1, 0, 0};
        scene.drive.emplace_back().half_space_mm = {79.9, 0, 0, -1, 0, 0};
        CutOptions& cut = scene.cuts.emplace_back();
        cut.point_mm = Vector3(40, 20, 20);
        cut.normal = Vector3(1, 0, 0);
        LoadOptions& load = scene.loads.emplace_back();
        load.box_mm = {20, -1, -1, 60, 50, 50};
        load.pressure_Pa = 100;
        const MeshHierarchy made = with_cuts(scene, make_hierarchy({std::move(mesh)}, "a block"));
        const auto largest_along_x = [&](NodeScope where) {
            load.where = where;
            double largest = 0;
            for (const Vector3& f : scene_forces(scene, made.levels.front()))
                largest = std::max(largest, std::abs(f.x()));
            return largest;
        };
        EXPECT_LT(largest_along_x(NodeScope::surface_only), 1e-12);
        EXPECT_GT(largest_along_x(NodeScope::all), 1e-3);
    }
}

}  // namespace
}  // namespace livetet
