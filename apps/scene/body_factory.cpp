#include "apps/scene/body_factory.hpp"

#include <malloc.h>

#include <Eigen/Dense>

#include <algorithm>
#include <chrono>
#include <numbers>
#include <set>

#include "apps/scene/cuts.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/log.hpp"
#include "base/stopwatch.hpp"
#include "geometry/transform.hpp"
#include "geometry/triangle_area.hpp"
#include "image/mask_selection.hpp"
#include "io/dicom_name.hpp"
#include "io/gmsh_file.hpp"
#include "io/hierarchy_file.hpp"
#include "io/image_file.hpp"
#include "io/text.hpp"
#include "mechanics/gravity_load.hpp"
#include "mechanics/rigid_motions.hpp"
#include "mesh/quadratic.hpp"
#include "meshing/refine.hpp"
#include "solvers/linear/live_support.hpp"
#include "solvers/parallel/partition.hpp"
#include "solvers/parallel/sum_over_ranks.hpp"
#include "tracking/simulated_tracker.hpp"
#ifdef LIVETET_IMAGES
#include "apps/scene/mesh_input.hpp"
#include "io/vtu_file.hpp"
#include "meshing/levels_below.hpp"
#endif

namespace livetet {

namespace {

std::uint8_t component_bits(const std::string& components) {
    std::uint8_t bits = 0;
    for (const char c : components) bits |= 1 << (c - 'x');
    return bits;
}

std::vector<std::int32_t> selected(const TetMesh& mesh, const SelectionOptions& s,
                                   const std::string& key) {
    const auto mm = [](double x, double y, double z) -> Vector3 { return Vector3(x, y, z) / 1e3; };
    if (s.mask) return nodes_in_mask(mesh, read_mask(*s.mask));
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

std::vector<std::int32_t> select_nodes(const TetMesh& mesh, const SelectionOptions& s,
                                       const std::string& key) {
    std::vector<std::int32_t> nodes = selected(mesh, s, key);
    if (s.where == NodeScope::surface_only) nodes = surface_nodes_among(mesh, nodes);
    if (nodes.empty()) {
        Vector3 low = mesh.nodes.front(), high = low;
        for (const Vector3& x : mesh.nodes) {
            low = low.cwiseMin(x);
            high = high.cwiseMax(x);
        }
        fail(
            "{} selects no node; the mesh spans ({:.1f}, {:.1f}, {:.1f}) to ({:.1f}, {:.1f}, "
            "{:.1f}) mm",
            key, 1e3 * low.x(), 1e3 * low.y(), 1e3 * low.z(), 1e3 * high.x(), 1e3 * high.y(),
            1e3 * high.z());
    }
    return nodes;
}

namespace {

MeshHierarchy read_tets(const MeshSource& source) {
    refuse_idle_keys(source);
    if (ending(source.file) == ".h5") return read_hierarchy(source.file);
    const double metres = source.unit == LengthUnit::millimetre ? 1e-3 : 1.0;
#ifdef LIVETET_IMAGES
    TetMesh mesh = ending(source.file) == ".msh" ? read_gmsh(source.file, metres)
                                                 : read_vtu(source.file, metres);
#else
    TetMesh mesh = read_gmsh(source.file, metres);
#endif
    if (source.space == Space::lps)
        for (Vector3& x : mesh.nodes) x.head<2>() *= -1;
    check_size(mesh.nodes, source);
    return make_hierarchy({std::move(mesh)}, source.file.string());
}

}  // namespace

MeshHierarchy load_mesh(const Scene& scene, const ProgressCallback& progress) {
    check_can_be_cut(scene);
    MeshHierarchy loaded = load_mesh(scene.mesh, progress, grading_of(scene));
    check_has_hexahedra(scene, loaded);
    return scene.cuts.empty() ? loaded : with_cuts(scene, std::move(loaded));
}

MeshHierarchy load_mesh(const MeshSource& source, const ProgressCallback& progress,
                        const SceneGrading& grading) {
    const bool has_levels_to_make = kind_of(source.file) == MeshKind::tets && source.levels > 1;
    if (is_tet_mesh_name(source.file) && !has_levels_to_make) {
        MeshHierarchy read = read_tets(source);
        if (source.refine > 0)
            refuse_hexahedra(read, fmt::format("mesh.refine = {}", source.refine));
        return with_refined_levels(std::move(read), source.refine);
    }
#ifdef LIVETET_IMAGES
    int ranks = 1, initialised = 0;
    MPI_Initialized(&initialised);
    if (initialised) MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    if (ranks > 1)
        fail("mesh.file = {}: {} on one rank only; run `livetet mesh` first and name its .h5",
             source.file.string(),
             has_levels_to_make ? "coarser levels are meshed" : "an image or surface is meshed");
    const auto log_notes = [](HierarchyResult result) {
        for (const std::string& note : result.notes) log_info("note         " + note);
        return std::move(result.hierarchy);
    };
    if (has_levels_to_make) {
        MeshHierarchy read = read_tets(source);
        MeshingOptions options;
        options.levels = source.levels;
        MeshHierarchy made = with_context(source.file.string(), [&] {
            return log_notes(levels_below(std::move(read.levels.front()), options, progress));
        });
        made.provenance = fmt::format("{}; below it {}", read.provenance, made.provenance);
        return with_refined_levels(std::move(made), source.refine);
    }
    if (source.cells == MeshCells::hexahedra) {
        GridInput input = grid_input(source);
        for (const std::string& note : input.notes) log_info("note         " + note);
        return std::move(input.hierarchy);
    }
    try {
        return log_notes(std::move(mesh_input(source, progress, {}, grading).result));
    } catch (const MeshingFailure& failure) {
        fail_with_surface(failure, derived_filename(source.file, ".failed.stl"), source.file);
    }
#else
    (void)progress;
    (void)grading;
    if (has_levels_to_make)
        fail("mesh.levels = {}: this build of livetet meshes no coarser levels, expected 1",
             source.levels);
    fail("mesh.file = {}: this build of livetet meshes no images or surfaces, expected .h5 or .msh",
         source.file.string());
#endif
}

void refuse_hexahedra(const MeshHierarchy& hierarchy, const std::string& what) {
    if (!hierarchy.levels.front().hexahedra.empty())
        fail(
            "{}: found a mesh of hexahedra, expected tetrahedra (hexahedra are for solve, study "
            "and track on one rank, without elements: P2)",
            what);
}

SceneConstraints::SceneConstraints(const Scene& scene, const TetMesh& mesh)
    : mesh_(mesh), constraints_(mesh.nodes.size()) {
    for (std::size_t i = 0; i < scene.drive.size(); ++i) {
        const DriveOptions& d = scene.drive[i];
        const std::string key = fmt::format("drive[{}]", i);
        const std::vector<std::int32_t> nodes = select_nodes(mesh, d, key);
        Vector3 centre = Vector3::Zero();
        for (const std::int32_t n : nodes)
            centre += mesh.nodes[n] / static_cast<double>(nodes.size());
        if (d.centre_mm) centre = *d.centre_mm / 1e3;
        TrackerNoise noise(d.noise_mm / 1e3, 0, static_cast<std::uint64_t>(d.noise_seed));
        const Vector3 error = noise(TrackedPose{}).translation;
        driven_.push_back({key, nodes, 0, d.displacement_mm / 1e3 + error,
                           d.rotation_deg * (std::numbers::pi / 180), centre,
                           component_bits(d.components), d.stiffness_N_per_m, d.ramp_s});
    }
    for (std::size_t i = 0; i < scene.fix.size(); ++i) {
        const std::string key = fmt::format("fix[{}]", i);
        driven_.push_back({key, select_nodes(mesh, scene.fix[i], key), 0, Vector3::Zero(),
                           Vector3::Zero(), Vector3::Zero(),
                           component_bits(scene.fix[i].components), scene.fix[i].stiffness_N_per_m,
                           0});
    }
    if (std::vector<std::int32_t> resting = resting_nodes(scene, mesh); !resting.empty())
        driven_.push_back({"free_pieces",
                           std::move(resting),
                           0,
                           Vector3::Zero(),
                           Vector3::Zero(),
                           Vector3::Zero(),
                           component_bits("xyz"),
                           {},
                           0});
    for (Driven& d : driven_) {
        d.count = static_cast<double>(d.nodes.size());
        if (!d.stiffness) continue;
        springs_.stiffness.resize(mesh.nodes.size(), 0);
        springs_.target.resize(mesh.nodes.size(), Vector3::Zero());
        for (const std::int32_t n : d.nodes) springs_.stiffness[n] += *d.stiffness / d.count;
    }
    move_to_share(0);
}

void SceneConstraints::restrict_to(const PartitionedMesh& share) {
    share_ = &share;
    std::vector<std::int32_t> local_of(share.total, -1);
    for (std::size_t i = 0; i < share.nodes.size(); ++i)
        local_of[share.nodes[i]] = static_cast<std::int32_t>(i);
    for (Driven& d : driven_) {
        for (std::int32_t& n : d.nodes) n = local_of[n];
        std::erase(d.nodes, -1);
    }
    constraints_.components = local_part<std::uint8_t>(share, constraints_.components);
    constraints_.values = local_part<Vector3>(share, constraints_.values);
    if (!springs_.empty()) {
        springs_.stiffness = local_part<double>(share, springs_.stiffness);
        springs_.target = local_part<Vector3>(share, springs_.target);
    }
    move_to_share(0);
}

void SceneConstraints::move(Driven& d, double share) {
    d.values.clear();
    const Eigen::Matrix3d turned = rotation_of_vector(share * d.turn) - Eigen::Matrix3d::Identity();
    for (const std::int32_t n : d.nodes) {
        const Vector3 value = turned * (mesh_.nodes[n] - d.centre) + share * d.displacement;
        d.values.push_back(value);
        if (d.stiffness)  // the springs of overlapping soft sets pull together, to their mean
            springs_.target[n] += *d.stiffness / d.count / springs_.stiffness[n] * value;
        else
            constraints_.prescribe(std::span(&n, 1), value, d.components);
    }
}

std::vector<std::pair<std::string, Vector3>> SceneConstraints::forces(
    std::span<const Vector3> reactions, std::span<const Vector3> displacement) const {
    std::vector<std::pair<std::string, Vector3>> forces;
    std::vector<std::uint8_t> counted(reactions.size(), 0);
    const auto owned = share_ ? share_->owned : static_cast<std::int32_t>(reactions.size());
    for (auto d = driven_.rbegin(); d != driven_.rend(); ++d) {
        Vector3 force = Vector3::Zero();
        for (std::size_t k = 0; k < d->nodes.size(); ++k) {
            const std::int32_t n = d->nodes[k];
            if (n >= owned) continue;  // its owner counts it
            if (d->stiffness) {
                force += *d->stiffness / d->count * (d->values[k] - displacement[n]);
                continue;
            }
            for (int c = 0; c < 3; ++c) {
                if (!(d->components >> c & 1) || (counted[n] >> c & 1)) continue;
                force[c] += reactions[n][c];
                if (!springs_.empty())
                    force[c] -=
                        springs_.stiffness[n] * (springs_.target[n][c] - displacement[n][c]);
            }
            counted[n] |= d->components;
        }
        if (share_) sum_over_ranks(share_->comm, {force.data(), 3});
        forces.emplace_back(d->key, force);
    }
    std::reverse(forces.begin(), forces.end());
    return forces;
}

void SceneConstraints::move_to_time(double time_s) {
    std::fill(springs_.target.begin(), springs_.target.end(), Vector3::Zero());
    for (Driven& d : driven_) move(d, d.ramp_s > 0 ? std::min(1.0, time_s / d.ramp_s) : 1.0);
}

void SceneConstraints::move_to_share(double share) {
    std::fill(springs_.target.begin(), springs_.target.end(), Vector3::Zero());
    for (Driven& d : driven_) move(d, share);
}

namespace {

/// The triangles that a load acts on: those of its group or, without a group, the boundary
/// triangles whose corners are all selected.
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
    for (const Tet& t : mesh.tets)
        if (std::count_if(t.begin(), t.end(), selected) >= 3) around.push_back(t);
    std::vector<Triangle> triangles = boundary_triangles(around);
    std::erase_if(triangles,
                  [&](const Triangle& t) { return !std::all_of(t.begin(), t.end(), selected); });
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

}  // namespace

std::vector<Vector3> scene_forces(const Scene& scene, const TetMesh& mesh) {
    if (scene.gravity_m_per_s2 == Vector3::Zero() && scene.loads.empty()) return {};
    auto force = gravity_load(mesh, scene.materials, scene.gravity_m_per_s2);
    for (std::size_t i = 0; i < scene.loads.size(); ++i) {
        const LoadOptions& load = scene.loads[i];
        const std::string key = fmt::format("loads[{}]", i);
        const auto nodes = select_nodes(mesh, load, key);
        for (const std::int32_t n : nodes)
            force[n] += load.force_N / static_cast<double>(nodes.size());
        if (load.pressure_Pa == 0 && load.traction_Pa == Vector3::Zero()) continue;
        if (!mesh.hexahedra.empty() && load.traction_Pa != Vector3::Zero())
            fail(
                "{}.traction_Pa: found a mesh of hexahedra, whose faces are steps and larger than "
                "the body's surface; expected force_N or pressure_Pa",
                key);
        const std::vector<Triangle> triangles = loaded_triangles(mesh, load, nodes);
        if (triangles.empty())
            fail("{} selects no whole triangle of the surface for its traction or pressure", key);
        const EdgeNodes edges(mesh, triangles);
        for (const Triangle& t : triangles) {
            const Vector3 area = area_vector(mesh.nodes, t);
            if (!mesh.hexahedra.empty()) {
                add_to_half_face(mesh, t, -load.pressure_Pa * area, force);
                continue;
            }
            for (const std::int32_t n : traction_nodes(t, edges))
                force[n] += (load.traction_Pa * area.norm() - load.pressure_Pa * area) / 3;
        }
    }
    return force;
}

ElasticModel elastic_model(const Scene& scene) {
    const bool has_graded_patches =
        scene.track && std::ranges::any_of(scene.track->sensors, [](const SensorOptions& s) {
            return s.place_mm.has_value();
        });
    return {scene.materials, scene.strain, scene.formulation, has_graded_patches};
}

SolverOptions solver_options(const Scene& scene, const MeshHierarchy& hierarchy, Use use) {
    SolverOptions options = scene.solver;
    if (use == Use::track && options.kind == SolverKind::automatic &&
        why_not_live(elastic_model(scene), hierarchy).empty())
        options.kind = SolverKind::live;
    if (scene.mesh.levels > 1 && hierarchy.levels.size() == 1 &&
        options.kind == SolverKind::multigrid)
        options.kind = SolverKind::automatic;  // load_mesh noted why there are no levels
    return options;
}

void check_no_free_motion(const Scene& scene, const TetMesh& mesh,
                          const SceneConstraints& constraints) {
    if (scene.time.is_dynamic()) return;
    std::vector<std::uint8_t> held = constraints.constraints().components;
    for (std::size_t n = 0; n < constraints.springs().stiffness.size(); ++n)
        if (constraints.springs().stiffness[n] > 0) held[n] = 7;
    const std::vector<FreeMotion> free = free_rigid_motions(mesh, held);
    if (free.empty()) return;
    std::string list;
    for (std::size_t i = 0; i < std::min<std::size_t>(free.size(), 6); ++i)
        list += (i ? ", " : "") + free[i].description;
    if (free.size() > 6) list += ", ...";
    fail(
        "the body is not held: {} rigid motion{} free in a static scene: {}; expected fix or drive "
        "to hold them",
        free.size(), free.size() == 1 ? " is" : "s are", list);
}

namespace {

/// To the system: what was freed of a whole mesh lies in pieces between what the body has.
void give_back_memory() {
#ifdef __GLIBC__
    (void)malloc_trim(0);
#endif
}

/// Throws Error if a body of hexahedra is asked for what only tetrahedra do.
void check_hexahedra_can(MPI_Comm comm, const Scene& scene, const MeshHierarchy& hierarchy) {
    int ranks = 1;
    MPI_Comm_size(comm, &ranks);
    if (scene.elements == Elements::p2) refuse_hexahedra(hierarchy, "elements = P2");
    if (ranks > 1) refuse_hexahedra(hierarchy, fmt::format("{} ranks", ranks));
}

}  // namespace

SolveControls solve_controls(const Scene& scene) {
    return {.max_newton = scene.solver.max_newton,
            .tolerance = scene.solver.newton_tolerance,
            .linear_tolerance = scene.solver.relative_tolerance};
}

SceneBody make_body(MPI_Comm comm, const Scene& scene, MeshHierarchy hierarchy, Use use) {
    check_hexahedra_can(comm, scene, hierarchy);
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        const int region = scene.materials[i].region;
        for (std::size_t j = 0; j < i; ++j)
            if (scene.materials[j].region == region)
                fail(
                    "materials[{}].region = {} is materials[{}]'s too, expected one material for "
                    "each region",
                    i, region, j);
        const auto& regions = hierarchy.levels.front().regions;
        if (region != 0 && std::find(regions.begin(), regions.end(), region) == regions.end())
            fail("materials[{}].region = {}: the mesh has no tet of that region", i, region);
    }
    // Checked here, where every rank has the whole mesh, so that all ranks throw together.
    const std::vector<std::int32_t>& regions = hierarchy.levels.front().regions;
    for (const int region :
         regions.empty() ? std::set<int>{0} : std::set<int>(regions.begin(), regions.end()))
        (void)material_of(scene.materials, region);
    SceneBody scene_body{std::move(hierarchy), nullptr};
    if (scene.elements == Elements::p2)
        scene_body.hierarchy = with_quadratic_level(std::move(scene_body.hierarchy));
    const SolverOptions options = solver_options(scene, scene_body.hierarchy, use);
    int ranks = 1;
    MPI_Comm_size(comm, &ranks);
    const auto start = std::chrono::steady_clock::now();
    std::vector<std::vector<std::int32_t>> parts;
    if (ranks > 1) parts = partition_levels(comm, scene_body.hierarchy, scene.solver.partitioner);
    scene_body.partition_s = seconds_since(start);
    scene_body.hierarchy.parents.clear();  // used for the partition only
    if (const SolverKind kind = resolved_kind(options.kind, scene_body.hierarchy.levels.size());
        kind != SolverKind::multigrid && kind != SolverKind::live) {
        MeshHierarchy& h =
            scene_body.hierarchy;  // the coarser levels are only used to partition the mesh
        h.levels.resize(1);
        if (!parts.empty()) parts.resize(1);
        h.transfers.clear();
    }
    ElasticModel model = elastic_model(scene);
    if (use != Use::track) model.has_graded_patches = false;  // no frame moves them
    MeshHierarchy& used = scene_body.hierarchy;
    DistributedHierarchy distributed{comm, used, parts};
    if (ranks > 1)
        for (BarycentricMap& transfer : used.transfers) transfer.distance = {};  // no one asks
    distributed.level_is_taken = [&](std::size_t l) { parts[l] = {}; };
    distributed.coarse_levels_are_taken = [&] {
        used.transfers = {};
        for (std::size_t l = 1; l < used.levels.size(); ++l) used.levels[l] = {};
        give_back_memory();
    };
    scene_body.body = std::make_unique<DeformableBody>(distributed, model, scene.time, options);
    if (scene_body.body->linear_solver().kind() != SolverKind::live)
        for (std::size_t l = 1; l < used.levels.size(); ++l)
            used.levels[l] = {};  // the body has its own part of them
    if (ranks > 1) give_back_memory();
    return scene_body;
}

void SceneBody::keep_part(SceneConstraints& constraints, std::vector<Vector3>& forces) {
    if (share().ranks == 1) return;
    TetMesh& mesh = hierarchy.levels.front();
    mesh = local_mesh(share(), mesh);
    constraints.restrict_to(share());
    if (!forces.empty()) forces = local_part<Vector3>(share(), forces);
    give_back_memory();
}

}  // namespace livetet
