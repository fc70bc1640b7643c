#include "mechanics/tet_element.hpp"

#include <Eigen/Geometry>

namespace livetet {

TetElement make_element(const std::array<Eigen::Vector3d, 4>& x, double lambda, double mu) {
    const Eigen::Vector3d a = x[1] - x[0], b = x[2] - x[0], c = x[3] - x[0];
    const double six_volumes = a.dot(b.cross(c));
    TetElement e{{}, six_volumes / 6, lambda, mu};
    e.gradients.col(1) = b.cross(c) / six_volumes;
    e.gradients.col(2) = c.cross(a) / six_volumes;
    e.gradients.col(3) = a.cross(b) / six_volumes;
    e.gradients.col(0) = -e.gradients.col(1) - e.gradients.col(2) - e.gradients.col(3);
    return e;
}

}  // namespace livetet
