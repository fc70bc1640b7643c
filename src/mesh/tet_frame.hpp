#pragma once

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <limits>
#include <span>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Barycentric coordinates in a tet: lambda_{1,2,3} = [x1 - x0, x2 - x0, x3 - x0]^-1 (x - x0),
/// lambda_0 = 1 - lambda_1 - lambda_2 - lambda_3.
struct TetFrame {
    Vector3 origin;           ///< x0, m
    Eigen::Matrix3d inverse;  ///< its rows are the gradients of lambda_{1,2,3}, 1/m

    std::array<double, 4> weights(const Vector3& x) const {
        const Vector3 w = inverse * (x - origin);
        return {1 - w.x() - w.y() - w.z(), w.x(), w.y(), w.z()};
    }
};

inline TetFrame frame_of(const TetMesh& mesh, const Tet& t) {
    const Vector3& origin = mesh.nodes[t[0]];
    Eigen::Matrix3d edges;
    for (int k = 0; k < 3; ++k) edges.col(k) = mesh.nodes[t[k + 1]] - origin;
    return {origin, edges.inverse()};
}

/// Of the tets that were looked at, the one that holds a place, or comes nearest to it: the one in
/// which its least weight is greatest.
struct HoldingTet {
    std::int32_t tet = -1;
    std::array<double, 4> weights{};
    double least = -std::numeric_limits<double>::infinity();

    void look(const TetMesh& mesh, std::span<const std::int32_t> tets, const Vector3& place) {
        for (const std::int32_t e : tets) {
            const auto w = frame_of(mesh, mesh.tets[e]).weights(place);
            const double least_here = *std::ranges::min_element(w);
            if (least_here <= least) continue;
            *this = {e, w, least_here};
        }
    }
};

}  // namespace livetet
