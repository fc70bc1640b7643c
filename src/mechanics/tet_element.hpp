#pragma once

#include <Eigen/Core>

#include <array>

namespace livetet {

/// Rest shape and moduli of a straight-edged tetrahedron.
/// gradients.col(i): gradient of barycentric coordinate L_i (1/m); they sum to zero. volume in m^3;
/// lambda, mu in Pa.
struct TetElement {
    Eigen::Matrix<double, 3, 4> gradients;
    double volume;
    double lambda;
    double mu;
};

/// Gradients and volume of the tet x0..x3 (metres). Precondition: positive volume.
TetElement make_element(const std::array<Eigen::Vector3d, 4>& x, double lambda, double mu);

}  // namespace livetet
