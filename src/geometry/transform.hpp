#pragma once

#include <Eigen/Geometry>

#include <span>
#include <string>
#include <vector>

#include "base/error.hpp"

namespace livetet {

/// Tags of coordinate frames.
/// - `Tracker`: the field generator.
/// - `ImageFrame`: the world of the image (RAS).
/// - `Reference`: the reference sensor.
/// - `Base`: the frame a registration is made in; `Reference` if there is a reference sensor, else
///   `Tracker`.
/// - `Sensor`: the deformation sensor.
/// - `Tool`: the sensor of a tracked tool; `Tip`: the tool's tip.
struct Tracker {};
struct ImageFrame {};
struct Reference {};
struct Base {};
struct Sensor {};
struct Tool {};
struct Tip {};

/// Rigid transform x_to = rotation * x_from + translation (metres). Variables are named
/// `to_from_from`, for example `image_from_tracker`: in a_from_b * b_from_c the inner frames match,
/// and a product of mismatched frames does not compile.
template <class To, class From>
struct RigidTransform {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();

    Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return rotation * x + translation; }
    template <class Other>
    RigidTransform<To, Other> operator*(const RigidTransform<From, Other>& other) const {
        return {rotation * other.rotation, rotation * other.translation + translation};
    }
    RigidTransform<From, To> inverse() const {
        return {rotation.transpose(), -(rotation.transpose() * translation)};
    }
};

/// Displacement, m, of the point `x` of a body that turns by `rotation` about `pivot` and then
/// moves by `translation`: (R - I)(x - pivot) + translation.
inline Eigen::Vector3d rigid_displacement(const Eigen::Matrix3d& rotation,
                                          const Eigen::Vector3d& translation,
                                          const Eigen::Vector3d& pivot, const Eigen::Vector3d& x) {
    return (rotation - Eigen::Matrix3d::Identity()) * (x - pivot) + translation;
}

/// Similarity transform x_to = scale * rotation * x_from + translation (metres), named as
/// `RigidTransform`.
template <class To, class From>
struct SimilarityTransform {
    double scale = 1;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();

    Eigen::Vector3d operator*(const Eigen::Vector3d& x) const {
        return scale * (rotation * x) + translation;
    }
    SimilarityTransform<From, To> inverse() const {
        return {1 / scale, rotation.transpose(), -(rotation.transpose() * translation) / scale};
    }
};

inline constexpr double radians_per_degree = 3.14159265358979323846 / 180;

/// Rotation by |turn| radians about the axis `turn` (the exponential map).
inline Eigen::Matrix3d rotation_of_vector(const Eigen::Vector3d& turn) {
    const double angle = turn.norm();
    if (!(angle > 0)) return Eigen::Matrix3d::Identity();
    return Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
}

/// The axis of a rotation times its angle, rad, from 0 to pi.
inline Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) {
    const Eigen::AngleAxisd turn(rotation);
    return turn.angle() * turn.axis();
}

/// The rotation (never a reflection) nearest to `m` in the Frobenius norm (Kabsch 1976).
/// Re-orthonormalises the rotations that trackers send.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m);

}  // namespace livetet
