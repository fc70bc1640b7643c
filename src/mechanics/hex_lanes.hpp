#pragma once

#include "mechanics/corner_lanes.hpp"
#include "mechanics/hex_kernels.hpp"

/// Hexahedra in lanes; see PointGradients and PointForces of lanes.hpp.
///
/// A derivative by the cell's own coordinate x is linear in y and z along: with the differences of
/// u along the four edges in that direction, e_jk = u_1jk - u_0jk,
///
///     du/dx (y, z) = sum_jk y_j z_k e_jk,   y_0 = 1 - y, y_1 = y.
///
/// Gauss's points have two values of each coordinate, so that four values of du/dx serve all eight:
/// twelve vectors for the three axes. Forces go the same way back. Where a cell's edges lie along
/// the body's axes, du/dx times 1 / edge is a column of H: the twelve vectors are scaled once, and
/// no point takes a product by the axes.
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

/// The corner or point of that number in the square, with bit `axis` 0.
constexpr int lower_corner(int in_square, int axis) {
    const int low = in_square & ((1 << axis) - 1);
    return (in_square - low) * 2 + low;
}

/// 1 / edge along an axis, below zero where the edge leads backwards; of aligned cells.
template <class Real>
const Lanes<Real>& diagonal_of(const Mat3<Real>& g, int axis) {
    return axis == 0 ? g.x.x : axis == 1 ? g.y.y : g.z.z;
}

template <class Real, CellAxes axes>
class PointGradients<Real, 8, axes> {
  public:
    PointGradients(const TetBatch<Real, 8>& b, const Real* u) : g_(load_matrix<Real>(b.gradients)) {
        Vec3<Real> corners[8];
        gather_corners(b, u, corners);
        for_each_index<3>([&](auto axis) {
            OfSquare<Real> edges;
            for_each_index<4>([&](auto k) {
                constexpr int c = lower_corner(k, axis);
                edges[k] = corners[c | 1 << axis] - corners[c];
                if constexpr (axes == CellAxes::aligned)
                    edges[k] = diagonal_of(g_, axis) * edges[k];
            });
            along_[axis] = between_corners_and_points(edges);
        });
    }
    Mat3<Real> at(int q) const {
        return gradient(
            {along_[0][in_square(q, 0)], along_[1][in_square(q, 1)], along_[2][in_square(q, 2)]});
    }
    /// In the cell's middle: the means of the points'.
    Mat3<Real> centre() const {
        const Lanes<Real> quarter = all_lanes<Real>(Real(0.25));
        Vec3<Real> mean[3];
        for_each_index<3>([&](auto axis) {
            const OfSquare<Real>& at = along_[axis];
            mean[axis] = quarter * (at[0] + at[1] + at[2] + at[3]);
        });
        return gradient({mean[0], mean[1], mean[2]});
    }

  private:
    /// sum_d (du / dx_d) g_d^T.
    Mat3<Real> gradient(const Mat3<Real>& D) const {
        if constexpr (axes == CellAxes::aligned) return D;
        return {D * Vec3<Real>{g_.x.x, g_.y.x, g_.z.x}, D * Vec3<Real>{g_.x.y, g_.y.y, g_.z.y},
                D * Vec3<Real>{g_.x.z, g_.y.z, g_.z.z}};
    }

    Mat3<Real> g_;
    OfSquare<Real> along_[3];
};

template <class Real, CellAxes axes>
class PointForces<Real, 8, axes> {
  public:
    explicit PointForces(const TetBatch<Real, 8>& b) : b_(b), g_(load_matrix<Real>(b.gradients)) {}
    void add(int q, const Mat3<Real>& P) {
        const Vec3<Real> of_axis[3] = {along(P, P.x, g_.x), along(P, P.y, g_.y),
                                       along(P, P.z, g_.z)};
        for_each_index<3>([&](auto axis) {
            Vec3<Real>& sum = along_[axis][in_square(q, axis)];
            sum = sum + of_axis[axis];
        });
    }
    void scatter(Real* f) const {
        Vec3<Real> corners[8]{};
        for_each_index<3>([&](auto axis) {
            const OfSquare<Real> edges = between_corners_and_points(along_[axis]);
            for_each_index<4>([&](auto k) {
                constexpr int c = lower_corner(k, axis), next = c | 1 << axis;
                Vec3<Real> edge = edges[k];
                if constexpr (axes == CellAxes::aligned) edge = diagonal_of(g_, axis) * edge;
                corners[c] = corners[c] - edge;
                corners[next] = corners[next] + edge;
            });
        });
        scatter_add_corners(b_, corners, f);
    }

  private:
    /// P g, or the column of P that is along g: g's length is left for later.
    static Vec3<Real> along(const Mat3<Real>& P, const Vec3<Real>& column, const Vec3<Real>& g) {
        if constexpr (axes == CellAxes::aligned) return column;
        return P * g;
    }

    const TetBatch<Real, 8>& b_;
    Mat3<Real> g_;
    OfSquare<Real> along_[3]{};
};

}  // namespace livetet::lanes
