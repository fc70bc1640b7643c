#pragma once

#include <memory>

#include "apps/scene.hpp"
#include "base/progress.hpp"
#include "solvers/deformable_body.hpp"

namespace livetet {

/// The nodes that a selection of a scene means. Throws Error, naming `key`, where it means none.
std::vector<std::int32_t> select_nodes(const TetMesh& mesh, const SelectionOptions& selection, const std::string& key);

/// The mesh hierarchy that a scene names: read, or meshed on the spot.
MeshHierarchy load_mesh(const MeshSource& source, const ProgressCallback& progress);

/// The scene's fixed nodes and its driven ones, each driven set as far as its ramp has come after `time_s` (static:
/// infinity, all the way). Fixed nodes win over driven ones.
class SceneConstraints {
  public:
    SceneConstraints(const Scene& scene, const TetMesh& mesh);
    const Constraints& at(double time_s);

  private:
    struct Driven {
        std::vector<std::int32_t> nodes;
        Vector3 displacement;
        std::uint8_t components;
        double ramp_s;
    };
    struct Fixed {
        std::vector<std::int32_t> nodes;
        std::uint8_t components;
    };
    std::vector<Driven> driven_;
    std::vector<Fixed> fixed_;
    Constraints constraints_;
};

/// The scene's gravity and loads as forces at the nodes, N.
std::vector<Vector3> scene_forces(const Scene& scene, const TetMesh& mesh);

/// How far the solves of a scene go: Newton to its tolerance.
StepEffort batch_effort(const Scene& scene);

/// A scene's hierarchy and the body on it. Collective.
struct SceneBody {
    MeshHierarchy hierarchy;
    std::vector<std::vector<std::int32_t>> parts;
    std::unique_ptr<DeformableBody> body;

    const TetMesh& mesh() const { return hierarchy.levels.front(); }
};

SceneBody make_body(MPI_Comm comm, const Scene& scene, MeshHierarchy hierarchy);

}  // namespace livetet
