#include "solvers/assembly/pointwise_law.hpp"

#include <Eigen/Dense>

#include "mechanics/hex_kernels.hpp"
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

/// visit(lane, e, moduli, element) for the elements e in the lanes of batch k.
template <int nodes, class Visit>
void visit_lanes(const PointwiseModels& models, const TetBatches<float, nodes>& batches,
                 std::size_t k, Visit&& visit) {
    for (int lane = 0; lane < batch_width<float>; ++lane)
        if (const std::int32_t tet = batches.tet_at(k, lane); tet >= 0) {
            const PointwiseModels::Moduli& m = models.of(tet);
            visit(lane, tet, m, element_at(batches[k], lane, m.mu));
        }
}

template <int nodes>
void add_nodal(const TetBatch<float, nodes>& b, int lane, const Nodal<nodes>& forces,
               std::span<float> f) {
    for (int i = 0; i < nodes; ++i)
        for (int a = 0; a < 3; ++a) f[b.offset[i][lane] + a] += static_cast<float>(forces(a, i));
}

/// A hexahedron's one pressure is that of all four corners of its corner tet.
template <int nodes>
Eigen::Vector4d pressures_at(const TetBatch<float, nodes>& b, int lane, std::int32_t e,
                             std::span<const float> p) {
    Eigen::Vector4d values = Eigen::Vector4d::Zero();
    if (p.empty()) return values;
    if constexpr (nodes == 8) return Eigen::Vector4d::Constant(p[e]);
    for (int i = 0; i < 4; ++i) values[i] = p[b.offset[i][lane] / 3];
    return values;
}

template <int nodes>
void add_volumes(const TetBatch<float, nodes>& b, int lane, std::int32_t e,
                 const Eigen::Vector4d& volumes, std::span<float> g) {
    if constexpr (nodes == 8) {
        g[e] += static_cast<float>(volumes.sum());
        return;
    }
    for (int i = 0; i < 4; ++i) g[b.offset[i][lane] / 3] += static_cast<float>(volumes[i]);
}

Eigen::Matrix3d rotation_in(const ConstitutiveModel& model, const Eigen::Matrix3d& H) {
    return model.kinematics() == Kinematics::corotated ? rotation_of(deformation_gradient(H))
                                                       : Eigen::Matrix3d::Identity();
}

}  // namespace

template <int nodes, class Stress>
void PointwiseLaw::add(const TetBatches<float, nodes>& batches, BatchRange range,
                       std::span<const float> u, std::span<float> f, Stress&& stress) const {
    using Shape = ElementShape<nodes>;
    for (std::size_t k = range.begin; k < range.end; ++k)
        visit_lanes(models_, batches, k,
                    [&](int lane, std::int32_t, const PointwiseModels::Moduli& m,
                        const TetElement& element) {
                        const auto& b = batches[k];
                        const Nodal<nodes> values = values_at(b, lane, u);
                        Nodal<nodes> forces = Nodal<nodes>::Zero();
                        for (int point = 0; point < Shape::points; ++point) {
                            const auto g = Shape::gradients(element, point);
                            const Eigen::Matrix3d H = values * g.transpose();
                            forces += element.volume / Shape::points * stress(m, H, g, b, lane) * g;
                        }
                        add_nodal(b, lane, forces, f);
                    });
}

template <int nodes>
void PointwiseLaw::add_products(float factor, const TetBatches<float, nodes>& batches,
                                BatchRange range, std::span<const float> u,
                                std::span<const float> v, std::span<float> f) const {
    add(batches, range, u, f,
        [&](const PointwiseModels::Moduli& m, const Eigen::Matrix3d& H, const auto& g,
            const auto& b, int lane) -> Eigen::Matrix3d {
            return factor * m.model->bounded_increment(m.lambda, m.mu, H, rotation_in(*m.model, H),
                                                       values_at(b, lane, v) * g.transpose());
        });
}

namespace {

/// First Piola-Kirchhoff stress, Pa.
const auto stress_of = [](const PointwiseModels::Moduli& m, const Eigen::Matrix3d& H, const auto&,
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

void PointwiseLaw::add_forces(const TetBatches<float, 8>& batches, BatchRange range, Rotations,
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

void PointwiseLaw::add_stiffness_times(float factor, const TetBatches<float, 8>& batches,
                                       BatchRange range, Rotations, std::span<const float> u,
                                       std::span<const float> v, std::span<float> f) const {
    add_products(factor, batches, range, u, v, f);
}

namespace {

/// What the nodes and pressures of a tet get.
template <int nodes>
struct MixedSums {
    Nodal<nodes> f = Nodal<nodes>::Zero();
    Eigen::Vector4d g = Eigen::Vector4d::Zero();
};

/// An element in a lane of a batch.
template <int nodes>
struct InLane {
    const TetBatch<float, nodes>& batch;
    int lane;
    std::int32_t element;
    const PointwiseModels::Moduli& moduli;

    Nodal<nodes> values(std::span<const float> of) const { return values_at(batch, lane, of); }
    Eigen::Vector4d pressures(std::span<const float> p) const {
        return pressures_at(batch, lane, element, p);
    }
};

/// work(in lane, volume of the point, gradients, L, H = F - I, R, sums) at each point.
template <int nodes, class Work>
void visit_mixed_points(const PointwiseModels& models, const MixedTets<nodes>& tets,
                        std::span<const float> u, const MixedForces& to, Work&& work) {
    using Shape = ElementShape<nodes>;
    for (std::size_t k = tets.range.begin; k < tets.range.end; ++k)
        visit_lanes(models, tets.batches, k,
                    [&](int lane, std::int32_t e, const PointwiseModels::Moduli& m,
                        const TetElement& element) {
                        const InLane<nodes> in{tets.batches[k], lane, e, m};
                        const Nodal<nodes> values = in.values(u);
                        MixedSums<nodes> sums;
                        for (int point = 0; point < Shape::points; ++point) {
                            const auto g = Shape::gradients(element, point);
                            const Eigen::Matrix3d H = values * g.transpose();
                            work(in, element.volume / Shape::points, g,
                                 Eigen::Vector4d(Shape::coordinates(point)), H,
                                 rotation_in(*m.model, H), sums);
                        }
                        add_nodal(in.batch, lane, sums.f, to.f);
                        if (!to.g.empty()) add_volumes(in.batch, lane, e, sums.g, to.g);
                    });
}

template <int nodes>
void add_mixed_forces(const PointwiseModels& models, const MixedTets<nodes>& tets,
                      const MixedValues& at, const MixedForces& to) {
    visit_mixed_points(
        models, tets, at.u, to,
        [&](const InLane<nodes>& in, double weight, const auto& g, const Eigen::Vector4d& L,
            const Eigen::Matrix3d& H, const Eigen::Matrix3d& R, MixedSums<nodes>& sums) {
            const PointwiseModels::Moduli& m = in.moduli;
            const double p = L.dot(in.pressures(at.p));
            sums.f += weight * m.model->stress(m.mu, p, H, R) * g;
            sums.g += weight * m.model->volume_strain(H, R) * L;
        });
}

template <int nodes>
void add_mixed_products(const PointwiseModels& models, const MixedTets<nodes>& tets, double factor,
                        const MixedValues& at, const MixedValues& v, const MixedForces& to) {
    visit_mixed_points(
        models, tets, at.u, to,
        [&](const InLane<nodes>& in, double weight, const auto& g, const Eigen::Vector4d& L,
            const Eigen::Matrix3d& H, const Eigen::Matrix3d& R, MixedSums<nodes>& sums) {
            const PointwiseModels::Moduli& m = in.moduli;
            const double p = L.dot(in.pressures(at.p)), dp = L.dot(in.pressures(v.p));
            const Eigen::Matrix3d dF = in.values(v.u) * g.transpose(),
                                  N = m.model->volume_strain_gradient(H, R);
            sums.f +=
                weight * (factor * m.model->shear_stress_increment(m.mu, p, H, R, dF) + dp * N) * g;
            sums.g += weight * N.cwiseProduct(dF).sum() * L;
        });
}

template <int nodes>
void add_mixed_pressure_forces(const PointwiseModels& models, const MixedTets<nodes>& tets,
                               const MixedValues& at, std::span<const float> q,
                               std::span<float> f) {
    visit_mixed_points(
        models, tets, at.u, {f, {}},
        [&](const InLane<nodes>& in, double weight, const auto& g, const Eigen::Vector4d& L,
            const Eigen::Matrix3d& H, const Eigen::Matrix3d& R, MixedSums<nodes>& sums) {
            const double p = L.dot(in.pressures(q));
            sums.f += weight * p * in.moduli.model->volume_strain_gradient(H, R) * g;
        });
}

}  // namespace

void PointwiseMixedLaw::add_forces(const MixedTets<4>& tets, const MixedValues& at,
                                   const MixedForces& to) const {
    add_mixed_forces(models_, tets, at, to);
}

void PointwiseMixedLaw::add_forces(const MixedTets<10>& tets, const MixedValues& at,
                                   const MixedForces& to) const {
    add_mixed_forces(models_, tets, at, to);
}

void PointwiseMixedLaw::add_forces(const MixedTets<8>& cells, const MixedValues& at,
                                   const MixedForces& to) const {
    add_mixed_forces(models_, cells, at, to);
}

void PointwiseMixedLaw::add_products(const MixedTets<4>& tets, float factor, const MixedValues& at,
                                     const MixedValues& v, const MixedForces& to) const {
    add_mixed_products(models_, tets, factor, at, v, to);
}

void PointwiseMixedLaw::add_products(const MixedTets<10>& tets, float factor, const MixedValues& at,
                                     const MixedValues& v, const MixedForces& to) const {
    add_mixed_products(models_, tets, factor, at, v, to);
}

void PointwiseMixedLaw::add_products(const MixedTets<8>& cells, float factor, const MixedValues& at,
                                     const MixedValues& v, const MixedForces& to) const {
    add_mixed_products(models_, cells, factor, at, v, to);
}

void PointwiseMixedLaw::add_pressure_forces(const MixedTets<4>& tets, const MixedValues& at,
                                            std::span<const float> q, std::span<float> f) const {
    add_mixed_pressure_forces(models_, tets, at, q, f);
}

void PointwiseMixedLaw::add_pressure_forces(const MixedTets<10>& tets, const MixedValues& at,
                                            std::span<const float> q, std::span<float> f) const {
    add_mixed_pressure_forces(models_, tets, at, q, f);
}

void PointwiseMixedLaw::add_pressure_forces(const MixedTets<8>& cells, const MixedValues& at,
                                            std::span<const float> q, std::span<float> f) const {
    add_mixed_pressure_forces(models_, cells, at, q, f);
}

}  // namespace livetet
