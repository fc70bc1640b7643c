#include "apps/scene/body_factory.hpp"

#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <set>

#include "apps/scene/cuts.hpp"
#include "apps/scene/scene_forces.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/log.hpp"
#include "base/stopwatch.hpp"
#include "io/dicom_name.hpp"
#include "io/gmsh_file.hpp"
#include "io/hierarchy_file.hpp"
#include "io/text.hpp"
#include "mesh/quadratic.hpp"
#include "mesh/refine.hpp"
#include "solvers/linear/live_support.hpp"
#include "solvers/parallel/partition.hpp"
#ifdef LIVETET_IMAGES
#include "apps/scene/mesh_input.hpp"
#include "io/vtu_file.hpp"
#include "meshing/levels_below.hpp"
#endif

namespace livetet {

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

SceneMesh load_mesh_for(MPI_Comm comm, const Scene& scene, const ProgressCallback& progress) {
    int ranks = 1;
    MPI_Comm_size(comm, &ranks);
    if (ranks == 1) return load_mesh(scene, progress);
    Scene as_read = scene;
    as_read.mesh.refine = 0;
    SceneMesh mesh = load_mesh(as_read, progress);
    mesh.refine = scene.mesh.refine;
    if (mesh.refine > 0)
        refuse_hexahedra(mesh.hierarchy, fmt::format("mesh.refine = {}", mesh.refine));
    const std::size_t enough = min_tets_per_rank * static_cast<std::size_t>(ranks);
    while (mesh.refine > 0 && mesh.hierarchy.levels.front().tets.size() < enough) {
        mesh.hierarchy = with_refined_levels(std::move(mesh.hierarchy), 1);
        --mesh.refine;
    }
    return mesh;
}

TetMesh finest_mesh(const Scene& scene, const SceneMesh& mesh) {
    MeshHierarchy finest{{mesh.hierarchy.levels.front()}, {}, {}};
    finest = with_refined_levels(std::move(finest), mesh.refine);
    if (scene.elements == Elements::p2) return quadratic_mesh(finest.levels.front());
    return std::move(finest.levels.front());
}

void refuse_hexahedra(const MeshHierarchy& hierarchy, const std::string& what) {
    if (!hierarchy.levels.front().hexahedra.empty())
        fail(
            "{}: found a mesh of hexahedra, expected tetrahedra (hexahedra are for solve, study "
            "and track on one rank, without elements: P2)",
            what);
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

/// Throws Error unless there is exactly one material for each region of the mesh, which is whole,
/// so that all ranks throw together.
void check_materials(const Scene& scene, const TetMesh& mesh) {
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        const int region = scene.materials[i].region;
        for (std::size_t j = 0; j < i; ++j)
            if (scene.materials[j].region == region)
                fail(
                    "materials[{}].region = {} is materials[{}]'s too, expected one material for "
                    "each region",
                    i, region, j);
        const auto& regions = mesh.regions;
        if (region != 0 && std::find(regions.begin(), regions.end(), region) == regions.end())
            fail("materials[{}].region = {}: the mesh has no tet of that region", i, region);
    }
    for (const int region : mesh.regions.empty()
                                ? std::set<int>{0}
                                : std::set<int>(mesh.regions.begin(), mesh.regions.end()))
        (void)material_of(scene.materials, region);
}

/// Frees all levels but the finest; their number stays.
void drop_coarser_meshes(MeshHierarchy& hierarchy) {
    for (std::size_t l = 1; l < hierarchy.levels.size(); ++l) hierarchy.levels[l] = {};
}

}  // namespace

SolveControls solve_controls(const Scene& scene) {
    return {.max_newton = scene.solver.max_newton,
            .tolerance = scene.solver.newton_tolerance,
            .linear_tolerance = scene.solver.relative_tolerance};
}

namespace {

/// The levels of several ranks: those of the hierarchy are partitioned, finer ones are made by each
/// rank from its own part.
DistributedHierarchy distribute(MPI_Comm comm, const Scene& scene, const MeshHierarchy& hierarchy,
                                int refine, double& partition_s) {
    const auto start = std::chrono::steady_clock::now();
    const auto parts = partition_levels(comm, hierarchy, scene.solver.partitioner);
    partition_s = seconds_since(start);
    DistributedHierarchy levels{comm, hierarchy, parts};
    for (int i = 0; i < refine; ++i) levels.add_refined();
    if (scene.elements == Elements::p2) levels.add_quadratic();
    return levels;
}

/// This rank's part of the finest mesh, with its sets, in place of the whole hierarchy. The number
/// of levels stays.
void keep_part(DistributedHierarchy& levels, MeshHierarchy& hierarchy) {
    hierarchy.levels.assign(levels.levels.size(), {});
    hierarchy.transfers = {};
    hierarchy.parents = {};
    TetMesh& mesh = hierarchy.levels.front() = local_mesh(levels.levels.front().share);
    mesh.node_sets = std::move(levels.sets.nodes);
    mesh.triangle_sets = std::move(levels.sets.triangles);
    give_back_memory();
}

}  // namespace

SceneBody make_body(MPI_Comm comm, const Scene& scene, SceneMesh mesh, Use use,
                    const MeshWork& with_mesh) {
    check_hexahedra_can(comm, scene, mesh.hierarchy);
    check_materials(scene, mesh.hierarchy.levels.front());
    SceneBody body{std::move(mesh.hierarchy), nullptr};
    MeshHierarchy& used = body.hierarchy;
    int ranks = 1;
    MPI_Comm_size(comm, &ranks);
    const bool is_quadratic = scene.elements == Elements::p2;
    if (ranks == 1) {
        used = with_refined_levels(std::move(used), mesh.refine);
        if (is_quadratic) used = with_quadratic_level(std::move(used));
    }
    const SolverOptions options = solver_options(scene, used, use);
    const std::size_t of_ranks = ranks == 1 ? 0 : mesh.refine + (is_quadratic ? 1 : 0);
    const SolverKind kind = resolved_kind(options.kind, used.levels.size() + of_ranks);
    const bool takes_levels = kind == SolverKind::multigrid || kind == SolverKind::live;
    if (!takes_levels) {
        used.levels.resize(1);
        used.transfers.clear();
        used.parents.clear();
    }
    ElasticModel model = elastic_model(scene);
    if (use != Use::track) model.has_graded_patches = false;  // no frame moves them
    DistributedHierarchy levels =
        ranks == 1 ? DistributedHierarchy{comm, used}
                   : distribute(comm, scene, used, mesh.refine, body.partition_s);
    if (!takes_levels) levels.drop_coarser();
    used.parents.clear();  // used for the partition only
    if (ranks > 1) keep_part(levels, used);
    if (with_mesh) with_mesh(used.levels.front(), levels);
    body.body = std::make_unique<DeformableBody>(std::move(levels), model, scene.time, options);
    if (body.body->linear_solver().kind() != SolverKind::live)
        drop_coarser_meshes(used);  // the body has its own part of them
    if (ranks > 1) give_back_memory();
    return body;
}

HeldBody make_held_body(MPI_Comm comm, const Scene& scene, SceneMesh mesh,
                        const MeshWork& with_mesh) {
    std::optional<SceneConstraints> constraints;
    std::vector<Vector3> forces;
    const auto prescribe = [&](const TetMesh& finest, const DistributedHierarchy& levels) {
        const MeshPart part(finest, levels.levels.front().share);
        constraints.emplace(scene, part);
        check_no_free_motion(scene, part, levels.pieces, *constraints);
        forces = scene_forces(scene, part);
        if (with_mesh) with_mesh(finest, levels);
    };
    SceneBody body = make_body(comm, scene, std::move(mesh), Use::solve, prescribe);
    return {std::move(body), std::move(*constraints), std::move(forces)};
}

}  // namespace livetet
