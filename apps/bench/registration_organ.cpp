#include "apps/bench/registration_organ.hpp"

#include <Eigen/Geometry>

#include "apps/bench/organ_places.hpp"
#include "apps/phantom/phantom_shape.hpp"
#include "apps/phantom/phantom_truth.hpp"
#include "io/surface_file.hpp"
#include "mesh/quadratic.hpp"
#include "meshing/levels.hpp"

namespace livetet {

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
        const SurfacePlace at =
            place_towards(surface, centre, up + 0.6 * normal_vector(engine).normalized());
        return Grip{at.place, (at.normal + 0.8 * normal_vector(engine).normalized()).normalized()};
    };
    organ.targets = [](const TetMesh& mesh, const Vector3& place) {
        return targets_inside(mesh, place, {});
    };
    return organ;
}

}  // namespace livetet
