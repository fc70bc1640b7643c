#include "mechanics/materials/holzapfel_gasser_ogden.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

#include "mechanics/materials/kinematics.hpp"
#include "mechanics/materials/neohookean.hpp"

namespace livetet {

namespace {

/// Model of the ground matrix, in which the fibres lie.
const NeoHookean& ground_matrix() {
    static const NeoHookean m;
    return m;
}

/// k1 / (2 k2) (exp(k2 E^2) - 1) and its derivatives by E; 0 where E <= 0; beyond k2 E^2 = 10 by
/// the Taylor polynomial of second order.
struct FibreEnergy {
    double value = 0, slope = 0, curvature = 0;

    FibreEnergy(double k1, double k2, double E) {
        if (!(E > 0)) return;
        const double exact = std::min(E, std::sqrt(10 / k2)), beyond = E - exact;
        const double q = k2 * exact * exact, growth = std::exp(q);
        curvature = k1 * (1 + 2 * q) * growth;
        slope = k1 * exact * growth + curvature * beyond;
        value =
            k1 / (2 * k2) * std::expm1(q) + (k1 * exact * growth + curvature * beyond / 2) * beyond;
    }
};

/// One family at one point: visit(its FibreEnergy, dE / dF, the symmetric matrix S with
/// d^2 E / dF^2 : dF = dF S).
template <class Visit>
void visit_families(const HolzapfelGasserOgden& m, const Eigen::Matrix3d& H, Visit&& visit) {
    const auto family = [&](const Eigen::Vector3d& direction) {
        const Eigen::Vector3d a = direction.normalized(), Ha = H * a;
        const double I1_3 = 2 * H.trace() + H.squaredNorm(),
                     I4_1 = 2 * a.dot(Ha) + Ha.squaredNorm(), along = 1 - 3 * m.dispersion;
        const FibreEnergy energy(m.k1_Pa, m.k2, m.dispersion * I1_3 + along * I4_1);
        if (!(energy.curvature > 0)) return;
        const Eigen::Matrix3d S =
            2 * (m.dispersion * Eigen::Matrix3d::Identity() + along * a * a.transpose());
        visit(energy, Eigen::Matrix3d(deformation_gradient(H) * S), S);
    };
    family(m.fibre_1);
    if (m.fibre_2) family(*m.fibre_2);
}

Check<Eigen::Vector3d> a_direction() {
    return {"a direction, not of length 0",
            [](const Eigen::Vector3d& a) { return a.squaredNorm() > 0; }};
}

}  // namespace

ConstitutiveModel::Names HolzapfelGasserOgden::names() const {
    return {"holzapfel_gasser_ogden", "Holzapfel-Gasser-Ogden",
            "tissue with one or two families of fibres, which carry tension only, in a neo-Hookean "
            "matrix"};
}

void HolzapfelGasserOgden::visit_keys(FieldVisitor& v) {
    v.field("k1_Pa", k1_Pa, "Pa", "stiffness of the fibres at small stretch", greater_than<0>());
    v.field("k2", k2, "", "how fast the fibres stiffen: k1 E exp(k2 E^2), E = I4 - 1",
            greater_than<0>());
    v.field("dispersion", dispersion, "",
            "kappa, of the fibres' directions: 0 all along fibre_1 (fibre_2), 1/3 isotropic",
            {"from 0 to 1/3", nullptr, {0, 1.0 / 3}});
    v.field("fibre_1", fibre_1, "", "direction of the fibres at rest, RAS, of any length",
            a_direction());
    v.field("fibre_2", fibre_2, "", "direction of a second family, as stiff", a_direction());
}

double HolzapfelGasserOgden::shear_energy(double mu, const Matrix3& H, const Matrix3& R) const {
    double energy = ground_matrix().shear_energy(mu, H, R);
    visit_families(
        *this, H, [&](const FibreEnergy& f, const Matrix3&, const Matrix3&) { energy += f.value; });
    return energy;
}

Eigen::Matrix3d HolzapfelGasserOgden::shear_stress(double mu, const Matrix3& H,
                                                   const Matrix3& R) const {
    Matrix3 P = ground_matrix().shear_stress(mu, H, R);
    visit_families(*this, H, [&](const FibreEnergy& f, const Matrix3& gradient, const Matrix3&) {
        P += f.slope * gradient;
    });
    return P;
}

Eigen::Matrix3d HolzapfelGasserOgden::shear_stress_increment(double mu, double p, const Matrix3& H,
                                                             const Matrix3& R,
                                                             const Matrix3& dF) const {
    Matrix3 dP = ground_matrix().shear_stress_increment(mu, p, H, R, dF);
    visit_families(*this, H, [&](const FibreEnergy& f, const Matrix3& gradient, const Matrix3& S) {
        dP += f.curvature * gradient.cwiseProduct(dF).sum() * gradient + f.slope * dF * S;
    });
    return dP;
}

Matrix9 HolzapfelGasserOgden::shear_tangent(double mu, double p, const Matrix3& H,
                                            Tangent tangent) const {
    Matrix9 A = ground_matrix().shear_tangent(mu, p, H, tangent);
    visit_families(*this, H, [&](const FibreEnergy& f, const Matrix3& gradient, const Matrix3& S) {
        const Eigen::Map<const Eigen::Matrix<double, 9, 1>> g(gradient.data());
        A += f.curvature * g * g.transpose();
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                A.block<3, 3>(3 * i, 3 * j).diagonal().array() += f.slope * S(i, j);
    });
    return A;
}

}  // namespace livetet
