#include "apps/scene/mesh_grading.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/error.hpp"
#include "mesh/shapes.hpp"

namespace livetet {
namespace {

/// A scene with a planned sensor and a driven sphere, and one of each without a place.
Scene planned_scene() {
    Scene scene;
    scene.mesh.grading = MeshGrading::scene;
    scene.track.emplace();
    scene.track->sensors.resize(2);
    scene.track->sensors[0].place_mm = Vector3(50, 50, 100);
    scene.track->sensors[0].patch_radius_mm = 12;
    scene.drive.resize(2);
    scene.drive[0].group = "top";
    scene.drive[1].sphere_mm = {0, 50, 50, 8};
    return scene;
}

TEST(MeshGrading, TakesPlannedSensorsAndDrivenSpheres) {
    const SceneGrading grading = grading_of(planned_scene());
    ASSERT_EQ(grading.patches.size(), 2u);
    EXPECT_EQ(grading.patches[0].key, "track.sensors[0].place_mm");
    EXPECT_LT((grading.patches[0].patch.centre - Vector3(0.05, 0.05, 0.1)).norm(), 1e-12);
    EXPECT_DOUBLE_EQ(grading.patches[0].patch.radius_m, 0.012);
    EXPECT_EQ(grading.patches[1].key, "drive[1].sphere_mm");
    EXPECT_DOUBLE_EQ(grading.patches[1].patch.radius_m, 0.008);
    EXPECT_EQ(grading.without_place, (std::vector<std::string>{"track.sensors[1]", "drive[0]"}));
}

TEST(MeshGrading, IsOffUnlessAskedFor) {
    Scene scene = planned_scene();
    scene.mesh.grading = MeshGrading::even;
    EXPECT_TRUE(grading_of(scene).patches.empty());
    EXPECT_EQ(grading_by(scene).patches.size(), 2u);
}

TEST(MeshGrading, RefusesASceneWithoutPlaces) {
    Scene scene;
    scene.mesh.grading = MeshGrading::scene;
    try {
        (void)grading_of(scene);
        ADD_FAILURE();
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("mesh.grading = scene: the scene states no place"),
                  std::string::npos)
            << error.what();
    }
}

/// What the mesh depends on differs where a place or a radius does.
TEST(MeshGrading, TextTellsScenesApart) {
    Scene scene = planned_scene();
    const std::string before = grading_of(scene).text();
    scene.track->sensors[0].patch_radius_mm = 12.001;
    const std::string wider = grading_of(scene).text();
    scene.track->sensors[0].place_mm->x() += 0.001;
    EXPECT_NE(before, wider);
    EXPECT_NE(wider, grading_of(scene).text());
    EXPECT_TRUE(SceneGrading{}.text().empty());
}

TEST(MeshGrading, RefusesAPlaceOffTheBody) {
    const TriangleMesh body = shapes::sphere(0.05, 3);
    SceneGrading grading;
    grading.patches = {{"track.sensors[0].place_mm", {{0, 0, 0.065}, 0.01}}};
    EXPECT_NO_THROW(grading.check(body));
    grading.patches[0].patch.centre.z() = 0.08;
    try {
        grading.check(body);
        ADD_FAILURE();
    } catch (const Error& error) {
        EXPECT_EQ(std::string(error.what()),
                  "track.sensors[0].place_mm = [0.0, 0.0, 80.0] is 30.0 mm off the body's surface, "
                  "expected at most 20 mm");
    }
}

/// Of sensors alone: a driven sphere may be about nodes deep inside.
TEST(MeshGrading, ChecksPlacesOfSensorsOnAMeshThatIsThere) {
    const TetMesh mesh = shapes::box({0.1, 0.1, 0.1}, {4, 4, 4});
    Scene scene;
    scene.drive.emplace_back().sphere_mm = {50, 50, 50, 10};
    EXPECT_NO_THROW(check_sensor_places(scene, mesh));
    scene.track.emplace();
    EXPECT_NO_THROW(check_sensor_places(scene, mesh)) << "none is planned";
    scene.track->sensors[0].place_mm = Eigen::Vector3d(50, 50, 115);
    EXPECT_NO_THROW(check_sensor_places(scene, mesh));
    scene.track->sensors[0].place_mm->z() = 150;
    EXPECT_THROW(check_sensor_places(scene, mesh), Error);
}

TEST(MeshGrading, MeasuresEdgesAtTheRim) {
    const TetMesh even = shapes::box({0.1, 0.1, 0.1}, {20, 20, 20});
    const double edge = edge_length_at_rim(even, {0.05, 0.05, 0.1}, 0.015);
    EXPECT_GT(edge, 0.005);
    EXPECT_LT(edge, 0.005 * std::sqrt(2));
    // A patch within a triangle has the edges of that.
    EXPECT_NEAR(edge_length_at_rim(even, {0.0516, 0.0518, 0.1}, 1e-5),
                0.005 * (2 + std::sqrt(2)) / 3, 1e-6);
}

TEST(MeshGrading, ErrorGrowsWithTheEdge) {
    EXPECT_NEAR(element_error(Elements::p1, 0.008, 0.015), 0.044, 0.01);  // as measured
    EXPECT_NEAR(element_error(Elements::p2, 0.0107, 0.015), 0.02, 0.005);
    EXPECT_NEAR(
        element_error(Elements::p1, 0.008, 0.015) / element_error(Elements::p1, 0.004, 0.015), 2,
        1e-12);
}

TEST(MeshGrading, SaysWhatAnotherPlaceCosts) {
    TetMesh mesh = shapes::box({0.1, 0.1, 0.1}, {20, 20, 20});
    for (Vector3& x : mesh.nodes)  // cells of 2 mm at x = 0, of 8 mm at x = 0.1 m
        x.x() = 0.04 * (x.x() / 0.1) + 0.06 * std::pow(x.x() / 0.1, 2);
    for (Vector3& x : mesh.nodes) x.y() = 0.05 + (x.y() - 0.05) * (0.2 + 8 * x.x());
    SensorOptions sensor;
    sensor.patch_radius_mm = 12;
    const Vector3 near(0.01, 0.05, 0.1), far(0.09, 0.05, 0.1);
    EXPECT_TRUE(cost_of_place(mesh, Elements::p1, sensor, far).empty()) << "none was planned";
    sensor.place_mm = 1e3 * far;
    EXPECT_TRUE(cost_of_place(mesh, Elements::p1, sensor, far).empty());
    EXPECT_TRUE(cost_of_place(mesh, Elements::p1, sensor, near).empty()) << "finer than planned";
    sensor.place_mm = 1e3 * near;
    const std::string cost = cost_of_place(mesh, Elements::p1, sensor, far);
    EXPECT_EQ(cost.find("sensor Sensor: 80 mm from its place_mm, edges at its patch are "), 0u)
        << cost;
    EXPECT_EQ(cost.find('\n'), std::string::npos);
    EXPECT_TRUE(cost.ends_with("To reduce it, mesh again with place_mm: [90.0, 50.0, 100.0]."))
        << cost;
    const double edge = edge_length_at_rim(mesh, far, 0.012);
    EXPECT_NE(cost.find(fmt::format("{:.1f} % of the press",
                                    100 * element_error(Elements::p1, edge, 0.012))),
              std::string::npos)
        << cost;
}

}  // namespace
}  // namespace livetet
