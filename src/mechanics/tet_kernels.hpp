#pragma once

#include "mechanics/materials/constitutive_model.hpp"
#include "mechanics/tet_element.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Shape functions and quadrature of a tet with `nodes` nodes: 4 (P1; one point, its gradients are
/// constant) or 10 (P2; four points, exact to degree 2: the stiffness of a small strain, and a
/// pressure's work).
template <int nodes>
struct TetShape;

template <>
struct TetShape<4> {
    static constexpr int points = 1;
    using Gradients = Eigen::Matrix<double, 3, 4>;
    static Gradients gradients(const TetElement& e, int) { return e.gradients; }
    /// Barycentric coordinates of a point.
    static Eigen::Vector4d coordinates(int) { return Eigen::Vector4d::Constant(0.25); }
    /// A node's share of the mass and of a body force: a quarter each.
    static constexpr double mass_share(int) { return 0.25; }
    static constexpr double force_share(int) { return 0.25; }
};

template <>
struct TetShape<10> {
    static constexpr int points = 4;
    static constexpr double near = 0.58541019662496845446,
                            far = 0.13819660112501051518;  // (5 + 3 sqrt 5) / 20, ...
    using Gradients = Eigen::Matrix<double, 3, 10>;
    static Eigen::Vector4d coordinates(int point) {
        Eigen::Vector4d L = Eigen::Vector4d::Constant(far);
        L[point] = near;
        return L;
    }
    /// Of N_i = L_i (2 L_i - 1) at corners, 4 L_i L_j at edges, at barycentric coordinates L.
    static Gradients gradients_at(const TetElement& e, const Eigen::Vector4d& L) {
        Gradients g;
        for (int i = 0; i < 4; ++i) g.col(i) = (4 * L[i] - 1) * e.gradients.col(i);
        for (int k = 0; k < 6; ++k) {
            const int i = tet_edges[k][0], j = tet_edges[k][1];
            g.col(4 + k) = 4 * (L[i] * e.gradients.col(j) + L[j] * e.gradients.col(i));
        }
        return g;
    }
    static Gradients gradients(const TetElement& e, int point) {
        return gradients_at(e, coordinates(point));
    }
    /// Lumped in proportion to the consistent mass matrix's diagonal (Hinton, Rock, Zienkiewicz
    /// 1976): row sums would be negative at corners.
    static constexpr double mass_share(int node) { return node < 4 ? 1.0 / 36 : 4.0 / 27; }
    /// The integral of N_i over the volume.
    static constexpr double force_share(int node) { return node < 4 ? -0.05 : 0.2; }
};

/// One 3x3 block of the `frozen_rotation` tangent of an isotropic tet, without the volume strain's
/// part: K_ij = V (mu h_j h_i^T + mu (h_i . h_j) I), in N/m, of rotated gradients h_i = R g_i.
inline Eigen::Matrix3d shear_block(double volume_mu, const Eigen::Vector3d& h_i,
                                   const Eigen::Vector3d& h_j) {
    Eigen::Matrix3d K = volume_mu * h_j * h_i.transpose();
    K.diagonal().array() += volume_mu * h_i.dot(h_j);
    return K;
}

/// An element's stiffness: rows and columns are its nodes' components, node by node.
template <int nodes>
using ElementMatrix = Eigen::Matrix<double, 3 * nodes, 3 * nodes>;

/// K += V G^T (A + lambda t t^T) G, the share of one quadrature point: A is the model's
/// shear_tangent, t = d theta / dF, and G takes the displacements to vec H (columns stacked), so
/// that column 3 i + a of G holds g_i in the rows of H's row a. With Q = V (A + lambda t t^T),
///     E = G^T Q, of nine columns: E_(3i+r),k = sum_a (g_i)_a Q_(3a+r),k
///     K_.,(3j+c) += sum_b (g_j)_b E_.,(3b+c)
/// H = F - I; `weight`: V, the tet's volume times the point's share, m^3; `lambda`: 0 in the mixed
/// form, else p = lambda theta, Pa.
template <class Gradients, class Matrix>
void add_stiffness_of_point(const ConstitutiveModel& model, Tangent tangent, double weight,
                            double mu, double lambda, double p, const Eigen::Matrix3d& H,
                            const Eigen::Matrix3d& R, const Gradients& g, Matrix& K) {
    constexpr int nodes = Gradients::ColsAtCompileTime;
    const Eigen::Matrix3d t = model.volume_strain_gradient(H, R);
    if (model.is_hooke_by_rotation() && tangent == Tangent::frozen_rotation) {
        const Gradients n = t * g;
        for (int j = 0; j < nodes; ++j)
            for (int i = 0; i < nodes; ++i)
                K.template block<3, 3>(3 * i, 3 * j) +=
                    shear_block(weight * mu, n.col(i), n.col(j)) +
                    (weight * lambda) * n.col(i) * n.col(j).transpose();
        return;
    }
    const Eigen::Map<const Eigen::Matrix<double, 9, 1>> of_volume(t.data());
    Matrix9 Q = weight * model.shear_tangent(mu, p, H, tangent);
    if (lambda != 0) Q += (weight * lambda) * of_volume * of_volume.transpose();
    Eigen::Matrix<double, 3 * nodes, 9> E;
    for (int k = 0; k < 9; ++k)
        Eigen::Map<Gradients>(E.col(k).data()).noalias() =
            Eigen::Map<const Eigen::Matrix3d>(Q.col(k).data()) * g;
    for (int j = 0; j < nodes; ++j)
        for (int c = 0; c < 3; ++c)
            K.col(3 * j + c) +=
                g(0, j) * E.col(c) + g(1, j) * E.col(3 + c) + g(2, j) * E.col(6 + c);
}

}  // namespace livetet
