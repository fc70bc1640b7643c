#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "apps/scene/mesh_grading.hpp"
#include "apps/scene/mesh_source.hpp"
#include "apps/scene/scene.hpp"
#include "apps/scene/scene_constraints.hpp"
#include "base/progress.hpp"
#include "mesh/hierarchy_rows.hpp"
#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet {

/// Reads the mesh hierarchy of a scene, or meshes its image or surface, refines it if requested,
/// and cuts it as the scene says (`with_cuts`). Logs a note where the mesher deviated from the
/// request. A surface that could not be meshed is written to the working folder.
MeshHierarchy load_mesh(const Scene& scene, const ProgressCallback& progress);

/// The same for a mesh block, whatever its key `grading`: `grading` has what the mesh is graded by.
MeshHierarchy load_mesh(const MeshSource& source, const ProgressCallback& progress,
                        const SceneGrading& grading);

/// A scene's mesh hierarchy: whole on one rank; on several each has its rows, and refines its own
/// part of the finest level later.
struct SceneMesh {
    SceneMesh() = default;
    SceneMesh(MeshHierarchy whole) : whole(std::move(whole)) {}  // NOLINT: implicit
    SceneMesh(HierarchyRows rows, int refine) : rows(std::move(rows)), refine(refine) {}

    MeshHierarchy whole;  ///< on one rank
    HierarchyRows rows;   ///< on several
    int refine = 0;       ///< on several: how often the finest level is to be refined
};

/// As load_mesh. Several ranks read their rows of an .h5 file. The first one reads a file of
/// another kind, or one of so few tets that they must be refined before there are enough for each
/// rank (min_tets_per_rank), and gives each its rows. Collective.
SceneMesh load_mesh_for(MPI_Comm comm, const Scene& scene, const ProgressCallback& progress);

/// The whole finest mesh of a scene's body, which each rank reads. For meshes that fit on one.
/// Collective.
TetMesh finest_mesh(MPI_Comm comm, const Scene& scene);

/// Throws Error, naming what was asked for, if the mesh is of hexahedra.
void refuse_hexahedra(const MeshHierarchy& hierarchy, const std::string& what);

/// The levels of a scene's elements: of P2 with ten-node tets as a new finest level; of a grid its
/// hexahedra of 27 nodes alone. What has them already stays as it is.
MeshHierarchy in_elements(MeshHierarchy hierarchy, Elements elements);

/// Controls of the solves of `solve` and `study`: Newton to its tolerance.
SolveControls solve_controls(const Scene& scene);

/// What a body is made for: solves to a tolerance (`solve`, `study`), or frames in real time.
enum class Use { solve, track };

/// What the scene is for: `track` if it has a section of that name.
inline Use use_of(const Scene& scene) { return scene.track ? Use::track : Use::solve; }

/// The elastic model of a scene.
ElasticModel elastic_model(const Scene& scene);

/// The solver options of a scene. For `track`, the kind `automatic` means the live solver if it can
/// be used on this mesh. Where none of the levels could be made that `mesh.levels` asked for,
/// `multigrid` means `automatic`.
SolverOptions solver_options(const Scene& scene, const MeshHierarchy& hierarchy, Use use);

/// The mesh hierarchy of a scene and the body on it.
struct SceneBody {
    /// On one rank the body refers to its transfers; on several there are none, and the finest
    /// level is this rank's part. Coarser meshes are empty but for the live solver and for blades.
    MeshHierarchy hierarchy;
    std::unique_ptr<DeformableBody> body;
    double partition_s = 0;  ///< time of METIS or PTScotch

    /// The finest mesh; on several ranks this rank's part of it.
    const TetMesh& mesh() const { return hierarchy.levels.front(); }
    const PartitionedMesh& share() const { return body->linear_solver().fine().share(); }
    std::size_t node_count() const { return share().total; }  ///< of the whole mesh
    std::size_t tet_count() const { return body->linear_solver().tet_count(); }
};

/// Work on the finest mesh before a body is made of it: `mesh` with its sets, on several ranks this
/// rank's part.
using MeshWork = std::function<void(const TetMesh& mesh, const DistributedHierarchy& levels)>;

/// Calls `with_mesh`, if it is given, as soon as each rank has its part, before elements and
/// operators are made. Collective.
SceneBody make_body(MPI_Comm comm, const Scene& scene, SceneMesh mesh, Use use,
                    const MeshWork& with_mesh = {});

/// A body to be solved, and what its scene prescribes: on several ranks each has its part alone.
struct HeldBody {
    SceneBody body;
    SceneConstraints constraints;
    std::vector<Vector3> forces;  ///< see scene_forces
};

/// Throws Error if the scene leaves rigid motions free (check_no_free_motion). `with_mesh`: what
/// else is made of the mesh. Collective.
HeldBody make_held_body(MPI_Comm comm, const Scene& scene, SceneMesh mesh,
                        const MeshWork& with_mesh = {});

}  // namespace livetet
