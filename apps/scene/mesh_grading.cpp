#include "apps/scene/mesh_grading.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "base/error.hpp"
#include "geometry/nearest_triangle.hpp"

namespace livetet {

namespace {

/// Edges at a patch that are longer than at the planned one by this factor are worth a line.
constexpr double noted_edge_ratio = 1.25;

std::string triple_mm(const Vector3& x) {
    return fmt::format("[{:.1f}, {:.1f}, {:.1f}]", 1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z());
}

/// `edge_length_at_rim` of a mesh whose boundary is `surface`.
double edge_at_rim(const TetMesh& mesh, std::span<const Triangle> surface, const Vector3& place,
                   double radius) {
    double sum = 0, nearest = std::numeric_limits<double>::max(), there = 0;
    int count = 0;
    for (const Triangle& t : surface) {
        const Vector3 centre = (mesh.nodes[t[0]] + mesh.nodes[t[1]] + mesh.nodes[t[2]]) / 3;
        double perimeter = 0;
        for (int k = 0; k < 3; ++k) {
            const Vector3 &a = mesh.nodes[t[k]], &b = mesh.nodes[t[(k + 1) % 3]];
            const double length = (a - b).norm();
            perimeter += length;
            if (((a - place).norm() <= radius) == ((b - place).norm() <= radius)) continue;
            sum += length;  // twice for each edge
            ++count;
        }
        if (const double distance = (centre - place).norm(); distance < nearest) {
            nearest = distance;
            there = perimeter / 3;
        }
    }
    return count > 0 ? sum / count : there;
}

}  // namespace

std::vector<PatchGrading::Patch> SceneGrading::surface_patches() const {
    std::vector<PatchGrading::Patch> result;
    for (const GradedPatch& p : patches) result.push_back(p.patch);
    return result;
}

std::string SceneGrading::text() const {
    std::string text;
    for (const auto& [key, patch] : patches)
        text += fmt::format("{}({:.9g}, {:.9g}, {:.9g}), radius {:.9g}", text.empty() ? "" : "; ",
                            patch.centre.x(), patch.centre.y(), patch.centre.z(), patch.radius_m);
    return text;
}

void SceneGrading::check(const TriangleMesh& body) const {
    const NearestTriangle tree(body.nodes, body.triangles);
    for (const auto& [key, patch] : patches) {
        const double limit = std::max(farthest_from_body, patch.radius_m),
                     distance = tree.find(patch.centre).distance;
        if (distance > limit)
            fail("{} = {} is {:.1f} mm off the body's surface, expected at most {:g} mm", key,
                 triple_mm(patch.centre), 1e3 * distance, 1e3 * limit);
    }
}

SceneGrading grading_by(const Scene& scene) {
    SceneGrading grading;
    const auto add = [&](const std::string& key, std::string_view place, const Vector3& centre_mm,
                         double radius_mm) {
        grading.patches.push_back(
            {fmt::format("{}.{}", key, place), {centre_mm / 1e3, radius_mm / 1e3}});
    };
    const std::size_t sensors = scene.track ? scene.track->sensors.size() : 0;
    for (std::size_t i = 0; i < sensors; ++i) {
        const SensorOptions& sensor = scene.track->sensors[i];
        const std::string key = fmt::format("track.sensors[{}]", i);
        if (sensor.place_mm)
            add(key, "place_mm", *sensor.place_mm, sensor.patch_radius_mm);
        else
            grading.without_place.push_back(key);
    }
    for (std::size_t i = 0; i < scene.drive.size(); ++i) {
        const auto& sphere = scene.drive[i].sphere_mm;
        const std::string key = fmt::format("drive[{}]", i);
        if (sphere && (*sphere)[3] > 0)
            add(key, "sphere_mm", {(*sphere)[0], (*sphere)[1], (*sphere)[2]}, (*sphere)[3]);
        else
            grading.without_place.push_back(key);
    }
    return grading;
}

SceneGrading grading_of(const Scene& scene) {
    if (scene.mesh.grading == MeshGrading::even) return {};
    SceneGrading grading = grading_by(scene);
    if (grading.patches.empty())
        fail(
            "mesh.grading = scene: the scene states no place, expected track.sensors: place_mm or "
            "drive: sphere_mm");
    return grading;
}

void check_sensor_places(const Scene& scene, const TetMesh& mesh) {
    Scene of_sensors;
    of_sensors.track = scene.track;
    const SceneGrading planned = grading_by(of_sensors);
    if (!planned.patches.empty()) planned.check({mesh.nodes, boundary_triangles(mesh.tets)});
}

double edge_length_at_rim(const TetMesh& mesh, const Vector3& place, double radius) {
    return edge_at_rim(mesh, boundary_triangles(mesh.tets), place, radius);
}

double element_error(Elements elements, double edge_m, double patch_radius_m) {
    constexpr double of_p1 = 0.08, of_p2 = 0.03;
    return (elements == Elements::p2 ? of_p2 : of_p1) * edge_m / patch_radius_m;
}

std::string cost_of_place(const TetMesh& mesh, Elements elements, const SensorOptions& sensor,
                          const Vector3& place) {
    if (!sensor.place_mm) return {};
    const double radius = sensor.patch_radius_mm / 1e3;
    const Vector3 planned = *sensor.place_mm / 1e3;
    const std::vector<Triangle> surface = boundary_triangles(mesh.tets);
    const double here = edge_at_rim(mesh, surface, place, radius),
                 there = edge_at_rim(mesh, surface, planned, radius);
    if (here <= noted_edge_ratio * there) return {};
    return fmt::format(
        "sensor {}: {:.0f} mm from its place_mm, edges at its patch are {:.1f} mm, at the planned "
        "one {:.1f} mm: its elements' error is about {:.1f} % of the press. To reduce it, mesh "
        "again "
        "with place_mm: {}.",
        sensor.tool, 1e3 * (place - planned).norm(), 1e3 * here, 1e3 * there,
        100 * element_error(elements, here, radius), triple_mm(place));
}

}  // namespace livetet
