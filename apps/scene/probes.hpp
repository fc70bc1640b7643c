#pragma once

#include <optional>
#include <vector>

#include "apps/scene/scene.hpp"
#include "mesh/quadratic.hpp"
#include "solvers/parallel/mesh_part.hpp"
#include "tracking/fiducials.hpp"

namespace livetet {

/// Warns of each probe point that is more than 1 mm outside the mesh. `distances`: from it, m.
void warn_of_points_outside(const std::vector<NamedPoint>& points,
                            std::span<const double> distances);

/// A scene's probe points, and what samples displacements at them, each by the rank whose part of
/// the mesh is nearest. It keeps the tets that the points are in, not the mesh.
class Probes {
  public:
    /// Collective.
    Probes(std::vector<NamedPoint> points, const MeshPart& part);

    const std::vector<NamedPoint>& points() const { return points_; }
    /// From the whole mesh, m.
    const std::vector<double>& distances() const { return distances_; }
    /// Displacements at the points, on every rank, from those of local nodes. Collective.
    std::vector<Vector3> sample(std::span<const Vector3> local) const;

  private:
    std::vector<NamedPoint> points_;
    std::vector<double> distances_;
    MPI_Comm comm_;
    std::vector<std::size_t> mine_;    ///< points that this rank samples
    std::vector<std::int32_t> nodes_;  ///< local nodes of the tets that they are in
    std::optional<PointSampler> sampler_;
};

}  // namespace livetet
