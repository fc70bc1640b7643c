#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "apps/scene/mesh_grading.hpp"
#include "apps/scene/mesh_source.hpp"
#include "apps/scene/scene.hpp"
#include "apps/scene/scene_constraints.hpp"
#include "base/progress.hpp"
#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet {

/// Reads the mesh hierarchy of a scene, or meshes its image or surface, refines it if requested,
/// and cuts it as the scene says (`with_cuts`). Logs a note where the mesher deviated from the
/// request. A surface that could not be meshed is written to the working folder.
MeshHierarchy load_mesh(const Scene& scene, const ProgressCallback& progress);

/// The same for a mesh block, whatever its key `grading`: `grading` has what the mesh is graded by.
MeshHierarchy load_mesh(const MeshSource& source, const ProgressCallback& progress,
                        const SceneGrading& grading);

/// Throws Error, naming what was asked for, if the mesh is a grid of hexahedra.
void refuse_hexahedra(const MeshHierarchy& hierarchy, const std::string& what);

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
    /// On one rank the body refers to its transfers; on several there are none. Coarser meshes are
    /// empty except for the live solver.
    MeshHierarchy hierarchy;
    std::unique_ptr<DeformableBody> body;
    double partition_s = 0;  ///< time of METIS or PTScotch

    /// The whole finest mesh; on several ranks, where make_body has called a WholeMeshWork, this
    /// rank's part of it.
    const TetMesh& mesh() const { return hierarchy.levels.front(); }
    const PartitionedMesh& share() const { return body->linear_solver().fine().share(); }
    std::size_t node_count() const { return share().total; }  ///< of the whole mesh
    std::size_t tet_count() const { return body->linear_solver().tet_count(); }
};

/// What is made of the whole finest mesh, and of this rank's part of it, before a body is.
using WholeMeshWork = std::function<void(const TetMesh& whole, const PartitionedMesh& share)>;

/// Calls `with_whole`, if it is given, as soon as each rank has its part. On several ranks the
/// whole mesh is gone then, before elements and operators are made. Collective.
SceneBody make_body(MPI_Comm comm, const Scene& scene, MeshHierarchy hierarchy, Use use,
                    const WholeMeshWork& with_whole = {});

/// A body to be solved, and what its scene prescribes: on several ranks each has its part alone.
struct HeldBody {
    SceneBody body;
    SceneConstraints constraints;
    std::vector<Vector3> forces;  ///< see scene_forces
};

/// Throws Error if the scene leaves rigid motions free (check_no_free_motion). `with_whole`: what
/// else is made of the whole mesh. Collective.
HeldBody make_held_body(MPI_Comm comm, const Scene& scene, MeshHierarchy hierarchy,
                        const WholeMeshWork& with_whole = {});

}  // namespace livetet
