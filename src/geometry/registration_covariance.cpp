#include "geometry/registration_covariance.hpp"

#include <Eigen/Dense>

#include <cmath>

#include "base/error.hpp"
#include "geometry/error_ellipsoid.hpp"
#include "geometry/point_moments.hpp"

namespace livetet {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix63d = Eigen::Matrix<double, 6, 3>;

constexpr double rotation_tolerance = 1e-6;

// The matrix of v x.
Matrix3d cross_matrix(const Vector3d& v) {
    Matrix3d m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
}

void check_count(std::size_t found, std::size_t points, std::string_view what) {
    if (found != 0 && found != points)
        fail("registration: {} {} for {} points, expected one each or none", found, what, points);
}

void check_errors(std::size_t points, const Matrix3d& rotation, const FiducialErrors& errors) {
    check_count(errors.in_from.size(), points, "covariances of the points to move");
    check_count(errors.in_to.size(), points, "covariances of the points to move to");
    check_count(errors.from_from_tool.size(), points, "rotations of the tool");
    const Matrix3d I = Matrix3d::Identity();
    if (!((rotation.transpose() * rotation - I).norm() < rotation_tolerance) ||
        rotation.determinant() < 0)
        fail("registration: the fit's rotation has the determinant {:.6g}, expected a rotation",
             rotation.determinant());
    for (std::size_t i = 0; i < errors.in_from.size(); ++i)
        check_covariance(errors.in_from[i],
                         fmt::format("registration: point {} of {} to move", i + 1, points));
    for (std::size_t i = 0; i < errors.in_to.size(); ++i)
        check_covariance(errors.in_to[i],
                         fmt::format("registration: point {} of {} to move to", i + 1, points));
    check_covariance(errors.tip, "registration: the tip");
    for (std::size_t i = 0; i < errors.from_from_tool.size(); ++i) {
        const double length = errors.from_from_tool[i].norm() / std::sqrt(3);
        if (!(length < 1 + rotation_tolerance))
            fail(
                "registration: the tool's rotation at point {} of {} has columns of RMS length "
                "{:.6g}, expected a rotation or a mean of rotations",
                i + 1, points, length);
    }
}

}  // namespace

Matrix6d registration_covariance(std::span<const Vector3d> from, const Matrix3d& rotation,
                                 const FiducialErrors& errors, std::span<const double> weights) {
    const PointMoments m = checked_moments(from, from, weights);
    check_errors(from.size(), rotation, errors);
    const Matrix3d I = Matrix3d::Identity();
    const bool turned = !errors.from_from_tool.empty();
    const double total = total_weight(weights, from.size());
    const Matrix3d scatter = rotation * m.to_from_covariance * rotation.transpose();
    const Matrix3d inverse = (m.variance_from * I - scatter).inverse();
    const Matrix3d centre = cross_matrix(rotation * m.mean_from);
    Matrix6d covariance = Matrix6d::Zero();
    Matrix63d of_tip = Matrix63d::Zero();  // derivative of (d, a) by the tip
    for (std::size_t i = 0; i < from.size(); ++i) {
        const double w = weight_of(weights, i) / total;
        const Matrix3d turn = w * inverse * cross_matrix(rotation * (from[i] - m.mean_from));
        Matrix63d of_point;
        of_point << w * I + centre * turn, turn;
        Matrix3d place = Matrix3d::Zero();
        if (!errors.in_from.empty()) place += rotation * errors.in_from[i] * rotation.transpose();
        if (!errors.in_to.empty()) place += errors.in_to[i];
        covariance += of_point * place * of_point.transpose();
        of_tip += of_point * rotation * (turned ? errors.from_from_tool[i] : I);
    }
    return covariance + of_tip * errors.tip * of_tip.transpose();
}

Eigen::Matrix<double, 3, 6> point_jacobian(const Vector3d& arm) {
    Eigen::Matrix<double, 3, 6> jacobian;
    jacobian << Matrix3d::Identity(), -cross_matrix(arm);
    return jacobian;
}

Matrix3d point_covariance(const Matrix6d& covariance, const Vector3d& arm) {
    const Eigen::Matrix<double, 3, 6> jacobian = point_jacobian(arm);
    const Matrix3d of_point = jacobian * covariance * jacobian.transpose();
    return 0.5 * (of_point + of_point.transpose());  // rounding grows with the arm
}

}  // namespace livetet
