#pragma once

#include "mechanics/corner_lanes.hpp"

/// Products with the stiffness of boxes, eight in the lanes of a register.
///
/// A box with edges L_b has trilinear displacements. With its own coordinates x_b from -1 to 1, and
/// a set m of its axes, they are
///
///     v = 1/8 sum_m T_m prod_{d in m} x_d,     T_m = sum_c (prod_{d in m} s_d(c)) v_c,
///
/// s_d(c) = -1 or 1 the side of corner c along axis d: sums and differences of the corners, three
/// times in turn. The derivative by axis b turns the products over m = n + {b} into those over n,
/// which are orthogonal to each other over the box, with the mean square 3^-|n|. So the energy of
/// Hooke's law falls apart into seven parts, one for each n that lacks an axis. In the box's axes a
/// part's gradient D has the columns D_b = T_{n+b} / (4 L_b), zero for b in n, and
///
///     E = V sum_n 3^-|n| (lambda / 2 tr(D)^2 + mu |sym D|^2).
///
/// Two Gauss points along an axis integrate all of this exactly. Forces go the same way back. Part
/// n = {} is the mean gradient: a law of finite strain has its tangent there, taken once, in the
/// cell's middle; the six other parts keep Hooke's law, turned with the cell. That is a quarter of
/// the operations of eight points. Where strains are not moderate, Hooke's law may be far softer
/// than the other, and steps too long: there the eight points are needed.
namespace livetet::lanes {

/// A box in each lane, all alike. Aligned ones take the body's axes for theirs: R's columns are the
/// axes of a turned one, and the derivatives by the axes are the gradient's columns. Where an edge
/// leads backwards along its axis, L is negative.
template <CellAxes axes>
class Boxes {
  public:
    /// Those of the grid that a batch is of: all cells of a grid are equal.
    explicit Boxes(const TetBatch<float, 8>& b) {
        for (int d = 0; d < 3; ++d) {  // the gradient of a cell's own coordinate is 1 / L long
            const float g[3] = {b.gradients[3 * d][0], b.gradients[3 * d + 1][0],
                                b.gradients[3 * d + 2][0]};
            const float length = std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
            for (int a = 0; a < 3; ++a) unit_[d][a] = g[a] / length;
            scale_[d] = (axes == CellAxes::aligned ? g[d] : length) / 4;
            axes_[d] = {all_lanes(unit_[d][0]), all_lanes(unit_[d][1]), all_lanes(unit_[d][2])};
        }
    }
    /// Whether the cells are boxes: their axes at right angles, to single precision.
    bool are_boxes() const {
        if constexpr (axes == CellAxes::aligned) return true;
        for (int d = 0; d < 3; ++d) {
            const float *a = unit_[d], *b = unit_[(d + 1) % 3];
            if (!(std::abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) < 1e-5F)) return false;
        }
        return true;
    }
    /// An axis of those turned by R.
    Vec3<float> turned_axis(const Mat3<float>& R, int d) const {
        if constexpr (axes == CellAxes::aligned)
            return d == 0 ? R.x : d == 1 ? R.y : R.z;
        else
            return R * axes_[d];
    }
    /// 1 / (4 L), 1/m.
    Lanes<float> scale(int d) const { return all_lanes(scale_[d]); }

    /// The gradient in the middle, by the modes along single axes.
    Mat3<float> mean_gradient(const Vec3<float> (&modes)[8]) const {
        const Vec3<float> D[3] = {scale(0) * modes[1], scale(1) * modes[2], scale(2) * modes[4]};
        if constexpr (axes == CellAxes::aligned) return {D[0], D[1], D[2]};
        const auto column = [&](auto part) {
            return part(axes_[0]) * D[0] + part(axes_[1]) * D[1] + part(axes_[2]) * D[2];
        };
        return {column([](const Vec3<float>& q) { return q.x; }),
                column([](const Vec3<float>& q) { return q.y; }),
                column([](const Vec3<float>& q) { return q.z; })};
    }
    /// The forces of the same modes by a mean stress P, N m with the volume.
    void set_mean_forces(const Mat3<float>& P, Vec3<float> (&forces)[8]) const {
        for_each_index<3>([&](auto b) { forces[1 << b] = scale(b) * turned_axis(P, b); });
    }

  private:
    float unit_[3][3], scale_[3];
    Vec3<float> axes_[3];
};

/// with_boxes(the boxes of a range of batches), if they are boxes with one rotation each; else
/// without().
template <class WithBoxes, class Without>
void if_boxes(const TetBatches<float, 8>& batches, BatchRange range,
              std::span<const RotationBatch<float>> rotations, WithBoxes&& with_boxes,
              Without&& without) {
    along_axes(batches, [&](auto axes) {
        if (range.begin == range.end || rotations.size() == batches.points * batches.all().end)
            return without();
        const Boxes<decltype(axes)::value> boxes(batches[range.begin]);
        if (boxes.are_boxes())
            with_boxes(boxes);
        else
            without();
    });
}

/// work(c, c with its bit set) of each pair of numbers that differ in a bit, bit by bit.
template <class Work>
void for_each_pair(Work&& work) {
    for_each_index<12>([&](auto k) {
        constexpr int bit = 1 << k / 4, rest = k % 4, low = rest & (bit - 1);
        constexpr int c = (rest - low) * 2 + low;
        work(std::integral_constant<int, c>(), std::integral_constant<int, c | bit>());
    });
}

/// T_m of the corners' values, in their place.
inline void to_modes(Vec3<float> (&v)[8]) {
    for_each_pair([&](auto lower, auto upper) {
        const Vec3<float> low = v[lower], high = v[upper];
        v[lower] = low + high;
        v[upper] = high - low;
    });
}

/// The transpose.
inline void to_corners(Vec3<float> (&f)[8]) {
    for_each_pair([&](auto lower, auto upper) {
        const Vec3<float> even = f[lower], odd = f[upper];
        f[lower] = even - odd;
        f[upper] = even + odd;
    });
}

/// T_m of the values of v at the corners.
inline void gather_modes(const TetBatch<float, 8>& b, const float* v, Vec3<float> (&modes)[8]) {
    gather_corners(b, v, modes);
    to_modes(modes);
}

/// Adds the forces of modes to f at the corners.
inline void scatter_modes(const TetBatch<float, 8>& b, Vec3<float> (&forces)[8], float* f) {
    to_corners(forces);
    scatter_add_corners(b, forces, f);
}

/// Number a of a vector.
template <class V>
auto& component(V& v, int a) {
    return a == 0 ? v.x : a == 1 ? v.y : v.z;
}

/// Adds part n of Hooke's law to the forces of the modes, all in the box's axes; the moduli are
/// multiplied by V 3^-|n|.
template <int n, CellAxes axes>
void add_part(const Lanes<float>& lambda, const Lanes<float>& mu, const Boxes<axes>& boxes,
              const Vec3<float> (&modes)[8], Vec3<float> (&forces)[8]) {
    Vec3<float> D[3]{};
    Lanes<float> trace{};
    for_each_index<3>([&](auto b) {
        if constexpr (!(n >> b & 1)) {
            D[b] = boxes.scale(b) * modes[n | 1 << b];
            trace += component(D[b], b);
        }
    });
    for_each_index<3>([&](auto b) {
        if constexpr (!(n >> b & 1)) {
            Vec3<float> stress;
            for_each_index<3>([&](auto a) {
                component(stress, a) = a == b ? lambda * trace + 2 * mu * component(D[b], b)
                                       : n >> a & 1
                                           ? mu * component(D[b], a)
                                           : mu * (component(D[b], a) + component(D[a], b));
            });
            Vec3<float>& force = forces[n | 1 << b];
            force = force + boxes.scale(b) * stress;
        }
    });
}

/// Whether the strain is moderate in every lane, of cells with the modes T_m and the gradient H in
/// their middle: |F^T F - I| < 1 and det F > 1/10 there, and the gradients at the points are within
/// 0.2 of H, RMS.
template <CellAxes axes>
bool are_moderate(const Boxes<axes>& boxes, const Mat3<float>& H, const Vec3<float> (&modes)[8]) {
    const Mat3<float> F = plus_identity(H),
                      strain = plus_diagonal(transposed(F) * F, all_lanes(-1.0F));
    Lanes<float> beside{};
    for_each_index<6>([&](auto k) {
        constexpr int n = k + 1;
        Lanes<float> of_part{};
        for_each_index<3>([&](auto b) {
            if constexpr (!(n >> b & 1)) {
                const Vec3<float> D = boxes.scale(b) * modes[n | 1 << b];
                of_part += dot(D, D);
            }
        });
        beside += (n == 1 || n == 2 || n == 4 ? 1.0F / 3 : 1.0F / 9) * of_part;
    });
    const auto is_moderate =
        (dot(strain, strain) < 1.0F) & (beside < 0.04F) & (dot(F.x, cross(F.y, F.z)) > 0.1F);
    return !any(~is_moderate);
}

/// The forces of the six parts beside that of the mean gradient, in cells turned by R. Modes and
/// forces are in the body's axes.
template <CellAxes of_boxes>
void add_parts_beside_mean(const Lanes<float>& lambda, const Lanes<float>& mu,
                           const Boxes<of_boxes>& boxes, const Mat3<float>& R,
                           const Vec3<float> (&modes)[8], Vec3<float> (&forces)[8]) {
    const Vec3<float> axes[3] = {boxes.turned_axis(R, 0), boxes.turned_axis(R, 1),
                                 boxes.turned_axis(R, 2)};
    Vec3<float> in_box[8], sum[8]{};
    // These parts have the modes of two axes and of three.
    constexpr int with_parts[] = {3, 5, 6, 7};
    for_each_index<4>([&](auto k) {
        constexpr int m = with_parts[k];
        in_box[m] = {dot(axes[0], modes[m]), dot(axes[1], modes[m]), dot(axes[2], modes[m])};
    });
    const Lanes<float> third = all_lanes(1.0F / 3), ninth = all_lanes(1.0F / 9);
    const Lanes<float> lambda_1 = third * lambda, mu_1 = third * mu, lambda_2 = ninth * lambda,
                       mu_2 = ninth * mu;
    add_part<1>(lambda_1, mu_1, boxes, in_box, sum);
    add_part<2>(lambda_1, mu_1, boxes, in_box, sum);
    add_part<4>(lambda_1, mu_1, boxes, in_box, sum);
    add_part<3>(lambda_2, mu_2, boxes, in_box, sum);
    add_part<5>(lambda_2, mu_2, boxes, in_box, sum);
    add_part<6>(lambda_2, mu_2, boxes, in_box, sum);
    for_each_index<4>([&](auto k) {
        constexpr int m = with_parts[k];
        forces[m] = sum[m].x * axes[0] + sum[m].y * axes[1] + sum[m].z * axes[2];
    });
}

}  // namespace livetet::lanes
