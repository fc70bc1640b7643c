#pragma once

#include <Eigen/Geometry>

#include <span>
#include <string>
#include <vector>

#include "base/error.hpp"

namespace livetet {

/// Frames of reference. `Tracker` is the field generator's, `Image` the world of the image (RAS),
/// `Reference` the reference sensor's, `Base` the one that a registration is made in (`Reference`
/// where there is one, else `Tracker`), `Sensor` the deformation sensor's, `Tool` the tracked
/// tool's sensor, `Tip` the tool's tip.
struct Tracker {};
struct ImageFrame {};
struct Reference {};
struct Base {};
struct Sensor {};
struct Tool {};
struct Tip {};

/// x_to = rotation * x_from + translation (metres); named `to_from_from`, as `image_from_tracker`,
/// so that `a_from_b * b_from_c` reads itself and a wrong product does not compile.
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

/// x_to = scale * rotation * x_from + translation.
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

/// The rotation by |turn| radians about `turn`.
inline Eigen::Matrix3d rotation_of_vector(const Eigen::Vector3d& turn) {
    const double angle = turn.norm();
    if (!(angle > 0)) return Eigen::Matrix3d::Identity();
    return Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
}

/// The rotation nearest to `m` in the Frobenius norm, never a reflection (Kabsch 1976): for
/// trackers whose rotations are not quite orthonormal.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m);

}  // namespace livetet
