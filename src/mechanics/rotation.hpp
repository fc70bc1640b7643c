#pragma once

#include <Eigen/Core>

namespace livetet {

/// The rotation R that maximises tr(R^T F), for any F: the polar factor where det F > 0, and its
/// continuous extension through flat and inverted elements (R = U diag(1, 1, det(U V^T)) V^T with
/// the singular values in falling order). Never a reflection. F with no information at all (zero,
/// not finite) gives the identity.
///
/// Where det F is well above zero, Newton's iteration R <- (R + R^-T) / 2 is used (Higham 1986),
/// which would run into a reflection elsewhere; there, a singular value decomposition.
Eigen::Matrix3d rotation_of(const Eigen::Matrix3d& F);

/// F = U diag(sigma) V^T with rotations U and V: |sigma| falls, and only the last may be negative
/// (where det F is). Source: Irving, Teran and Fedkiw (2004). Precondition: F is finite.
struct SignedSvd {
    Eigen::Matrix3d U, V;
    Eigen::Vector3d sigma;
};
SignedSvd signed_svd(const Eigen::Matrix3d& F);

}  // namespace livetet
