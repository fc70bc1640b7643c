#include "mesh/cut_surface.hpp"

#include <Eigen/Dense>

namespace livetet {

bool is_in_patch(const PlanePatch& patch, const Vector3& x, double rounding) {
    const Vector3 arm = x - patch.point;
    if (patch.radius) return arm.norm() <= *patch.radius + rounding;
    if (!patch.edges) return true;
    Eigen::Matrix<double, 3, 2> edges;
    edges << (*patch.edges)[0], (*patch.edges)[1];
    // Coordinates along the edges, from the middle.
    const Eigen::Vector2d at = (edges.transpose() * edges).inverse() * (edges.transpose() * arm);
    const double shorter = edges.colwise().norm().minCoeff();
    return at.lpNorm<Eigen::Infinity>() <= 0.5 + rounding / shorter;
}

}  // namespace livetet
