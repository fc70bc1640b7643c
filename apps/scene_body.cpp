#include "apps/scene_body.hpp"

#include <Eigen/Dense>

#include <algorithm>

#include "base/error.hpp"
#include "base/file.hpp"
#include "io/gmsh_file.hpp"
#include "io/hierarchy_file.hpp"
#include "io/image_file.hpp"
#include "mesh/node_selection.hpp"
#include "meshing/partition.hpp"
#ifdef LIVETET_IMAGES
#include "apps/mesh_input.hpp"
#endif

namespace livetet {

namespace {

std::uint8_t component_bits(const std::string& components) {
    std::uint8_t bits = 0;
    for (const char c : components) bits |= 1 << (c - 'x');
    return bits;
}

std::vector<std::int32_t> selected(const TetMesh& mesh, const SelectionOptions& s, const std::string& key) {
    const auto mm = [](double x, double y, double z) -> Vector3 { return Vector3(x, y, z) / 1e3; };
    if (s.mask) return nodes_in_mask(mesh, read_label_image(*s.mask));
    if (s.group) {
        const auto found = mesh.node_sets.find(*s.group);
        if (found != mesh.node_sets.end()) return found->second;
        std::vector<std::string> names;
        for (const auto& [name, nodes] : mesh.node_sets) names.push_back(name);
        fail("{}.group = {}: the mesh has no set of that name, it has {}", key, *s.group,
             names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")));
    }
    if (s.box_mm) {
        const auto& b = *s.box_mm;
        return nodes_in_box(mesh, mm(b[0], b[1], b[2]), mm(b[3], b[4], b[5]));
    }
    if (s.sphere_mm) {
        const auto& b = *s.sphere_mm;
        return nodes_in_sphere(mesh, mm(b[0], b[1], b[2]), b[3] / 1e3);
    }
    if (s.half_space_mm) {
        const auto& b = *s.half_space_mm;
        return nodes_in_half_space(mesh, mm(b[0], b[1], b[2]), Vector3(b[3], b[4], b[5]));
    }
    std::vector<std::int32_t> nodes(s.nodes->begin(), s.nodes->end());
    for (const std::int32_t n : nodes)
        if (n < 0 || n >= static_cast<std::int32_t>(mesh.nodes.size()))
            fail("{}.nodes names node {}, expected 0 to {}", key, n, mesh.nodes.size() - 1);
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    return nodes;
}

}  // namespace

std::vector<std::int32_t> select_nodes(const TetMesh& mesh, const SelectionOptions& s, const std::string& key) {
    std::vector<std::int32_t> nodes = selected(mesh, s, key);
    if (s.where == NodeScope::surface_only) {
        const auto surface = nodes_of(boundary_triangles(mesh.tets));
        std::erase_if(nodes, [&](std::int32_t n) { return !std::binary_search(surface.begin(), surface.end(), n); });
    }
    if (nodes.empty()) {
        Vector3 low = mesh.nodes.front(), high = low;
        for (const Vector3& x : mesh.nodes) {
            low = low.cwiseMin(x);
            high = high.cwiseMax(x);
        }
        fail("{} selects no node; the mesh spans ({:.1f}, {:.1f}, {:.1f}) to ({:.1f}, {:.1f}, {:.1f}) mm", key,
             1e3 * low.x(), 1e3 * low.y(), 1e3 * low.z(), 1e3 * high.x(), 1e3 * high.y(), 1e3 * high.z());
    }
    return nodes;
}

MeshHierarchy load_mesh(const MeshSource& source, const ProgressCallback& progress) {
    const std::string ending = source.file.extension().string();
    if (ending == ".h5") return read_hierarchy(source.file);
    if (ending == ".msh")
        return make_hierarchy({read_gmsh(source.file, source.unit == LengthUnit::millimetre ? 1e-3 : 1.0)},
                              source.file.string());
#ifdef LIVETET_IMAGES
    int ranks = 1, initialised = 0;
    MPI_Initialized(&initialised);
    if (initialised) MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    if (ranks > 1)
        fail(
            "mesh.file = {}: an image or surface is meshed on one rank only; run `livetet mesh` first and name its .h5",
            source.file.string());
    return mesh_input(source, progress).result.hierarchy;
#else
    (void)progress;
    fail("mesh.file = {}: this build of livetet reads .h5 and .msh, it has no image meshing", source.file.string());
#endif
}

SceneConstraints::SceneConstraints(const Scene& scene, const TetMesh& mesh) : constraints_(mesh.nodes.size()) {
    for (std::size_t i = 0; i < scene.drive.size(); ++i) {
        const DriveOptions& d = scene.drive[i];
        driven_.push_back({select_nodes(mesh, d, fmt::format("drive[{}]", i)), d.displacement_mm / 1e3,
                           component_bits(d.components), d.ramp_s});
    }
    for (std::size_t i = 0; i < scene.fix.size(); ++i)
        fixed_.push_back(
            {select_nodes(mesh, scene.fix[i], fmt::format("fix[{}]", i)), component_bits(scene.fix[i].components)});
}

const Constraints& SceneConstraints::at(double time_s) {
    for (const Driven& d : driven_)
        constraints_.prescribe(d.nodes, (d.ramp_s > 0 ? std::min(1.0, time_s / d.ramp_s) : 1.0) * d.displacement,
                               d.components);
    for (const Fixed& f : fixed_) constraints_.prescribe(f.nodes, Vector3::Zero(), f.components);
    return constraints_;
}

std::vector<Vector3> scene_forces(const Scene& scene, const TetMesh& mesh) {
    std::vector<Vector3> force(mesh.nodes.size(), Vector3::Zero());
    if (scene.gravity_m_per_s2 != Vector3::Zero())
        for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
            const Material& material = material_of(scene.materials, mesh.regions.empty() ? 0 : mesh.regions[e]);
            const double quarter_mass = material.density_kg_per_m3 * signed_volume(mesh, mesh.tets[e]) / 4;
            for (const std::int32_t n : mesh.tets[e]) force[n] += quarter_mass * scene.gravity_m_per_s2;
        }
    for (std::size_t i = 0; i < scene.loads.size(); ++i) {
        const LoadOptions& load = scene.loads[i];
        const std::string key = fmt::format("loads[{}]", i);
        const auto nodes = select_nodes(mesh, load, key);
        for (const std::int32_t n : nodes) force[n] += load.force_N / static_cast<double>(nodes.size());
        if (load.pressure_Pa == 0 && load.traction_Pa == Vector3::Zero()) continue;
        const auto chosen = [&](std::int32_t n) { return std::binary_search(nodes.begin(), nodes.end(), n); };
        bool any = false;
        for (const Triangle& t : boundary_triangles(mesh.tets)) {
            if (!chosen(t[0]) || !chosen(t[1]) || !chosen(t[2])) continue;
            any = true;
            const Vector3 area = 0.5 * (mesh.nodes[t[1]] - mesh.nodes[t[0]]).cross(mesh.nodes[t[2]] - mesh.nodes[t[0]]);
            for (const std::int32_t n : t) force[n] += (load.traction_Pa * area.norm() - load.pressure_Pa * area) / 3;
        }
        if (!any) fail("{} selects no whole triangle of the surface for its traction or pressure", key);
    }
    return force;
}

StepEffort batch_effort(const Scene& scene) {
    return {.linearisations = scene.solver.max_newton,
            .tolerance = scene.solver.newton_tolerance,
            .linear_tolerance = scene.solver.relative_tolerance};
}

SceneBody make_body(MPI_Comm comm, const Scene& scene, MeshHierarchy hierarchy) {
    SceneBody scene_body{std::move(hierarchy), {}, nullptr};
    int ranks = 1;
    MPI_Comm_size(comm, &ranks);
    if (ranks > 1)
        for (const TetMesh& level : scene_body.hierarchy.levels)
            scene_body.parts.push_back(partition_tets(level.tets, ranks));
    scene_body.body = std::make_unique<DeformableBody>(comm, scene_body.hierarchy, scene_body.parts, {scene.materials, scene.strain}, scene.time, scene.solver);
    return scene_body;
}

}  // namespace livetet
