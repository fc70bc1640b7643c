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

/// The blocks of one quadrature point, visited as visit(i, j, K_ij):
///     K_ij = V (G_i : A : G_j) + V lambda n_i n_j^T,  (G_i)_abc = delta_ab (g_i)_c,
/// with A the model's shear_tangent and n_i = (d theta / dF) g_i. H = F - I; `weight`: V, the tet's
/// volume times the point's share, m^3; `lambda`: 0 in the mixed form, else p = lambda theta, Pa.
template <class Gradients, class Visit>
void visit_stiffness(const ConstitutiveModel& model, Tangent tangent, double weight, double mu,
                     double lambda, double p, const Eigen::Matrix3d& H, const Eigen::Matrix3d& R,
                     const Gradients& g, Visit&& visit) {
    constexpr int nodes = Gradients::ColsAtCompileTime;
    const Gradients n = model.volume_strain_gradient(H, R) * g;
    if (model.is_hooke_by_rotation() && tangent == Tangent::frozen_rotation) {
        for (int i = 0; i < nodes; ++i)
            for (int j = 0; j < nodes; ++j)
                visit(i, j,
                      shear_block(weight * mu, n.col(i), n.col(j)) +
                          (weight * lambda) * n.col(i) * n.col(j).transpose());
        return;
    }
    const Matrix9 A = model.shear_tangent(mu, p, H, tangent);
    for (int j = 0; j < nodes; ++j) {
        const Eigen::Matrix<double, 9, 3> column =
            weight * (g(0, j) * A.template leftCols<3>() + g(1, j) * A.template middleCols<3>(3) +
                      g(2, j) * A.template rightCols<3>());
        for (int i = 0; i < nodes; ++i) {
            Eigen::Matrix3d K = g(0, i) * column.topRows<3>() + g(1, i) * column.middleRows<3>(3) +
                                g(2, i) * column.bottomRows<3>();
            K += (weight * lambda) * n.col(i) * n.col(j).transpose();
            visit(i, j, K);
        }
    }
}

}  // namespace livetet
