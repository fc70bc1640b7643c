#pragma once

#include <Eigen/Dense>

#include <limits>

#include "geometry/triangle_mesh.hpp"

namespace livetet {

/// How a body moves at a place x at rest.
struct RestMotion {
    Vector3 u;                 ///< displacement, m
    Eigen::Matrix3d gradient;  ///< of x + u by x
};

/// Finds where a point y of a deformed body lies at rest: the x of
///
///     x + u(x) = y,          x <- x + omega (1 + grad u)^-1 (y - u(x) - x),
///
/// by Newton's iteration. omega begins as 1 and is halved whenever a step is not shorter than the
/// one before: so it settles near the cut where y is in the gap of one, where u jumps and no x
/// solves the equation. The body may be bent by 60 degrees over its length. `motion_at`: the
/// RestMotion at x. `tolerance`: of x, m. At most 60 evaluations.
template <class MotionAt>
Vector3 find_rest_place(const Vector3& y, double tolerance, const MotionAt& motion_at) {
    constexpr int max_evaluations = 60;
    constexpr double min_determinant = 0.05;
    Vector3 x = y;
    double omega = 1, before = std::numeric_limits<double>::infinity();
    for (int k = 0; k < max_evaluations; ++k) {
        const RestMotion motion = motion_at(x);
        Vector3 step = y - motion.u - x;
        const double length = step.norm();
        // A nearly flat or inverted cell has no useful inverse.
        if (motion.gradient.determinant() > min_determinant)
            step = motion.gradient.inverse() * step;
        if (length > 0.95 * before) omega /= 2;
        before = length;
        x += omega * step;
        if (omega * step.norm() <= tolerance) break;
    }
    return x;
}

}  // namespace livetet
