#pragma once

#include "mechanics/hex_kernels.hpp"
#include "mechanics/lanes.hpp"

/// Hexahedra in lanes; see PointGradients and PointForces of lanes.hpp.
///
/// A derivative by the cell's own coordinate x is linear in y and z along: with the differences of
/// u along the four edges in that direction, e_jk = u_1jk - u_0jk,
///
///     du/dx (y, z) = sum_jk y_j z_k e_jk,   y_0 = 1 - y, y_1 = y.
///
/// Gauss's points have two values of each coordinate, so that four values of du/dx serve all eight:
/// twelve vectors for the three axes. Forces go the same way back.
namespace livetet::lanes {

/// Four values at the corners of a square, number a + 2 b, and at its Gauss points. Interpolation
/// between them is a symmetric matrix, so that it is its own transpose.
template <class Real>
using OfSquare = std::array<Vec3<Real>, 4>;

template <class Real>
OfSquare<Real> between_corners_and_points(const OfSquare<Real>& v) {
    const Lanes<Real> near = all_lanes<Real>(static_cast<Real>(ElementShape<8>::near)),
                      far = all_lanes<Real>(static_cast<Real>(ElementShape<8>::far));
    const OfSquare<Real> along{near * v[0] + far * v[1], far * v[0] + near * v[1],
                               near * v[2] + far * v[3], far * v[2] + near * v[3]};
    return {near * along[0] + far * along[2], near * along[1] + far * along[3],
            far * along[0] + near * along[2], far * along[1] + near * along[3]};
}

/// Without bit `axis`: the number in the square of the two other axes of a corner or a point.
constexpr int in_square(int number, int axis) {
    const int low = number & ((1 << axis) - 1);
    return low | (number >> (axis + 1)) << axis;
}

template <class Real>
class PointGradients<Real, 8> {
  public:
    PointGradients(const TetBatch<Real, 8>& b, const Real* u) : g_(load_matrix<Real>(b.gradients)) {
        Vec3<Real> corners[8];
        for (int c = 0; c < 8; ++c) corners[c] = gather(u, b.offset[c]);
        for (int axis = 0; axis < 3; ++axis) {
            OfSquare<Real> edges;
            for (int c = 0; c < 8; ++c)
                if (!(c >> axis & 1))
                    edges[in_square(c, axis)] = corners[c | 1 << axis] - corners[c];
            along_[axis] = between_corners_and_points(edges);
        }
    }
    Mat3<Real> at(int q) const {
        return gradient(
            {along_[0][in_square(q, 0)], along_[1][in_square(q, 1)], along_[2][in_square(q, 2)]});
    }
    /// In the cell's middle: the means of the points'.
    Mat3<Real> centre() const {
        const Lanes<Real> quarter = all_lanes<Real>(Real(0.25));
        Vec3<Real> mean[3];
        for (int axis = 0; axis < 3; ++axis)
            mean[axis] =
                quarter * (along_[axis][0] + along_[axis][1] + along_[axis][2] + along_[axis][3]);
        return gradient({mean[0], mean[1], mean[2]});
    }

  private:
    /// sum_d (du / dx_d) g_d^T.
    Mat3<Real> gradient(const Mat3<Real>& D) const {
        return {D * Vec3<Real>{g_.x.x, g_.y.x, g_.z.x}, D * Vec3<Real>{g_.x.y, g_.y.y, g_.z.y},
                D * Vec3<Real>{g_.x.z, g_.y.z, g_.z.z}};
    }

    Mat3<Real> g_;
    OfSquare<Real> along_[3];
};

template <class Real>
class PointForces<Real, 8> {
  public:
    explicit PointForces(const TetBatch<Real, 8>& b) : b_(b), g_(load_matrix<Real>(b.gradients)) {}
    void add(int q, const Mat3<Real>& P) {
        const Vec3<Real> of_axis[3] = {P * g_.x, P * g_.y, P * g_.z};
        for (int axis = 0; axis < 3; ++axis) {
            Vec3<Real>& sum = along_[axis][in_square(q, axis)];
            sum = sum + of_axis[axis];
        }
    }
    void scatter(Real* f) const {
        Vec3<Real> corners[8]{};
        for (int axis = 0; axis < 3; ++axis) {
            const OfSquare<Real> edges = between_corners_and_points(along_[axis]);
            for (int c = 0; c < 8; ++c) {
                const Vec3<Real>& edge = edges[in_square(c, axis)];
                corners[c] = c >> axis & 1 ? corners[c] + edge : corners[c] - edge;
            }
        }
        for (int c = 0; c < 8; ++c) scatter_add(corners[c], b_.offset[c], f);
    }

  private:
    const TetBatch<Real, 8>& b_;
    Mat3<Real> g_;
    OfSquare<Real> along_[3]{};
};

}  // namespace livetet::lanes
