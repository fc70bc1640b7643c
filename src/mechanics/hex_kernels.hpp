#pragma once

#include "mechanics/tet_kernels.hpp"

namespace livetet {

/// Shape functions and quadrature of an element with `nodes` nodes: a tet of 4 or 10, or a
/// hexahedron of 8.
template <int nodes>
struct ElementShape : TetShape<nodes> {};

/// A hexahedron that is a parallelepiped (Q1), by the element of its corner tet (corners 0, 1, 2
/// and 4; its volume is the hexahedron's): the tet's barycentric coordinates L_1, L_2, L_3 are the
/// cell's own coordinates x, y, z from 0 to 1. With x_0 = 1 - x and x_1 = x,
///
///     N_c = x_i y_j z_k,   c = i + 2 j + 4 k.
///
/// Gauss's 2 x 2 x 2 points, of equal weight: exact for the stiffness of a small strain.
template <>
struct ElementShape<8> {
    static constexpr int points = 8;
    static constexpr double near = 0.78867513459481288225, far = 1 - near;  // (1 + 1 / sqrt 3) / 2
    using Gradients = Eigen::Matrix<double, 3, 8>;

    /// The cell's own coordinates of a point, which is the nearest to the corner of its number.
    static Eigen::Vector3d place(int point) {
        return {point & 1 ? near : far, point & 2 ? near : far, point & 4 ? near : far};
    }
    /// Derivatives by the cell's own coordinates, at place x.
    static Gradients local_gradients(const Eigen::Vector3d& x) {
        Gradients g;
        for (int c = 0; c < 8; ++c) {
            double value[3], slope[3];
            for (int d = 0; d < 3; ++d) {
                value[d] = c >> d & 1 ? x[d] : 1 - x[d];
                slope[d] = c >> d & 1 ? 1 : -1;
            }
            g.col(c) << slope[0] * value[1] * value[2], value[0] * slope[1] * value[2],
                value[0] * value[1] * slope[2];
        }
        return g;
    }
    /// By the places at rest, 1/m.
    static Gradients gradients(const TetElement& e, int point) {
        static const std::array<Gradients, points> local = [] {
            std::array<Gradients, points> all;
            for (int p = 0; p < points; ++p) all[p] = local_gradients(place(p));
            return all;
        }();
        return e.gradients.rightCols<3>() * local[point];
    }
    /// Barycentric coordinates with regard to the corner tet.
    static Eigen::Vector4d coordinates(int point) {
        const Eigen::Vector3d x = place(point);
        return {1 - x.sum(), x[0], x[1], x[2]};
    }
    static constexpr double mass_share(int) { return 0.125; }
    static constexpr double force_share(int) { return 0.125; }
};

/// What an integral over an element takes at a quadrature point: the shape functions' gradients,
/// 1/m, and the volume that the point stands for, m^3.
template <int nodes>
struct ElementPoint {
    Eigen::Matrix<double, 3, nodes> gradients;
    double weight;
};

/// Of elements whose Jacobian is constant: points of equal weight.
template <int nodes>
ElementPoint<nodes> element_point(const TetElement& e, int point) {
    using Shape = ElementShape<nodes>;
    return {Shape::gradients(e, point), e.volume / Shape::points};
}
/// Each node's share of a lumped mass.
template <int nodes>
Eigen::Matrix<double, nodes, 1> mass_shares(const TetElement&) {
    Eigen::Matrix<double, nodes, 1> shares;
    for (int i = 0; i < nodes; ++i) shares[i] = ElementShape<nodes>::mass_share(i);
    return shares;
}
/// Of the four pressures of an element at a point: barycentric coordinates.
template <int nodes>
Eigen::Vector4d pressure_shape(const TetElement&, int point) {
    return ElementShape<nodes>::coordinates(point);
}

}  // namespace livetet
