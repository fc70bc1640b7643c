#pragma once

#include <memory>

#include "apps/scene/mesh_grading.hpp"
#include "apps/scene/mesh_source.hpp"
#include "apps/scene/scene.hpp"
#include "base/progress.hpp"
#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet {

/// The nodes of a selection. Throws Error, naming `key`, if there are none.
std::vector<std::int32_t> select_nodes(const TetMesh& mesh, const SelectionOptions& selection,
                                       const std::string& key);

/// Reads the mesh hierarchy of a scene, or meshes its image or surface, refines it if requested,
/// and cuts it as the scene says (`with_cuts`). Logs a note where the mesher deviated from the
/// request. A surface that could not be meshed is written to the working folder.
MeshHierarchy load_mesh(const Scene& scene, const ProgressCallback& progress);

/// The same for a mesh block, whatever its key `grading`: `grading` has what the mesh is graded by.
MeshHierarchy load_mesh(const MeshSource& source, const ProgressCallback& progress,
                        const SceneGrading& grading);

/// Throws Error, naming what was asked for, if the mesh is a grid of hexahedra.
void refuse_hexahedra(const MeshHierarchy& hierarchy, const std::string& what);

/// The scene's fixed and driven nodes, hard and soft. Fixed nodes take precedence over driven ones.
class SceneConstraints {
  public:
    /// `mesh`: whole; must outlive this.
    SceneConstraints(const Scene& scene, const TetMesh& mesh);

    /// From here on the mesh is this rank's part of it (local_mesh), which must have taken its
    /// place; `share` must outlive this.
    void restrict_to(const PartitionedMesh& share);

    /// Moves each driven set along its ramp to `time_s`.
    void move_to_time(double time_s);
    /// Moves all driven sets by this share of their displacement, 0 to 1.
    void move_to_share(double share);

    /// Force of each set on the body, N, by its key in the scene: of springs by their extension, of
    /// hard sets by the reactions of the components that they are the last to prescribe. Pieces
    /// that stay at rest because nothing holds them (`resting_nodes`) are the set "free_pieces".
    /// Collective after `restrict_to`.
    std::vector<std::pair<std::string, Vector3>> forces(
        std::span<const Vector3> reactions, std::span<const Vector3> displacement) const;

    const Constraints& constraints() const { return constraints_; }
    const Springs& springs() const { return springs_; }

  private:
    struct Driven {
        std::string key;
        std::vector<std::int32_t> nodes;
        double count;                        ///< of them on all ranks
        Vector3 displacement, turn, centre;  ///< m; rotation vector, rad; m
        std::uint8_t components;
        std::optional<double> stiffness;  ///< of all nodes together, N/m; none: hard
        double ramp_s;
        std::vector<Vector3> values{};  ///< present displacements of the nodes
    };
    void move(Driven& driven, double share);

    const TetMesh& mesh_;
    const PartitionedMesh* share_ = nullptr;  ///< null: the mesh is whole
    std::vector<Driven> driven_;              ///< fixed sets last, with zero displacement
    Constraints constraints_;
    Springs springs_;
};

/// Gravity and loads of the scene as nodal forces, N; empty if it has neither.
std::vector<Vector3> scene_forces(const Scene& scene, const TetMesh& mesh);

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

/// Throws Error if a static scene leaves rigid motions of the body free: which, and how many.
void check_no_free_motion(const Scene& scene, const TetMesh& mesh,
                          const SceneConstraints& constraints);

/// The mesh hierarchy of a scene and the body on it. Collective.
struct SceneBody {
    /// On one rank the body refers to its transfers; on several there are none. Coarser meshes are
    /// empty except for the live solver.
    MeshHierarchy hierarchy;
    std::unique_ptr<DeformableBody> body;
    double partition_s = 0;  ///< time of METIS or PTScotch

    /// The whole finest mesh; on several ranks, after `keep_part`, this rank's part of it.
    const TetMesh& mesh() const { return hierarchy.levels.front(); }
    const PartitionedMesh& share() const { return body->linear_solver().fine().share(); }
    std::size_t node_count() const { return share().total; }  ///< of the whole mesh
    std::size_t tet_count() const { return body->linear_solver().tet_count(); }

    /// Where there are several ranks: frees the whole mesh. `mesh`, the constraints and the forces
    /// (see scene_forces) are this rank's part from then on, as the body takes them.
    void keep_part(SceneConstraints& constraints, std::vector<Vector3>& forces);
};

SceneBody make_body(MPI_Comm comm, const Scene& scene, MeshHierarchy hierarchy, Use use);

}  // namespace livetet
