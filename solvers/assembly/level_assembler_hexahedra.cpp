// Products of LevelAssembler's tangent on hexahedra, which have no matrix.

#include <algorithm>

#include "solvers/assembly/grid_damping.hpp"
#include "solvers/assembly/level_assembler_points.hpp"

namespace livetet {

namespace {

using Hex = ElementShape<8>;

/// (d^2 psi_mu / dF^2 + p d^2 theta / dF^2) : dF of that tangent, Pa.
Eigen::Matrix3d shear_product(const ConstitutiveModel& model, Tangent tangent, double mu, double p,
                              const Eigen::Matrix3d& H, const Eigen::Matrix3d& R,
                              const Eigen::Matrix3d& dF) {
    if (tangent == Tangent::positive && !model.is_hooke_by_rotation()) {
        const Matrix9 A = model.shear_tangent(mu, p, H, tangent);
        const Eigen::Matrix<double, 9, 1> product =
            A * Eigen::Map<const Eigen::Matrix<double, 9, 1>>(dF.data());
        return Eigen::Map<const Eigen::Matrix3d>(product.data());
    }
    Eigen::Matrix3d dP = model.shear_stress_increment(mu, p, H, R, dF);
    if (tangent == Tangent::exact) dP += model.turn_increment(mu, p, H, R, dF);
    return dP;
}

}  // namespace

// f_c += V / 8 sum over points (dP + lambda dtheta N) g_c, with dtheta = N : dF of the point, or
// its mean over the cell.
void LevelAssembler::add_hexahedra_times(double factor, Tangent tangent, const Configuration& at,
                                         std::span<const double> v, std::span<double> f) const {
    const LocalValues displacement(at.u);
    std::optional<ReadArray> pressures;
    if (has_mean_dilation_ && at.p) pressures.emplace(at.p);
    for (std::size_t e = 0; e < share_.hexahedra.size(); ++e) {
        const TetElement element = this->element(e);
        const ConstitutiveModel& model = *moduli(e).model;
        const Nodal<8> values = values_at<8>(e, displacement.data()),
                       direction = values_at<8>(e, v.data());
        const bool is_linear = model.kinematics() == Kinematics::small_strain;
        const double of_cell = !has_mean_dilation_ || is_linear ? 0
                               : pressures                      ? (*pressures)[e]
                                           : mean_pressure<Hex>(at, e, element, values);
        Eigen::Matrix3d N[Hex::points], dP[Hex::points];
        double dtheta[Hex::points], mean = 0;
        for (int point = 0; point < Hex::points; ++point) {
            const auto g = Hex::gradients(element, point);
            const Eigen::Matrix3d H = values * g.transpose(), dF = direction * g.transpose();
            const Eigen::Matrix3d R = rotation(at, e, point, Hex::points, H);
            const double p = is_linear            ? 0
                             : has_mean_dilation_ ? of_cell
                                                  : element.lambda * model.volume_strain(H, R);
            dP[point] = shear_product(model, tangent, element.mu, p, H, R, dF);
            N[point] = model.volume_strain_gradient(H, R);
            dtheta[point] = N[point].cwiseProduct(dF).sum();
            mean += dtheta[point] / Hex::points;
        }
        Nodal<8> forces = Nodal<8>::Zero();
        for (int point = 0; point < Hex::points; ++point)
            forces.noalias() +=
                (dP[point] +
                 (element.lambda * (has_mean_dilation_ ? mean : dtheta[point])) * N[point]) *
                Hex::gradients(element, point);
        forces *= factor * element.volume / Hex::points;
        for (int c = 0; c < 8; ++c)
            Eigen::Map<Eigen::Vector3d>(f.data() + 3 * share_.hexahedra[e][c]) += forces.col(c);
    }
}

PetscHandle<Vec> LevelAssembler::make_cell_vector() const {
    PetscHandle<Vec> v;
    LIVETET_PETSC(
        VecCreateSeq(PETSC_COMM_SELF, static_cast<PetscInt>(share_.hexahedra.size()), v.out()));
    return v;
}

void LevelAssembler::find_cell_pressures(const Configuration& at, Vec v, Vec p) const {
    const LocalValues u(at.u);
    std::optional<LocalValues> direction;
    if (v) direction.emplace(v);
    WriteArray to(p);
    for (std::size_t e = 0; e < share_.hexahedra.size(); ++e) {
        const TetElement element = this->element(e);
        const Nodal<8> values = values_at<8>(e, u.data());
        to[e] = mean_pressure<Hex>(at, e, element, values);
        if (v)
            to[e] += element.lambda * cell_dilation(at, e, element, values)
                                          .cwiseProduct(values_at<8>(e, direction->data()))
                                          .sum();
    }
}

CellDilation LevelAssembler::cell_dilation(const Configuration& at, std::size_t e,
                                           const TetElement& element,
                                           const Nodal<8>& values) const {
    CellDilation mean = CellDilation::Zero();
    for (int point = 0; point < Hex::points; ++point) {
        const auto g = Hex::gradients(element, point);
        const Eigen::Matrix3d H = values * g.transpose();
        const Eigen::Matrix3d R = rotation(at, e, point, Hex::points, H);
        mean += moduli(e).model->volume_strain_gradient(H, R) * g / Hex::points;
    }
    return mean;
}

std::vector<CellDilation> LevelAssembler::cell_dilations(const Configuration& at) const {
    const LocalValues u(at.u);
    std::vector<CellDilation> dilations;
    dilations.reserve(share_.hexahedra.size());
    for (std::size_t e = 0; e < share_.hexahedra.size(); ++e)
        dilations.push_back(cell_dilation(at, e, element(e), values_at<8>(e, u.data())));
    return dilations;
}

// Matrices, since the positive part of a tangent takes far longer than a product, of which a step
// makes many.
void LevelAssembler::keep_grid_damping(const Configuration& at) {
    damping_of_cells_.resize(share_.hexahedra.size());
    const auto dilations = has_mean_dilation_ ? cell_dilations(at) : std::vector<CellDilation>{};
    ElementMatrix<8> K;
    visit_points(at, [&]<int nodes>(const ConstitutiveModel& model, std::size_t e,
                                    const TetElement& element, int number,
                                    const ElementPoint<nodes>& point, const Eigen::Matrix3d& H,
                                    const Eigen::Matrix3d& R, double p) {
        if constexpr (nodes == 8) {
            if (number == 0) K.setZero();
            add_stiffness_of_point(model, Tangent::frozen_rotation, point.weight, element.mu,
                                   has_mean_dilation_ ? 0 : element.lambda, p, H, R,
                                   point.gradients, K);
            if (number + 1 < Hex::points) return;
            if (has_mean_dilation_) {
                const Eigen::Map<const Eigen::Vector<double, 24>> d(dilations[e].data());
                K += element.volume * damped_lambda(element.lambda, element.mu) * d * d.transpose();
            }
            damping_of_cells_[e] = K.cast<float>();
        }
    });
}

// The matrices are rounded to single precision, the product is not: a force that is linear in the
// velocity to the last digit lets Newton's method converge. Rounded rows do not add up to zero;
// less their means, velocities of translations make no force, and forces of a cell add up to zero.
void LevelAssembler::add_grid_damping_times(double factor, std::span<const double> v,
                                            std::span<double> f) const {
    using Vector24 = Eigen::Vector<double, 24>;
    for (std::size_t e = 0; e < share_.hexahedra.size(); ++e) {
        Nodal<8> values = values_at<8>(e, v.data()), forces;
        values.colwise() -= Eigen::Vector3d(values.rowwise().mean());
        Eigen::Map<Vector24>(forces.data()).noalias() =
            damping_of_cells_[e].cast<double>() * Eigen::Map<const Vector24>(values.data());
        forces.colwise() -= Eigen::Vector3d(forces.rowwise().mean());
        for (int c = 0; c < 8; ++c)
            Eigen::Map<Eigen::Vector3d>(f.data() + 3 * share_.hexahedra[e][c]) +=
                factor * forces.col(c);
    }
}

std::vector<Eigen::Matrix3d> LevelAssembler::cell_rotations(Vec u) const {
    const LocalValues values(u);
    std::vector<Eigen::Matrix3d> rotations;
    rotations.reserve(share_.hexahedra.size());
    const Hex::Gradients middle = Hex::local_gradients(Eigen::Vector3d::Constant(0.5));
    for (std::size_t e = 0; e < share_.hexahedra.size(); ++e) {
        const Hex::Gradients g = element(e).gradients.rightCols<3>() * middle;
        rotations.push_back(rotation_of(Eigen::Matrix3d::Identity() +
                                        values_at<8>(e, values.data()) * g.transpose()));
    }
    return rotations;
}

}  // namespace livetet
