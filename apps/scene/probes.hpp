#pragma once

#include <vector>

#include "apps/scene/scene.hpp"
#include "mesh/quadratic.hpp"
#include "tracking/fiducials.hpp"

namespace livetet {

/// A scene's probe points, and what samples displacements at them.
struct Probes {
    /// Reads the points. Warns of each that is more than 1 mm outside the mesh. Throws Error.
    Probes(const ProbeOptions& options, const TetMesh& mesh);

    std::vector<NamedPoint> points;
    PointSampler sampler;
};

}  // namespace livetet
