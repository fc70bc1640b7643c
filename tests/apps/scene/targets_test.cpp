#include "apps/scene/targets.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "base/error.hpp"
#include "mesh/quadratic.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// A block of 200 x 100 x 100 mm, with the set "tumour": its nodes within 30 mm of the centre.
const TetMesh& block_with_tumour() {
    static const TetMesh mesh = [] {
        TetMesh block = test::block({16, 8, 8}, {0.2, 0.1, 0.1});
        block.node_sets["tumour"] = test::nodes_where(
            block, [](const Vector3& x) { return (x - Vector3(0.1, 0.05, 0.05)).norm() < 0.03; });
        return block;
    }();
    return mesh;
}

Scene with_targets(std::vector<TargetOptions> targets) {
    Scene scene;
    scene.track.emplace();
    scene.track->targets = std::move(targets);
    return scene;
}

TargetOptions point(const std::string& name, const Vector3& mm) {
    TargetOptions target;
    target.name = name;
    target.point_mm = mm;
    return target;
}

TEST(Targets, APointIsOnePlaceAndARegionSomeSpreadOverIt) {
    TargetOptions region;
    region.name = "Tumour";
    region.group = "tumour";
    const auto targets =
        read_targets(with_targets({point("Vessel", {20, 30, 40}), region}), block_with_tumour());
    ASSERT_EQ(targets.size(), 2u);
    EXPECT_EQ(targets[0].name, "Vessel");
    EXPECT_EQ(targets[0].places, std::vector{Vector3(0.02, 0.03, 0.04)});
    EXPECT_EQ(targets[1].name, "Tumour");
    ASSERT_EQ(targets[1].places.size(), max_places_of_region);
    EXPECT_LT((targets[1].places.front() - Vector3(0.1, 0.05, 0.05)).norm(), 1e-9)
        << "first its centre";
    double farthest = 0;
    for (std::size_t i = 0; i < max_places_of_region; ++i) {
        farthest = std::max(farthest, (targets[1].places[i] - targets[1].places[0]).norm());
        for (std::size_t j = 0; j < i; ++j)
            EXPECT_GT((targets[1].places[i] - targets[1].places[j]).norm(), 0.01) << "spread";
    }
    EXPECT_GT(farthest, 0.025) << "up to its rim";
}

TEST(Targets, ASurfaceHasPlacesAllOverIt) {
    const TetMesh& mesh = block_with_tumour();
    const std::vector<Vector3> places = surface_places(mesh);
    ASSERT_EQ(places.size(), max_places_of_surface);
    const auto nearest = [&](const Vector3& x) {
        double distance = 1;
        for (const Vector3& place : places) distance = std::min(distance, (place - x).norm());
        return distance;
    };
    const std::vector<std::int32_t> surface = surface_nodes(mesh);
    // 96 discs of the surface's area, 0.1 m^2, have a radius of 18 mm; the places are nodes.
    for (const std::int32_t n : surface) EXPECT_LT(nearest(mesh.nodes[n]), 0.026);
    for (const Vector3& place : places)
        EXPECT_TRUE(
            std::ranges::any_of(surface, [&](std::int32_t n) { return mesh.nodes[n] == place; }));
    const TetMesh small = test::block({1, 1, 1}, {0.1, 0.1, 0.1});
    EXPECT_EQ(surface_places(small).size(), 8u) << "all there are";
}

TEST(Targets, PointsOfAFileHaveTheirNames) {
    const test::Folder folder;
    test::write_text(folder / "points.csv", "name,x_mm,y_mm,z_mm\nA,10,10,10\nB,20,20,20\n");
    TargetOptions file;
    file.points = folder / "points.csv";
    const auto targets = read_targets(with_targets({file}), block_with_tumour());
    ASSERT_EQ(targets.size(), 2u);
    EXPECT_EQ(targets[1].name, "B");
    try {
        read_targets(with_targets({point("A", {1, 1, 1}), file}), block_with_tumour());
        ADD_FAILURE() << "two targets of one name";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("two targets are called A"), std::string::npos);
    }
}

TEST(Targets, APointOutsideTheOrganIsRefusedByNameAndPlace) {
    try {
        read_targets(with_targets({point("Lost", {250, 30, 40})}), block_with_tumour());
        FAIL();
    } catch (const Error& error) {
        EXPECT_STREQ(error.what(),
                     "track.targets: Lost at (250.0, 30.0, 40.0) mm is 50.0 mm outside the mesh, "
                     "expected a place in the organ");
    }
}

}  // namespace
}  // namespace livetet
