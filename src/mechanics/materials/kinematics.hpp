#pragma once

#include <Eigen/Geometry>

// Measures of deformation of a gradient H = F - I of the displacement. Each is made of H, so that
// small strains keep their digits: a measure made of F alone has an error of round-off times one.

namespace livetet {

/// F = I + H.
inline Eigen::Matrix3d deformation_gradient(const Eigen::Matrix3d& H) {
    return Eigen::Matrix3d::Identity() + H;
}

/// cof F = dJ / dF, J = det F; defined for singular F too.
inline Eigen::Matrix3d cofactor_of(const Eigen::Matrix3d& F) {
    Eigen::Matrix3d c;
    c << F.col(1).cross(F.col(2)), F.col(2).cross(F.col(0)), F.col(0).cross(F.col(1));
    return c;
}

/// The derivative of cof F in the direction dF.
inline Eigen::Matrix3d cofactor_increment(const Eigen::Matrix3d& F, const Eigen::Matrix3d& dF) {
    Eigen::Matrix3d increment;
    for (int c = 0; c < 3; ++c) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        increment.col(c) = F.col(d).cross(dF.col(e)) + dF.col(d).cross(F.col(e));
    }
    return increment;
}

/// J - 1 = det(I + H) - 1.
inline double dilation_of(const Eigen::Matrix3d& H) {
    return H.trace() + 0.5 * (H.trace() * H.trace() - (H * H).trace()) + H.determinant();
}

/// 2 E = F^T F - I, twice Green's strain.
inline Eigen::Matrix3d twice_green_strain(const Eigen::Matrix3d& H) {
    return H + H.transpose() + H.transpose() * H;
}

}  // namespace livetet
