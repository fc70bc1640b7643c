#pragma once

#include <optional>
#include <vector>

#include "apps/scene/scene.hpp"
#include "mesh/quadratic.hpp"
#include "solvers/parallel/partitioned_mesh.hpp"
#include "tracking/fiducials.hpp"

namespace livetet {

/// Warns of each probe point that is more than 1 mm outside the mesh of the sampler.
void warn_of_points_outside(const std::vector<NamedPoint>& points, const PointSampler& sampler);

/// A scene's probe points, and what samples displacements at them. It keeps the tets that the
/// points are in, not the mesh.
class Probes {
  public:
    /// Reads the points. Warns, on the first rank, of each that is more than 1 mm outside the mesh.
    /// `mesh`: whole; `share`: of it. Throws Error. Collective.
    Probes(const ProbeOptions& options, const TetMesh& mesh, const PartitionedMesh& share);

    const std::vector<NamedPoint>& points() const { return points_; }
    /// Displacements at the points, on the first rank (elsewhere none), from those of each rank's
    /// nodes. Collective.
    std::vector<Vector3> sample(std::span<const Vector3> local) const;

  private:
    std::vector<NamedPoint> points_;
    std::optional<SharedRows> nodes_;  ///< of the tets: used on the first rank
    std::optional<PointSampler> sampler_;
    std::int32_t owned_ = 0;
};

}  // namespace livetet
