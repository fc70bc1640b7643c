#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/scene/body_factory.hpp"

namespace livetet {

/// Up to where a result is what its model stands for. Strain: largest principal stretch minus one;
/// in a model of small strains the largest principal small strain. A limit counts as passed if it
/// is in more than `tolerated_share` of the volume, as strains are singular at the edges of what is
/// driven.
struct ModelLimits {
    double strain = 1;                   ///< finite strain: twice the length
    std::optional<double> rotation_rad;  ///< none: the model rotates with the body

    static constexpr double tolerated_share = 0.01;
};

/// Small strain: 5 % and 0.1 rad, where the rotation alone adds a false strain of 0.5 %. Corotated:
/// 50 %, as its stress is linear in the stretch.
ModelLimits limits_of(Kinematics kinematics);

/// Sentences on a displacement (of each node, m) that cannot be meant: larger than the body, or
/// with strains or rotations beyond the limits of the materials' models. Empty if all is well. Uses
/// the corners of the tets alone. With `share`, which may be null, mesh and displacement are this
/// rank's part (see local_mesh), and the call is collective.
std::vector<std::string> beyond_model(const Scene& scene, const TetMesh& mesh,
                                      std::span<const Vector3> displacement,
                                      const PartitionedMesh* share = nullptr);

/// A sentence on elements that lock: nearly incompressible materials computed from displacements
/// alone. None if they do not.
std::optional<std::string> locking_note(const Scene& scene);

/// Newton iterations of a frame: `track.linearisations`. The default is 1, but 2 for Newmark's
/// scheme in the mixed form with a Poisson's ratio of 0.499 or above, whose steps do not damp what
/// one iteration leaves. Allocates.
int newton_iterations_of_frame(const Scene& scene);

/// A warning for tracked, nearly incompressible bodies in Newmark's steps: with one Newton
/// iteration swings may grow, and hexahedra may tear in deep presses. None for other scenes.
std::optional<std::string> swinging_note(const Scene& scene, const TetMesh& mesh);

}  // namespace livetet
