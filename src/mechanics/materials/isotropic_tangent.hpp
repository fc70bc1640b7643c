#pragma once

#include "mechanics/materials/constitutive_model.hpp"
#include "mechanics/rotation.hpp"

namespace livetet {

/// Second derivatives of an isotropic energy psi by the signed singular values s of F:
///     stretch(i, j) = psi_ij,
/// and for the pair of axes i, j other than k the eigenvalues of the symmetric and of the
/// antisymmetric mode,
///     flip[k]  = (psi_i - psi_j) / (s_i - s_j),
///     twist[k] = (psi_i + psi_j) / (s_i + s_j).
/// Source: Smith, de Goes and Kim (2019), "Analytic eigensystems for isotropic distortion
/// energies".
struct PrincipalModes {
    Eigen::Matrix3d stretch;
    Eigen::Vector3d flip, twist;
};

/// d^2 psi / dF^2 as a matrix on vec F (columns stacked); `positive` and `frozen_rotation` set
/// negative eigenvalues to zero.
Matrix9 isotropic_tangent(const SignedSvd& svd, PrincipalModes modes, Tangent tangent);

}  // namespace livetet
