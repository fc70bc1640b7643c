#include "apps/scene/body_factory.hpp"

#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <set>

#include "apps/scene/cuts.hpp"
#include "apps/scene/node_selection.hpp"
#include "apps/scene/scene_forces.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/log.hpp"
#include "base/sliced_task.hpp"
#include "base/stopwatch.hpp"
#include "base/together.hpp"
#include "io/dicom_name.hpp"
#include "io/gmsh_file.hpp"
#include "io/hierarchy_file.hpp"
#include "io/text.hpp"
#include "mesh/quadratic.hpp"
#include "mesh/quadratic_hexahedra.hpp"
#include "mesh/refine.hpp"
#include "solvers/linear/live_support.hpp"
#include "solvers/parallel/exchange.hpp"
#include "solvers/parallel/first_rank.hpp"
#include "solvers/parallel/mesh_distribution.hpp"
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

void refuse_refined_hexahedra(const MeshHierarchy& hierarchy, int refine) {
    refuse_hexahedra(hierarchy, fmt::format("mesh.refine = {}", refine));
}

}  // namespace

MeshHierarchy load_mesh(const Scene& scene, const ProgressCallback& progress) {
    check_can_be_cut(scene);
    MeshSource source = scene.mesh;
    if (!scene.cuts.empty()) source.refine = 0;  // the cut mesh is refined, and its sides with it
    MeshHierarchy loaded = load_mesh(source, progress, grading_of(scene));
    if (scene.cuts.empty()) return loaded;
    if (scene.mesh.refine > 0) refuse_refined_hexahedra(loaded, scene.mesh.refine);
    return with_refined_levels(with_cuts(scene, std::move(loaded)), scene.mesh.refine);
}

MeshHierarchy load_mesh(const MeshSource& source, const ProgressCallback& progress,
                        const SceneGrading& grading) {
    const bool has_levels_to_make = kind_of(source.file) == MeshKind::tets && source.levels > 1;
    if (is_tet_mesh_name(source.file) && !has_levels_to_make) {
        MeshHierarchy read = read_tets(source);
        if (source.refine > 0) refuse_refined_hexahedra(read, source.refine);
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
        refuse_hexahedra(read, fmt::format("mesh.levels = {}", source.levels));
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

namespace {

/// Read by the first rank, refined until there are `enough` tets.
SceneMesh deal_out(MPI_Comm comm, const Scene& scene, const ProgressCallback& progress,
                   std::size_t enough) {
    Scene as_read = scene;
    as_read.mesh.refine = 0;
    MeshHierarchy whole;
    int refine = scene.mesh.refine;
    on_first_rank(comm, [&] {
        whole = load_mesh(as_read, progress);
        int ranks = 1;
        MPI_Comm_size(comm, &ranks);
        refuse_hexahedra(whole, fmt::format("{} ranks", ranks));
        for (; refine > 0 && whole.levels.front().tets.size() < enough; --refine)
            whole = with_refined_levels(std::move(whole), 1);
    });
    MPI_Bcast(&refine, 1, MPI_INT, 0, comm);
    return {rows_from_first(comm, whole), refine};
}

}  // namespace

SceneMesh load_mesh_for(MPI_Comm comm, const Scene& scene, const ProgressCallback& progress) {
    int ranks = 1;
    MPI_Comm_size(comm, &ranks);
    if (ranks == 1) return load_mesh(scene, progress);
    check_can_be_cut(scene);
    if (!scene.cuts.empty() && scene.free_pieces == FreePieces::keep && !scene.time.is_dynamic())
        fail("free_pieces = keep: found {} ranks, expected one in a static scene, or leave_out",
             ranks);
    const std::size_t enough = min_tets_per_rank * static_cast<std::size_t>(ranks);
    const bool has_rows =
        ending(scene.mesh.file) == ".h5" && scene.mesh.levels <= 1 && scene.cuts.empty();
    if (!has_rows) return deal_out(comm, scene, progress, enough);
    refuse_idle_keys(scene.mesh);
    SceneMesh mesh(read_hierarchy_rows(comm, scene.mesh.file), scene.mesh.refine);
    if (mesh.refine > 0 && mesh.rows.sizes.front().tets < enough)
        return deal_out(comm, scene, progress, enough);
    return mesh;
}

TetMesh finest_mesh(MPI_Comm comm, const Scene& scene) {
    TetMesh finest;
    together(comm, [&] {
        Scene as_read = scene;
        as_read.mesh.refine = 0;
        MeshHierarchy alone{{std::move(load_mesh(as_read, {}).levels.front())}, {}, {}};
        alone = with_refined_levels(std::move(alone), scene.mesh.refine);
        finest = std::move(in_elements(std::move(alone), scene.elements).levels.front());
    });
    return finest;
}

void refuse_hexahedra(const MeshHierarchy& hierarchy, const std::string& what) {
    if (hierarchy.levels.front().has_hexahedra())
        fail(
            "{}: found a mesh of hexahedra, expected tetrahedra (hexahedra are for solve, study "
            "and, as a grid of 8-node cells with elements: P1, track, on one rank)",
            what);
}

MeshHierarchy in_elements(MeshHierarchy hierarchy, Elements elements) {
    const TetMesh& finest = hierarchy.levels.front();
    const bool is_quadratic = !finest.quadratic_hexahedra.empty() || !finest.edge_nodes.empty();
    if (elements == Elements::p1 || is_quadratic) return hierarchy;
    if (finest.hexahedra.empty()) return with_quadratic_level(std::move(hierarchy));
    // Its triangles may lie inside of the grid, where those of order two do not follow them. The
    // set's nodes stay.
    hierarchy.levels.front().triangle_sets.erase(surface_before_cuts);
    return make_hierarchy({quadratic_grid(finest)}, std::move(hierarchy.provenance));
}

ElasticModel elastic_model(const Scene& scene) {
    const bool has_graded_patches =
        scene.track && std::ranges::any_of(scene.track->sensors, [](const SensorOptions& s) {
            return s.place_mm.has_value();
        });
    return {scene.materials, scene.strain, scene.formulation, has_graded_patches};
}

namespace {

/// The solver of a scene whose mesh has so many levels, to be solved to a tolerance.
SolverOptions solver_of_levels(const Scene& scene, std::size_t levels) {
    SolverOptions options = scene.solver;
    if (scene.mesh.levels > 1 && levels == 1 && options.kind == SolverKind::multigrid)
        options.kind = SolverKind::automatic;  // load_mesh noted why there are no levels
    return options;
}

}  // namespace

SolverOptions solver_options(const Scene& scene, const MeshHierarchy& hierarchy, Use use) {
    SolverOptions options = solver_of_levels(scene, hierarchy.levels.size());
    if (use == Use::track && scene.solver.kind == SolverKind::automatic &&
        why_not_live(elastic_model(scene), hierarchy).empty())
        options.kind = SolverKind::live;
    return options;
}

namespace {

/// To the system: what was freed of a whole mesh lies in pieces between what the body has.
void give_back_memory() {
#ifdef __GLIBC__
    (void)malloc_trim(0);
#endif
}

/// Throws Error unless there is exactly one material for each region that the mesh has on any rank.
/// A region may be gone with a piece that a cut has freed.
void check_materials(MPI_Comm comm, const Scene& scene, const std::vector<std::int32_t>& regions) {
    std::set<std::int32_t> all(regions.begin(), regions.end());
    const auto found = of_all_ranks(comm, std::vector<std::int32_t>(all.begin(), all.end()));
    all.insert(found.begin(), found.end());
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        const int region = scene.materials[i].region;
        for (std::size_t j = 0; j < i; ++j)
            if (scene.materials[j].region == region)
                fail(
                    "materials[{}].region = {} is materials[{}]'s too, expected one material for "
                    "each region",
                    i, region, j);
        if (region == 0 || all.contains(region)) continue;
        const std::string nowhere = fmt::format(
            "materials[{}].region = {}: the mesh has no cell of that region", i, region);
        if (scene.cuts.empty() || scene.free_pieces != FreePieces::leave_out) fail("{}", nowhere);
        int rank = 0;
        MPI_Comm_rank(comm, &rank);
        if (rank == 0) log_info("note         " + nowhere + " any more: a piece is left out");
    }
    if (all.empty()) all.insert(0);
    for (const int region : all) (void)material_of(scene.materials, region);
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
DistributedHierarchy distribute(MPI_Comm comm, const Scene& scene, SceneMesh mesh,
                                double& partition_s) {
    DistributedHierarchy levels = with_context(scene.mesh.file.string(), [&] {
        const auto start = std::chrono::steady_clock::now();
        const auto parts = partition_levels(comm, mesh.rows, scene.solver.partitioner);
        partition_s = seconds_since(start);
        return DistributedHierarchy{comm, mesh.rows, parts};
    });
    mesh.rows = {};
    for (int i = 0; i < mesh.refine; ++i) levels.add_refined();
    if (scene.elements == Elements::p2) levels.add_quadratic();
    return levels;
}

/// A hierarchy of as many levels as `levels` has, of which the finest is this rank's part, with its
/// sets, and the others are empty.
MeshHierarchy part_of(DistributedHierarchy& levels) {
    MeshHierarchy part;
    part.levels.resize(levels.levels.size());
    TetMesh& mesh = part.levels.front() = local_mesh(levels.levels.front().share);
    mesh.node_sets = std::move(levels.sets.nodes);
    mesh.triangle_sets = std::move(levels.sets.triangles);
    return part;
}

bool takes_levels(const SolverOptions& options, std::size_t levels) {
    const SolverKind kind = resolved_kind(options.kind, levels);
    return kind == SolverKind::multigrid || kind == SolverKind::live;
}

/// A mesh that is taken apart for its ranks, and the options of the solver that takes it.
struct TakenMesh {
    DistributedHierarchy levels;
    SolverOptions options;
};

/// Of one rank: `hierarchy`, to which the levels refer, gets the scene's elements, and loses the
/// coarser levels that the solver does not take.
TakenMesh take_whole(MPI_Comm comm, const Scene& scene, Use use, MeshHierarchy& hierarchy) {
    const bool is_quadratic = !hierarchy.levels.front().quadratic_hexahedra.empty();
    if (use == Use::track && (is_quadratic || scene.elements == Elements::p2))
        refuse_hexahedra(hierarchy, is_quadratic ? "track" : "elements = P2");
    hierarchy = in_elements(std::move(hierarchy), scene.elements);
    const SolverOptions options = solver_options(scene, hierarchy, use);
    if (!takes_levels(options, hierarchy.levels.size())) {
        hierarchy.levels.resize(1);
        hierarchy.transfers.clear();
    }
    hierarchy.parents.clear();
    return {DistributedHierarchy{comm, hierarchy}, options};
}

/// Of several: `hierarchy` gets this rank's part.
TakenMesh take_rows(MPI_Comm comm, const Scene& scene, SceneMesh mesh, SceneBody& body) {
    DistributedHierarchy levels = distribute(comm, scene, std::move(mesh), body.partition_s);
    const SolverOptions options = solver_of_levels(scene, levels.levels.size());
    if (!takes_levels(options, levels.levels.size())) levels.drop_coarser();
    body.hierarchy = part_of(levels);
    give_back_memory();
    return {std::move(levels), options};
}

}  // namespace

SceneBody make_body(MPI_Comm comm, const Scene& scene, SceneMesh mesh, Use use,
                    const MeshWork& with_mesh) {
    int ranks = 1;
    MPI_Comm_size(comm, &ranks);
    const bool is_shared = ranks > 1;
    const MeshHierarchy& read = is_shared ? mesh.rows.rows : mesh.whole;
    check_materials(comm, scene, read.levels.front().regions);
    SceneBody body;
    if (!is_shared) body.hierarchy = std::move(mesh.whole);
    TakenMesh taken = is_shared ? take_rows(comm, scene, std::move(mesh), body)
                                : take_whole(comm, scene, use, body.hierarchy);
    pause_point();
    ElasticModel model = elastic_model(scene);
    if (use != Use::track) model.has_graded_patches = false;  // no frame moves them
    if (with_mesh) with_mesh(body.mesh(), taken.levels);
    body.body =
        std::make_unique<DeformableBody>(std::move(taken.levels), model, scene.time, taken.options);
    const bool is_cut_later = use == Use::track && scene.track && has_blades(*scene.track);
    if (body.body->linear_solver().kind() != SolverKind::live && !is_cut_later)
        drop_coarser_meshes(body.hierarchy);  // the body has its own part of them
    if (is_shared) give_back_memory();
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
