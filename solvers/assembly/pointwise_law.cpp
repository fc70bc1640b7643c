#include "solvers/assembly/pointwise_law.hpp"

#include <Eigen/Dense>

#include "mechanics/materials/kinematics.hpp"
#include "mechanics/rotation.hpp"
#include "mechanics/tet_kernels.hpp"

namespace livetet {

namespace {

template <int nodes>
using Nodal = Eigen::Matrix<double, 3, nodes>;

/// Gradients of a lane, and its volume: that of V mu, which the batch holds.
template <int nodes>
TetElement element_at(const TetBatch<float, nodes>& b, int lane, double mu) {
    TetElement e;
    for (int m = 0; m < 9; ++m) e.gradients(m % 3, 1 + m / 3) = b.gradients[m][lane];
    e.gradients.col(0) = -e.gradients.rightCols<3>().rowwise().sum();
    e.volume = b.mu[lane] / mu;
    return e;
}

template <int nodes>
Nodal<nodes> values_at(const TetBatch<float, nodes>& b, int lane, std::span<const float> values) {
    Nodal<nodes> u;
    for (int i = 0; i < nodes; ++i)
        for (int a = 0; a < 3; ++a) u(a, i) = values[b.offset[i][lane] + a];
    return u;
}

Eigen::Matrix3d rotation_in(const ConstitutiveModel& model, const Eigen::Matrix3d& H) {
    return model.kinematics() == Kinematics::corotated ? rotation_of(deformation_gradient(H))
                                                       : Eigen::Matrix3d::Identity();
}

}  // namespace

template <int nodes, class Stress>
void PointwiseLaw::add(const TetBatches<float, nodes>& batches, BatchRange range,
                       std::span<const float> u, std::span<float> f, Stress&& stress) const {
    using Shape = TetShape<nodes>;
    for (std::size_t k = range.begin; k < range.end; ++k) {
        const auto& b = batches[k];
        for (int l = 0; l < batch_width<float>; ++l) {
            const std::int32_t tet = batches.tet_at(k, l);
            if (tet < 0) continue;
            const TetElement element = element_at(b, l, moduli_of(tet).mu);
            const Nodal<nodes> values = values_at(b, l, u);
            Nodal<nodes> forces = Nodal<nodes>::Zero();
            for (int point = 0; point < Shape::points; ++point) {
                const auto g = Shape::gradients(element, point);
                const Eigen::Matrix3d H = values * g.transpose();
                forces += element.volume / Shape::points * stress(moduli_of(tet), H, g, b, l) * g;
            }
            for (int i = 0; i < nodes; ++i)
                for (int a = 0; a < 3; ++a)
                    f[b.offset[i][l] + a] += static_cast<float>(forces(a, i));
        }
    }
}

template <int nodes>
void PointwiseLaw::add_products(float factor, const TetBatches<float, nodes>& batches,
                                BatchRange range, std::span<const float> u,
                                std::span<const float> v, std::span<float> f) const {
    add(batches, range, u, f,
        [&](const Moduli& m, const Eigen::Matrix3d& H, const auto& g, const auto& b,
            int lane) -> Eigen::Matrix3d {
            const Eigen::Matrix3d R = rotation_in(*m.model, H),
                                  N = m.model->volume_strain_gradient(H, R),
                                  dF = values_at(b, lane, v) * g.transpose();
            const double p = m.lambda * m.model->volume_strain(H, R);
            return factor * (m.model->shear_stress_increment(m.mu, p, H, R, dF) +
                             m.lambda * N.cwiseProduct(dF).sum() * N);
        });
}

namespace {

/// First Piola-Kirchhoff stress, Pa.
const auto stress_of = [](const PointwiseLaw::Moduli& m, const Eigen::Matrix3d& H, const auto&,
                          const auto&, int) -> Eigen::Matrix3d {
    const Eigen::Matrix3d R = rotation_in(*m.model, H);
    return m.model->stress(m.mu, m.lambda * m.model->volume_strain(H, R), H, R);
};

}  // namespace

void PointwiseLaw::add_forces(const TetBatches<float>& batches, BatchRange range, Rotations,
                              std::span<const float> u, std::span<float> f) const {
    add(batches, range, u, f, stress_of);
}

void PointwiseLaw::add_forces(const TetBatches<float, 10>& batches, BatchRange range, Rotations,
                              std::span<const float> u, std::span<float> f) const {
    add(batches, range, u, f, stress_of);
}

void PointwiseLaw::add_stiffness_times(float factor, const TetBatches<float>& batches,
                                       BatchRange range, Rotations, std::span<const float> u,
                                       std::span<const float> v, std::span<float> f) const {
    add_products(factor, batches, range, u, v, f);
}

void PointwiseLaw::add_stiffness_times(float factor, const TetBatches<float, 10>& batches,
                                       BatchRange range, Rotations, std::span<const float> u,
                                       std::span<const float> v, std::span<float> f) const {
    add_products(factor, batches, range, u, v, f);
}

}  // namespace livetet
