#include "apps/verification/reference_models.hpp"

#include <Eigen/Dense>

#include <cmath>

namespace livetet::verification {
namespace {

const Matrix3d identity = Matrix3d::Identity();

/// The rotation R that is nearest to F: of F = U S V^T, R = U diag(1, 1, det(U V^T)) V^T.
Matrix3d nearest_rotation(const Matrix3d& F) {
    const Eigen::JacobiSVD<Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    return svd.matrixU() * Vector3(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
}

/// dJ/dF, J = det F: the columns are the cross products of the other two columns.
Matrix3d cofactor(const Matrix3d& F) {
    Matrix3d C;
    C << F.col(1).cross(F.col(2)), F.col(2).cross(F.col(0)), F.col(0).cross(F.col(1));
    return C;
}

Matrix3d hooke(const Isotropic& m, const Matrix3d& strain) {
    return 2 * m.mu() * strain + m.lambda() * strain.trace() * identity;
}

double hooke_energy(const Isotropic& m, const Matrix3d& strain) {
    return m.mu() * strain.squaredNorm() + m.lambda() / 2 * std::pow(strain.trace(), 2);
}

Matrix3d small_strain(const Matrix3d& F) { return (F + F.transpose()) / 2 - identity; }
Matrix3d green_strain(const Matrix3d& F) { return (F.transpose() * F - identity) / 2; }

}  // namespace

double energy_density(ReferenceModel model, const Isotropic& m, const Matrix3d& F) {
    switch (model) {
        case ReferenceModel::linear:
            return hooke_energy(m, small_strain(F));
        case ReferenceModel::corotated:
            return hooke_energy(m, nearest_rotation(F).transpose() * F - identity);
        case ReferenceModel::green:
            return hooke_energy(m, green_strain(F));
        case ReferenceModel::neohookean:
            break;
    }
    const double growth = F.determinant() - 1;
    return m.mu() / 2 * (F.squaredNorm() - 3) - m.mu() * growth +
           (m.lambda() + m.mu()) / 2 * growth * growth;
}

Matrix3d first_piola(ReferenceModel model, const Isotropic& m, const Matrix3d& F) {
    switch (model) {
        case ReferenceModel::linear:
            return hooke(m, small_strain(F));
        case ReferenceModel::corotated: {
            const Matrix3d R = nearest_rotation(F);
            return R * hooke(m, R.transpose() * F - identity);
        }
        case ReferenceModel::green:
            return F * hooke(m, green_strain(F));
        case ReferenceModel::neohookean:
            break;
    }
    return m.mu() * F + ((m.lambda() + m.mu()) * (F.determinant() - 1) - m.mu()) * cofactor(F);
}

std::optional<Uniaxial> uniaxial(ReferenceModel model, const Isotropic& m, double l) {
    double P11 = m.E * (l - 1), lateral = 1 - m.nu * (l - 1);
    if (model == ReferenceModel::green) {
        P11 = m.E * (l * l * l - l) / 2;
        lateral = std::sqrt(1 - m.nu * (l * l - 1));
    } else if (model == ReferenceModel::neohookean) {
        const double square = (l + (1 - 2 * m.nu) * (l - 1)) / (l * l);
        lateral = std::sqrt(square);
        P11 = m.mu() * l + ((m.lambda() + m.mu()) * (l * square - 1) - m.mu()) * square;
    }
    if (!(lateral > 0)) return std::nullopt;
    return Uniaxial{P11, lateral};
}

Matrix3d simple_shear(ReferenceModel model, const Isotropic& m, double g) {
    Matrix3d F = identity;
    F(0, 1) = g;
    if (model == ReferenceModel::corotated) {
        const double h = std::sqrt(4 + g * g);
        Matrix3d R;
        R << 2 / h, g / h, 0, -g / h, 2 / h, 0, 0, 0, 1;
        return 2 * m.mu() * (F - R) + m.lambda() * (h - 2) * R;
    }
    if (model == ReferenceModel::green) {
        Matrix3d E = Matrix3d::Zero();
        E(0, 1) = E(1, 0) = g / 2;
        E(1, 1) = g * g / 2;
        return F * hooke(m, E);
    }
    Matrix3d P = Matrix3d::Zero();
    P(0, 1) = P(1, 0) = m.mu() * g;
    return P;
}

Vector3 ManufacturedField::displacement(const Vector3& x) const {
    return amplitude * (waves * x + phases).array().sin();
}

Matrix3d ManufacturedField::gradient(const Vector3& x) const {
    const Vector3 slopes = amplitude * (waves * x + phases).array().cos();
    return slopes.asDiagonal() * waves;
}

Vector3 ManufacturedField::linear_body_force(const Isotropic& m, const Vector3& x) const {
    // d_j d_k u_i = -k_ij k_ik u_i: lap u_i = -|k_i|^2 u_i, (grad div u)_j = -sum_i k_ii k_ij u_i
    const Vector3 u = displacement(x);
    return (m.lambda() + m.mu()) * waves.transpose() * waves.diagonal().cwiseProduct(u) +
           m.mu() * waves.rowwise().squaredNorm().cwiseProduct(u);
}

Vector3 ManufacturedField::body_force(const std::function<Matrix3d(const Matrix3d&)>& P,
                                      const Vector3& x) const {
    constexpr double step = 0.02;
    constexpr double weights[] = {4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
    const auto stress = [&](const Vector3& at) { return P(identity + gradient(at)); };
    Vector3 force = Vector3::Zero();
    for (int j = 0; j < 3; ++j)
        for (int n = 1; n <= 4; ++n) {
            const Vector3 way = n * step * Vector3::Unit(j);
            force -= weights[n - 1] / step * (stress(x + way) - stress(x - way)).col(j);
        }
    return force;
}

}  // namespace livetet::verification
