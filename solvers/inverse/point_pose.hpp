#pragma once

#include <Eigen/Core>

#include "geometry/triangle_mesh.hpp"

namespace livetet {

/// A rigid motion of measured points c into the body's frame, about a centre c0:
///
///     T(c) = c0 + t + exp([a]) (c - c0).
///
/// Its six coordinates (t, a) are in m and rad.
struct PointPose {
    Vector3 centre = Vector3::Zero();
    Vector3 translation = Vector3::Zero();
    Vector3 turn = Vector3::Zero();  ///< rotation vector a

    Vector3 operator*(const Vector3& c) const;
    Vector3 inverse(const Vector3& x) const;
    /// d T(c) / d (t, a) = [I, -[exp([a]) (c - c0)] J(a)], with
    ///
    ///     J(a) = I + (1 - cos |a|) / |a|^2 [a] + (|a| - sin |a|) / |a|^3 [a]^2
    ///
    /// the left Jacobian of SO(3) (Barfoot 2017, State Estimation for Robotics, eq. 7.77).
    Eigen::Matrix<double, 3, 6> derivative(const Vector3& c) const;
};

}  // namespace livetet
