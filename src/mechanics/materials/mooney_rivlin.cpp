#include "mechanics/materials/mooney_rivlin.hpp"

#include "mechanics/materials/isotropic_tangent.hpp"
#include "mechanics/materials/kinematics.hpp"

namespace livetet {

ConstitutiveModel::Names MooneyRivlin::names() const {
    return {"mooney_rivlin", "Mooney-Rivlin",
            "rubber, tissue: large strain, two constants, through inversion too"};
}

void MooneyRivlin::visit_keys(FieldVisitor& v) {
    v.field("c01_share", c01_share, "",
            "c01 / (c10 + c01), of energy c10 (I1 - 3) + c01 (I2 - 3) with 2 (c10 + c01) = mu; 0: "
            "neo-Hookean",
            within({0, 1}));
}

double MooneyRivlin::shear_energy(double mu, const Matrix3& H, const Matrix3&) const {
    const double c10 = mu / 2 * (1 - c01_share), c01 = mu / 2 * c01_share;
    const Matrix3 G = twice_green_strain(H);
    const double J1 = dilation_of(H), trace = H.trace(), det = H.determinant();
    // I1 - 3 - 2 (J - 1) and I2 - 3 - 4 (J - 1): the first orders cancel.
    const double minors = trace * trace - (H * H).trace();
    const double of_I1 = H.squaredNorm() - minors - 2 * det;
    const double of_I2 =
        2 * H.squaredNorm() - 2 * minors - 4 * det + (G.trace() * G.trace() - G.squaredNorm()) / 2;
    return c10 * (of_I1 + J1 * J1) + c01 * of_I2;
}

Eigen::Matrix3d MooneyRivlin::shear_stress(double mu, const Matrix3& H, const Matrix3&) const {
    const double c10 = mu / 2 * (1 - c01_share), c01 = mu / 2 * c01_share;
    const Matrix3 I = Matrix3::Identity(), F = deformation_gradient(H), G = twice_green_strain(H);
    // F - cof F; and dI2/dF = 2 (I1 F - F C) = 4 F + 2 F (tr G I - G), C = I + G.
    const Matrix3 first = H + H.transpose() - H.trace() * I - cofactor_of(H);
    return 2 * c10 * (first + dilation_of(H) * cofactor_of(F)) +
           c01 * (4 * first + 2 * F * (G.trace() * I - G));
}

Eigen::Matrix3d MooneyRivlin::shear_stress_increment(double mu, double p, const Matrix3& H,
                                                     const Matrix3&, const Matrix3& dF) const {
    const double c10 = mu / 2 * (1 - c01_share), c01 = mu / 2 * c01_share;
    const Matrix3 F = deformation_gradient(H), N = cofactor_of(F), C = F.transpose() * F,
                  FdF = F.transpose() * dF;
    return 2 * c10 * (dF + N.cwiseProduct(dF).sum() * N) +
           2 * c01 * (2 * FdF.trace() * F + C.trace() * dF - dF * C - F * (FdF + FdF.transpose())) +
           (2 * c10 * (dilation_of(H) - 1) - 4 * c01 + p) * cofactor_increment(F, dF);
}

Matrix9 MooneyRivlin::shear_tangent(double mu, double p, const Matrix3& H, Tangent tangent) const {
    const double c10 = mu / 2 * (1 - c01_share), c01 = mu / 2 * c01_share;
    const SignedSvd svd = signed_svd(deformation_gradient(H));
    const Eigen::Vector3d& s = svd.sigma;
    const double factor = 2 * c10 * (s.prod() - 2) - 4 * c01 + p;  // of d^2 J / ds^2
    const Eigen::Vector3d c(s[1] * s[2], s[2] * s[0], s[0] * s[1]);
    PrincipalModes m;
    m.stretch = 2 * c10 * (Matrix3::Identity() + c * c.transpose());
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        m.stretch(k, k) += 2 * c01 * (s[i] * s[i] + s[j] * s[j]);
        m.stretch(i, j) += 4 * c01 * s[i] * s[j] + factor * s[k];
        m.stretch(j, i) += 4 * c01 * s[i] * s[j] + factor * s[k];
        m.flip[k] = 2 * c10 + 2 * c01 * (s[k] * s[k] - s[i] * s[j]) - factor * s[k];
        m.twist[k] = 2 * c10 + 2 * c01 * (s[k] * s[k] + s[i] * s[j]) + factor * s[k];
    }
    return isotropic_tangent(svd, m, tangent);
}

}  // namespace livetet
