#include "solvers/inverse/point_pose.hpp"

#include <cmath>

#include "geometry/transform.hpp"

namespace livetet {

namespace {

Eigen::Matrix3d cross_matrix(const Vector3& v) {
    Eigen::Matrix3d m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
}

Eigen::Matrix3d left_jacobian(const Vector3& a) {
    constexpr double small = 1e-3;  // below, the series is exact to 1e-13
    const double angle = a.norm(), square = angle * angle;
    const Eigen::Matrix3d cross = cross_matrix(a);
    const double first = angle < small ? 0.5 - square / 24 : (1 - std::cos(angle)) / square;
    const double second =
        angle < small ? 1.0 / 6 - square / 120 : (angle - std::sin(angle)) / (square * angle);
    return Eigen::Matrix3d::Identity() + first * cross + second * cross * cross;
}

}  // namespace

Vector3 PointPose::operator*(const Vector3& c) const {
    return centre + translation + rotation_of_vector(turn) * (c - centre);
}

Vector3 PointPose::inverse(const Vector3& x) const {
    return centre + rotation_of_vector(turn).transpose() * (x - centre - translation);
}

Eigen::Matrix<double, 3, 6> PointPose::derivative(const Vector3& c) const {
    Eigen::Matrix<double, 3, 6> d;
    d.leftCols<3>().setIdentity();
    d.rightCols<3>() = -cross_matrix(rotation_of_vector(turn) * (c - centre)) * left_jacobian(turn);
    return d;
}

}  // namespace livetet
