#include "apps/bench/registration_organ.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include "apps/phantom/phantom_shape.hpp"
#include "apps/phantom/phantom_truth.hpp"
#include "base/error.hpp"
#include "geometry/nearest_triangle.hpp"
#include "geometry/spread_points.hpp"
#include "geometry/triangle_area.hpp"
#include "io/surface_file.hpp"
#include "mesh/quadratic.hpp"
#include "meshing/levels.hpp"

namespace livetet {

namespace {

Vector3 middle_of(const TriangleMesh& surface, const Triangle& t) {
    return (surface.nodes[t[0]] + surface.nodes[t[1]] + surface.nodes[t[2]]) / 3;
}

/// The place of the surface that is seen from `centre` in a direction, and the mean normal there.
Grip place_towards(const TriangleMesh& surface, const Vector3& centre, const Vector3& direction) {
    constexpr double about_m = 0.015;
    double best = -2;
    Grip grip{};
    for (const Triangle& t : surface.triangles) {
        const Vector3 middle = middle_of(surface, t);
        const double along = (middle - centre).normalized().dot(direction.normalized());
        if (along > best) best = along, grip.place = middle;
    }
    grip.direction = Vector3::Zero();
    for (const Triangle& t : surface.triangles)
        if ((middle_of(surface, t) - grip.place).norm() < about_m)
            grip.direction += area_vector(surface.nodes, t);
    grip.direction.normalize();
    return grip;
}

/// Places inside, near the grip, as far from each other as can be (farthest-point sampling).
std::vector<NamedPoint> targets_inside(const TetMesh& mesh, const Vector3& place) {
    constexpr double deep_m = 0.008, near_m = 0.070;
    constexpr std::size_t count = 32;
    const std::vector<Triangle> surface = boundary_triangles(mesh.tets);
    const NearestTriangle nearest(mesh.nodes, surface);
    std::vector<Vector3> inside;
    for (const Tet& tet : mesh.tets) {
        Vector3 x = Vector3::Zero();
        for (const std::int32_t n : tet) x += mesh.nodes[n] / 4;
        if ((x - place).norm() < near_m && nearest.find(x).distance > deep_m) inside.push_back(x);
    }
    if (inside.size() < count)
        fail("bench registration: found {} places inside near the grip, expected {} or more",
             inside.size(), count);
    std::vector<NamedPoint> targets;
    for (const std::size_t i : spread_points(inside, count).chosen)
        targets.push_back({fmt::format("T{:02}", targets.size() + 1), inside[i]});
    return targets;
}

}  // namespace

BenchOrgan phantom_organ(const PhantomImages& images) {
    BenchOrgan organ;
    organ.mesh = [&images](int tets, const ProgressCallback& progress) {
        return mesh_for_truth(images.labels, images.fixed_mask, tets, progress);
    };
    // A place of the upper side, and a direction out of the organ there.
    organ.grip = [](std::mt19937_64& engine) {
        const Vector3 centre =
            phantom::sensor_place() - 0.03 * phantom::organ_normal(phantom::sensor_place());
        Grip grip;
        grip.place = phantom::organ_exit(
            centre, Vector3::UnitZ() + 0.6 * normal_vector(engine).normalized());
        grip.direction =
            (phantom::organ_normal(grip.place) + 0.8 * normal_vector(engine).normalized())
                .normalized();
        return grip;
    };
    organ.targets = [](const TetMesh& /*mesh*/, const Vector3& /*place*/) {
        return phantom::targets();
    };
    organ.up = Vector3::UnitZ();
    organ.below = phantom::organ_centre() - 0.01 * organ.up;
    return organ;
}

BenchOrgan surface_organ(const std::filesystem::path& file) {
    constexpr double held_share = 0.2;
    const TriangleMesh surface = read_surface(file, Space::ras);
    Eigen::AlignedBox3d box;
    Vector3 centre = Vector3::Zero();
    for (const Vector3& x : surface.nodes) {
        box.extend(x);
        centre += x / static_cast<double>(surface.nodes.size());
    }
    BenchOrgan organ;
    organ.up = Vector3::UnitY();  // to the front
    organ.below = centre;
    const double held_below = box.min().y() + held_share * box.sizes().y();
    organ.mesh = [surface, held_below](int tets, const ProgressCallback& progress) {
        MeshingOptions options;
        options.target_tets = tets;
        options.target_tolerance = 0.3;
        options.levels = 4;
        MeshHierarchy hierarchy = build_hierarchy(surface, options, progress).hierarchy;
        TetMesh& finest = hierarchy.levels.front();
        std::vector<std::int32_t> held = surface_nodes(finest);
        std::erase_if(held, [&](std::int32_t n) { return finest.nodes[n].y() > held_below; });
        finest.node_sets["fixed"] = std::move(held);
        return hierarchy;
    };
    organ.grip = [surface, centre, up = organ.up](std::mt19937_64& engine) {
        Grip grip = place_towards(surface, centre, up + 0.6 * normal_vector(engine).normalized());
        grip.direction = (grip.direction + 0.8 * normal_vector(engine).normalized()).normalized();
        return grip;
    };
    organ.targets = targets_inside;
    return organ;
}

}  // namespace livetet
