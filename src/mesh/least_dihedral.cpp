#include "mesh/least_dihedral.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

#include "mesh/tet_faces.hpp"

namespace livetet {

double least_dihedral(std::span<const Vector3> nodes, const Tet& t) {
    if (!(signed_volume(nodes, t) > 0)) return -1;
    std::array<Vector3, 4> normals;  // outwards
    for (int k = 0; k < 4; ++k) {
        const auto& [a, b, c] = tet_faces[k];
        const Vector3& x = nodes[t[a]];
        normals[k] = (nodes[t[b]] - x).cross(nodes[t[c]] - x).normalized();
    }
    double largest_cosine = -1;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < i; ++j)
            largest_cosine = std::max(largest_cosine, -normals[i].dot(normals[j]));
    return std::acos(std::min(largest_cosine, 1.0));
}

}  // namespace livetet
