#include "apps/scene/scene_forces.hpp"

#include <algorithm>
#include <set>

#include "apps/scene/node_selection.hpp"
#include "base/error.hpp"
#include "geometry/triangle_area.hpp"
#include "mechanics/gravity_load.hpp"
#include "mesh/grid_border.hpp"
#include "mesh/quadratic.hpp"
#include "mesh/quadratic_faces.hpp"

namespace livetet {

namespace {

/// Of triangles those that are in a set, in whatever order of their nodes.
void keep_those_in(std::span<const Triangle> set, std::vector<Triangle>& triangles) {
    const auto sorted = [](Triangle t) {
        std::ranges::sort(t);
        return t;
    };
    std::set<Triangle> kept;
    for (const Triangle& t : set) kept.insert(sorted(t));
    std::erase_if(triangles, [&](const Triangle& t) { return !kept.contains(sorted(t)); });
}

/// The triangles that a load acts on: those of its group or, without a group, the boundary
/// triangles whose corners are all selected; no wall of a cut, if it acts on the surface alone.
std::vector<Triangle> loaded_triangles(const TetMesh& mesh, const LoadOptions& load,
                                       std::span<const std::int32_t> nodes) {
    if (load.group)
        if (const auto set = mesh.triangle_sets.find(*load.group); set != mesh.triangle_sets.end())
            return set->second;
    std::vector<bool> is_selected(mesh.nodes.size(), false);
    for (const std::int32_t n : nodes) is_selected[n] = true;
    const auto selected = [&](std::int32_t n) { return bool(is_selected[n]); };
    // Both tets at a face of selected corners have three of these.
    std::vector<Tet> around;
    for (const Tet& t : solid_tets(mesh))
        if (std::count_if(t.begin(), t.end(), selected) >= 3) around.push_back(t);
    std::vector<Triangle> triangles = boundary_triangles(around);
    std::erase_if(triangles,
                  [&](const Triangle& t) { return !std::all_of(t.begin(), t.end(), selected); });
    const auto before = mesh.triangle_sets.find(surface_before_cuts);
    if (load.where == NodeScope::surface_only && before != mesh.triangle_sets.end())
        keep_those_in(before->second, triangles);
    return triangles;
}

/// Adds the force on half a face of a hexahedron so that each of the face's four corners gets a
/// quarter of both halves: the two on the diagonal, the triangle's longest edge, are in both.
void add_to_half_face(const TetMesh& mesh, const Triangle& t, const Vector3& half,
                      std::vector<Vector3>& force) {
    int opposite = 0;
    double longest = 0;
    for (int i = 0; i < 3; ++i) {
        const double length = (mesh.nodes[t[(i + 1) % 3]] - mesh.nodes[t[(i + 2) % 3]]).norm();
        if (length > longest) longest = length, opposite = i;
    }
    for (int i = 0; i < 3; ++i) force[t[i]] += (i == opposite ? 0.5 : 0.25) * half;
}

void add_to_triangles(const TetMesh& mesh, const LoadOptions& load,
                      std::span<const Triangle> triangles, std::vector<Vector3>& force) {
    const auto on = [&](const Vector3& area) -> Vector3 {
        return load.traction_Pa * area.norm() - load.pressure_Pa * area;
    };
    if (!mesh.quadratic_hexahedra.empty()) {
        const QuadraticFaces faces(mesh, triangles);
        for (const Triangle& t : triangles)
            for (const FacePoint& p : faces.points(mesh, t))
                for (std::size_t i = 0; i < p.nodes.size(); ++i)
                    force[p.nodes[i]] += p.shares[i] * on(p.area);
        return;
    }
    const EdgeNodes edges(mesh, triangles);
    for (const Triangle& t : triangles) {
        const Vector3 area = area_vector(mesh.nodes, t);
        if (!mesh.hexahedra.empty()) {
            add_to_half_face(mesh, t, -load.pressure_Pa * area, force);
            continue;
        }
        for (const std::int32_t n : traction_nodes(t, edges)) force[n] += on(area) / 3;
    }
}

}  // namespace

std::vector<Vector3> scene_forces(const Scene& scene, const MeshPart& part) {
    const TetMesh& mesh = part.mesh();
    if (scene.gravity_m_per_s2 == Vector3::Zero() && scene.loads.empty()) return {};
    auto force = gravity_load(mesh, scene.materials, scene.gravity_m_per_s2);
    for (std::size_t i = 0; i < scene.loads.size(); ++i) {
        const LoadOptions& load = scene.loads[i];
        const std::string key = fmt::format("loads[{}]", i);
        const auto nodes = select_nodes(part, load, key);
        const std::vector<double> shares = shares_of_nodes(part, nodes);
        for (std::size_t k = 0; k < nodes.size(); ++k) force[nodes[k]] += shares[k] * load.force_N;
        if (load.pressure_Pa == 0 && load.traction_Pa == Vector3::Zero()) continue;
        if (!mesh.shares.empty() && load.traction_Pa != Vector3::Zero())
            fail(
                "{}.traction_Pa: found a grid of hexahedra, whose faces are steps and larger than "
                "the body's surface; expected force_N or pressure_Pa",
                key);
        const std::vector<Triangle> triangles = loaded_triangles(mesh, load, nodes);
        // Of a rank's part, faces without an own corner may have a tet on another rank.
        const auto own = std::ranges::count_if(triangles, [&](const Triangle& t) {
            return std::ranges::any_of(t, [&](std::int32_t n) { return n < part.owned(); });
        });
        if (part.sum(static_cast<double>(own)) == 0)
            fail("{} selects no whole triangle of the surface for its traction or pressure", key);
        add_to_triangles(mesh, load, triangles, force);
    }
    part.take_ghosts(force);  // what acts around a ghost is known to its owner alone
    return force;
}

}  // namespace livetet
