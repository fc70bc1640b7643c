#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/scene/scene.hpp"
#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet {

/// The scene's fixed and driven nodes, hard and soft. Fixed nodes take precedence over driven ones.
class SceneConstraints {
  public:
    /// `mesh`: whole; it is not kept.
    SceneConstraints(const Scene& scene, const TetMesh& mesh);

    /// From here on all is of this rank's part of the mesh, in its local nodes.
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
        std::vector<Vector3> arms{};             ///< from the centre of the turn to each of them, m
        double count = 0;                        ///< of them on all ranks
        Vector3 displacement = Vector3::Zero();  ///< m
        Vector3 turn = Vector3::Zero();          ///< rotation vector, rad
        std::uint8_t components = 7;
        std::optional<double> stiffness{};  ///< of all nodes together, N/m; none: hard
        double ramp_s = 0;
        std::vector<Vector3> values{};  ///< present displacements of the nodes
    };
    /// What the ranks share, where it is restricted to a part.
    struct Shared {
        MPI_Comm comm;
        std::int32_t owned;  ///< nodes of this rank
    };
    void add(Driven driven, const TetMesh& mesh, const Vector3& centre = Vector3::Zero());
    void move(Driven& driven, double share);

    std::optional<Shared> shared_;
    std::vector<Driven> driven_;  ///< fixed sets last, with zero displacement
    Constraints constraints_;
    Springs springs_;
};

/// Throws Error if a static scene leaves rigid motions of the body free: which, and how many.
void check_no_free_motion(const Scene& scene, const TetMesh& mesh,
                          const SceneConstraints& constraints);

}  // namespace livetet
