#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace livetet {

using Vector3 = Eigen::Vector3d;
using Triangle = std::array<std::int32_t, 3>;

/// Triangulated surface, wound so that normals point outwards. Positions in metres.
struct TriangleMesh {
    std::vector<Vector3> nodes;
    std::vector<Triangle> triangles;
};

}  // namespace livetet
