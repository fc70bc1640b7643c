#pragma once

#include <memory>

#include "apps/scene/mesh_source.hpp"
#include "apps/scene/scene.hpp"
#include "base/progress.hpp"
#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet {

/// The nodes that a selection of a scene means. Throws Error, naming `key`, where it means none.
std::vector<std::int32_t> select_nodes(const TetMesh& mesh, const SelectionOptions& selection,
                                       const std::string& key);

/// The mesh hierarchy that a scene names: read, or meshed on the spot, and refined where it says
/// so. What came out otherwise than asked is printed as notes; a surface that could not be meshed
/// is written to the working folder.
MeshHierarchy load_mesh(const MeshSource& source, const ProgressCallback& progress);

/// The scene's fixed nodes and its driven ones, hard and soft. Fixed nodes win over driven ones.
class SceneConstraints {
  public:
    SceneConstraints(const Scene& scene, const TetMesh& mesh);

    /// Each driven set as far as its ramp has come after `time_s`.
    void move_to_time(double time_s);
    /// All driven sets by this share of their way, from 0 to 1.
    void move_to_share(double share);

    /// What each set pulls the body with, N, by the scene's key: springs by their stretch, hard
    /// sets by the reactions of the components that they are the last to prescribe.
    std::vector<std::pair<std::string, Vector3>> forces(
        std::span<const Vector3> reactions, std::span<const Vector3> displacement) const;

    const Constraints& constraints() const { return constraints_; }
    const Springs& springs() const { return springs_; }

  private:
    struct Driven {
        std::string key;
        std::vector<std::int32_t> nodes;
        Vector3 displacement, turn, centre;  ///< m; rotation vector, rad; m
        std::uint8_t components;
        std::optional<double> stiffness;  ///< N/m of all nodes together: soft
        double ramp_s;
        std::vector<Vector3> values{};  ///< of the nodes, now
    };
    void move(Driven& driven, double share);

    const TetMesh& mesh_;
    std::vector<Driven> driven_;  ///< fixed ones last, with nowhere to go
    Constraints constraints_;
    Springs springs_;
};

/// The scene's gravity and loads as forces at the nodes, N; empty where it has neither.
std::vector<Vector3> scene_forces(const Scene& scene, const TetMesh& mesh);

/// How far the solves of a scene go: Newton to its tolerance.
SolveControls solve_controls(const Scene& scene);

/// What a body's operators need of a scene. `live`: `automatic` means no pressures.
ElasticModel elastic_model(const Scene& scene, bool live);

/// The scene's solver; `live`: `automatic` means the live one where that can be on this mesh.
SolverOptions solver_options(const Scene& scene, const MeshHierarchy& hierarchy, bool live);

/// Throws Error where rigid motions of the body are free in a static scene: which, and how many.
void check_held(const Scene& scene, const TetMesh& mesh, const SceneConstraints& constraints);

/// A scene's hierarchy and the body on it. Collective.
struct SceneBody {
    MeshHierarchy hierarchy;  ///< the body goes on reading its transfers; its coarser meshes are
                              ///< empty unless the body is live
    std::unique_ptr<DeformableBody> body;
    double partition_s = 0;  ///< what METIS or PTScotch took

    const TetMesh& mesh() const { return hierarchy.levels.front(); }
};

SceneBody make_body(MPI_Comm comm, const Scene& scene, MeshHierarchy hierarchy, bool live = false);

}  // namespace livetet
