#pragma once

#include <Eigen/Dense>

#include <array>
#include <cmath>
#include <span>

#include "mechanics/hex_kernels.hpp"
#include "mesh/quadratic_hexahedra.hpp"

namespace livetet {

/// A hexahedron of 27 nodes (Q2) that its shape functions map from the unit cube,
///
///     x(xi) = sum_i N_i(xi) x_i,   J = dx / dxi,   grad N_i = J^-T dN_i / dxi,   dV = det J dxi,
///
/// by Gauss's 3 x 3 x 3 points: exact for the stiffness of a small strain where J is constant.
/// As a TetElement it is the parallelepiped of the Jacobian at its middle, with its own volume:
/// gradients of the coordinates xi there. `share`: what of it is inside the body.
struct MappedHexahedron : TetElement {
    Eigen::Matrix<double, 3, 27> x;  ///< of its nodes, m
    double share;
};

template <>
struct ElementShape<27> {
    static constexpr int points = 27;
    using Gradients = Eigen::Matrix<double, 3, 27>;

    /// Shape functions, their slopes by xi, and the point's part of the unit cube.
    struct Point {
        Eigen::Matrix<double, 27, 1> values;
        Gradients slopes;
        double weight;
    };
    static const Point& at(int point) {
        static const std::array<Point, points> all = [] {
            const double far = std::sqrt(0.6) / 2;
            const double places[3] = {0.5 - far, 0.5, 0.5 + far};
            constexpr double weights[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
            std::array<Point, points> made;
            for (int p = 0; p < points; ++p) {
                const int i = p % 3, j = p / 3 % 3, k = p / 9;
                const Vector3 xi(places[i], places[j], places[k]);
                made[p] = {quadratic_shape(xi), quadratic_slopes(xi),
                           weights[i] * weights[j] * weights[k]};
            }
            return made;
        }();
        return all[point];
    }
};

/// The hexahedron whose nodes are at `x`, m; `share` of it is inside the body.
inline MappedHexahedron make_mapped_hexahedron(const Eigen::Matrix<double, 3, 27>& x, double share,
                                               double lambda, double mu) {
    static const Eigen::Matrix<double, 3, 27> of_middle = quadratic_slopes(Vector3::Constant(0.5));
    using Shape = ElementShape<27>;
    MappedHexahedron e;
    e.x = x;
    e.share = share;
    e.lambda = lambda;
    e.mu = mu;
    e.gradients.rightCols<3>() = Eigen::Matrix3d(x * of_middle.transpose()).inverse().transpose();
    e.gradients.col(0) = -e.gradients.rightCols<3>().rowwise().sum();
    e.volume = 0;
    for (int p = 0; p < Shape::points; ++p)
        e.volume += share * Shape::at(p).weight *
                    Eigen::Matrix3d(x * Shape::at(p).slopes.transpose()).determinant();
    return e;
}

/// Hexahedron e of a mesh, without moduli.
inline MappedHexahedron mapped_hexahedron(const TetMesh& mesh, std::size_t e) {
    Eigen::Matrix<double, 3, 27> x;
    for (int i = 0; i < 27; ++i) x.col(i) = mesh.nodes[mesh.quadratic_hexahedra[e][i]];
    return make_mapped_hexahedron(x, mesh.shares.empty() ? 1 : mesh.shares[e], 0, 0);
}

template <int nodes = 27>
ElementPoint<nodes> element_point(const MappedHexahedron& e, int point) {
    const ElementShape<27>::Point& at = ElementShape<27>::at(point);
    const Eigen::Matrix3d J = e.x * at.slopes.transpose();
    return {J.inverse().transpose() * at.slopes, e.share * at.weight * J.determinant()};
}

/// Its four pressures are those of 1 and of the coordinates xi - 1/2 of the parallelepiped: linear
/// in space, however the cell is bent, which keeps the order (Arnold, Boffi, Falk 2002,
/// "Approximation by quadrilateral finite elements").
template <int nodes = 27>
Eigen::Vector4d pressure_shape(const MappedHexahedron& e, int point) {
    static const Eigen::Matrix<double, 27, 1> of_middle = quadratic_shape(Vector3::Constant(0.5));
    Eigen::Vector4d values;
    values << 1, e.gradients.rightCols<3>().transpose() *
                     (e.x * (ElementShape<27>::at(point).values - of_middle));
    return values;
}

/// In proportion to the consistent mass matrix's diagonal (Hinton, Rock, Zienkiewicz 1976).
template <int nodes = 27>
Eigen::Matrix<double, 27, 1> mass_shares(const MappedHexahedron& e) {
    Eigen::Matrix<double, 27, 1> diagonal = Eigen::Matrix<double, 27, 1>::Zero();
    for (int p = 0; p < ElementShape<27>::points; ++p)
        diagonal += element_point(e, p).weight * ElementShape<27>::at(p).values.cwiseAbs2();
    return diagonal / diagonal.sum();
}

/// The integrals of N_i over the element, m^3: a node's part of a body force.
inline Eigen::Matrix<double, 27, 1> force_volumes(const MappedHexahedron& e) {
    Eigen::Matrix<double, 27, 1> volumes = Eigen::Matrix<double, 27, 1>::Zero();
    for (int p = 0; p < ElementShape<27>::points; ++p)
        volumes += element_point(e, p).weight * ElementShape<27>::at(p).values;
    return volumes;
}

}  // namespace livetet
