#include "mechanics/rotation.hpp"

#include <Eigen/Dense>

#include "geometry/transform.hpp"

namespace livetet {

namespace {

/// The cofactor matrix: det(m) m^-T, defined for singular m too.
Eigen::Matrix3d cofactor(const Eigen::Matrix3d& m) {
    Eigen::Matrix3d c;
    c.col(0) = m.col(1).cross(m.col(2));
    c.col(1) = m.col(2).cross(m.col(0));
    c.col(2) = m.col(0).cross(m.col(1));
    return c;
}

}  // namespace

Eigen::Matrix3d rotation_of(const Eigen::Matrix3d& F) {
    const double squared_norm = F.squaredNorm();
    if (!(squared_norm > 1e-60) || !std::isfinite(squared_norm)) return Eigen::Matrix3d::Identity();
    // Scaled to |F|^2 = 3, the norm of a rotation, so that the threshold means the same at any
    // size.
    Eigen::Matrix3d R = F * std::sqrt(3 / squared_norm);
    if (R.determinant() < 0.1) return nearest_rotation(F);
    for (int iteration = 0; iteration < 12; ++iteration) {
        const Eigen::Matrix3d c = cofactor(R);
        const double det = R.col(0).dot(c.col(0));
        const Eigen::Matrix3d next = 0.5 * (R + c / det);
        const double change = (next - R).squaredNorm();
        R = next;
        if (change < 1e-16) break;  // quadratic: the next step would change R by about 1e-16
    }
    return R;
}

SignedSvd signed_svd(const Eigen::Matrix3d& F) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
    SignedSvd s{svd.matrixU(), svd.matrixV(), svd.singularValues()};
    for (Eigen::Matrix3d* turn : {&s.U, &s.V})
        if (turn->determinant() < 0) {
            turn->col(2) *= -1;
            s.sigma[2] *= -1;
        }
    return s;
}

}  // namespace livetet
