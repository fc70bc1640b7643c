#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/scene/scene.hpp"
#include "solvers/nonlinear/deformable_body.hpp"
#include "solvers/parallel/level_pieces.hpp"
#include "solvers/parallel/mesh_part.hpp"

namespace livetet {

/// The scene's fixed and driven nodes, hard and soft. Fixed nodes take precedence over driven ones.
class SceneConstraints {
  public:
    /// Of the local nodes of `part`, which is not kept. Collective.
    SceneConstraints(const Scene& scene, const MeshPart& part);

    /// Moves each driven set along its ramp to `time_s`.
    void move_to_time(double time_s);
    /// Moves all driven sets by this share of their displacement, 0 to 1.
    void move_to_share(double share);

    /// Force of each set on the body, N, by its key in the scene: of springs by their extension, of
    /// hard sets by the reactions of the components that they are the last to prescribe. Pieces
    /// that stay at rest because nothing holds them (`resting_nodes`) are the set "free_pieces".
    /// Collective.
    std::vector<std::pair<std::string, Vector3>> forces(
        std::span<const Vector3> reactions, std::span<const Vector3> displacement) const;

    const Constraints& constraints() const { return constraints_; }
    const Springs& springs() const { return springs_; }

  private:
    struct Driven {
        std::string key;
        std::vector<std::int32_t> nodes;
        std::vector<Vector3> arms{};   ///< from the centre of the turn to each of them, m
        std::vector<double> shares{};  ///< of the stiffness, of each (shares_of_nodes); soft only
        Vector3 displacement = Vector3::Zero();  ///< m
        Vector3 turn = Vector3::Zero();          ///< rotation vector, rad
        std::uint8_t components = 7;
        std::optional<double> stiffness{};  ///< of all nodes together, N/m; none: hard
        double ramp_s = 0;
        std::vector<Vector3> values{};  ///< present displacements of the nodes
    };
    void add(Driven driven, const MeshPart& part, const Vector3& centre = Vector3::Zero());
    void move(Driven& driven, double share);

    MPI_Comm comm_;               ///< of the ranks; MPI_COMM_SELF where there are no others
    std::int32_t owned_;          ///< nodes of this rank
    std::vector<Driven> driven_;  ///< fixed sets last, with zero displacement
    Constraints constraints_;
    Springs springs_;
};

/// Throws Error if a static scene leaves rigid motions of the body free: which, and how many.
/// `pieces`: of the mesh that `part` is of. Collective.
void check_no_free_motion(const Scene& scene, const MeshPart& part, const LevelPieces& pieces,
                          const SceneConstraints& constraints);
void check_no_free_motion(const Scene& scene, const TetMesh& whole,
                          const SceneConstraints& constraints);

}  // namespace livetet
