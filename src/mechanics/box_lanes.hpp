#pragma once

#include <optional>

#include "mechanics/lanes.hpp"

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

/// A box in each lane, all alike.
class Boxes {
  public:
    /// Those of the grid that a batch is of: all cells of a grid are equal.
    explicit Boxes(const TetBatch<float, 8>& b) {
        for (int d = 0; d < 3; ++d) {  // the gradient of a cell's own coordinate is 1 / L long
            const float g[3] = {b.gradients[3 * d][0], b.gradients[3 * d + 1][0],
                                b.gradients[3 * d + 2][0]};
            const float length = std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
            for (int a = 0; a < 3; ++a) unit_[d][a] = g[a] / length;
            scale_[d] = length / 4;
            axes_[d] = {all_lanes(unit_[d][0]), all_lanes(unit_[d][1]), all_lanes(unit_[d][2])};
        }
    }
    /// Whether the cells are boxes: their axes at right angles, to single precision.
    bool are_boxes() const {
        for (int d = 0; d < 3; ++d) {
            const float *a = unit_[d], *b = unit_[(d + 1) % 3];
            if (!(std::abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) < 1e-5F)) return false;
        }
        return true;
    }
    const Vec3<float>& axis(int d) const { return axes_[d]; }
    /// 1 / (4 L), 1/m.
    Lanes<float> scale(int d) const { return all_lanes(scale_[d]); }

    /// The gradient in the middle, by the modes along single axes.
    Mat3<float> mean_gradient(const Vec3<float> (&modes)[8]) const {
        const Vec3<float> D[3] = {scale(0) * modes[1], scale(1) * modes[2], scale(2) * modes[4]};
        const auto column = [&](auto part) {
            return part(axes_[0]) * D[0] + part(axes_[1]) * D[1] + part(axes_[2]) * D[2];
        };
        return {column([](const Vec3<float>& q) { return q.x; }),
                column([](const Vec3<float>& q) { return q.y; }),
                column([](const Vec3<float>& q) { return q.z; })};
    }
    /// The forces of the same modes by a mean stress P, N m with the volume.
    void set_mean_forces(const Mat3<float>& P, Vec3<float> (&forces)[8]) const {
        for (int b = 0; b < 3; ++b) forces[1 << b] = scale(b) * (P * axes_[b]);
    }

  private:
    float unit_[3][3], scale_[3];
    Vec3<float> axes_[3];
};

/// The boxes of a range of batches, if they are boxes with one rotation each; else nothing.
inline std::optional<Boxes> boxes_of(const TetBatches<float, 8>& batches, BatchRange range,
                                     std::span<const RotationBatch<float>> rotations) {
    if (range.begin == range.end || rotations.size() == batches.points * batches.all().end)
        return {};
    const Boxes boxes(batches[range.begin]);
    return boxes.are_boxes() ? std::optional(boxes) : std::nullopt;
}

/// T_m of the corners' values, in their place.
inline void to_modes(Vec3<float> (&v)[8]) {
    for (int bit = 1; bit < 8; bit *= 2)
        for (int c = 0; c < 8; ++c)
            if (!(c & bit)) {
                const Vec3<float> low = v[c], high = v[c | bit];
                v[c] = low + high;
                v[c | bit] = high - low;
            }
}

/// The transpose.
inline void to_corners(Vec3<float> (&f)[8]) {
    for (int bit = 1; bit < 8; bit *= 2)
        for (int c = 0; c < 8; ++c)
            if (!(c & bit)) {
                const Vec3<float> even = f[c], odd = f[c | bit];
                f[c] = even - odd;
                f[c | bit] = even + odd;
            }
}

/// T_m of the values of v at the corners.
inline void gather_modes(const TetBatch<float, 8>& b, const float* v, Vec3<float> (&modes)[8]) {
    for (int c = 0; c < 8; ++c) modes[c] = gather(v, b.offset[c]);
    to_modes(modes);
}

/// Adds the forces of modes to f at the corners.
inline void scatter_modes(const TetBatch<float, 8>& b, Vec3<float> (&forces)[8], float* f) {
    to_corners(forces);
    for (int c = 0; c < 8; ++c) scatter_add(forces[c], b.offset[c], f);
}

/// Number a of a vector.
template <class V>
auto& component(V& v, int a) {
    return a == 0 ? v.x : a == 1 ? v.y : v.z;
}

/// Adds part n of Hooke's law to the forces of the modes, all in the box's axes; the moduli are
/// multiplied by V 3^-|n|.
template <int n>
void add_part(const Lanes<float>& lambda, const Lanes<float>& mu, const Boxes& boxes,
              const Vec3<float> (&modes)[8], Vec3<float> (&forces)[8]) {
    Vec3<float> D[3]{};
    Lanes<float> trace{};
    for (int b = 0; b < 3; ++b) {
        if (n >> b & 1) continue;
        D[b] = boxes.scale(b) * modes[n | 1 << b];
        trace += component(D[b], b);
    }
    for (int b = 0; b < 3; ++b) {
        if (n >> b & 1) continue;
        Vec3<float> stress;
        for (int a = 0; a < 3; ++a)
            component(stress, a) = a == b       ? lambda * trace + 2 * mu * component(D[b], b)
                                   : n >> a & 1 ? mu * component(D[b], a)
                                                : mu * (component(D[b], a) + component(D[a], b));
        Vec3<float>& force = forces[n | 1 << b];
        force = force + boxes.scale(b) * stress;
    }
}

/// Whether the strain is moderate in every lane, of cells with the modes T_m and the gradient H in
/// their middle: |F^T F - I| < 1 and det F > 1/10 there, and the gradients at the points are within
/// 0.2 of H, RMS.
inline bool are_moderate(const Boxes& boxes, const Mat3<float>& H, const Vec3<float> (&modes)[8]) {
    const Mat3<float> F = plus_identity(H),
                      strain = plus_diagonal(transposed(F) * F, all_lanes(-1.0F));
    Lanes<float> beside{};
    for (int n = 1; n < 7; ++n) {
        Lanes<float> of_part{};
        for (int b = 0; b < 3; ++b)
            if (!(n >> b & 1)) {
                const Vec3<float> D = boxes.scale(b) * modes[n | 1 << b];
                of_part += dot(D, D);
            }
        beside += (n == 1 || n == 2 || n == 4 ? 1.0F / 3 : 1.0F / 9) * of_part;
    }
    const auto is_moderate =
        (dot(strain, strain) < 1.0F) & (beside < 0.04F) & (dot(F.x, cross(F.y, F.z)) > 0.1F);
    return !any(~is_moderate);
}

/// The forces of the six parts beside that of the mean gradient, in cells turned by R. Modes and
/// forces are in the body's axes.
inline void add_parts_beside_mean(const Lanes<float>& lambda, const Lanes<float>& mu,
                                  const Boxes& boxes, const Mat3<float>& R,
                                  const Vec3<float> (&modes)[8], Vec3<float> (&forces)[8]) {
    const Vec3<float> axes[3] = {R * boxes.axis(0), R * boxes.axis(1), R * boxes.axis(2)};
    Vec3<float> in_box[8], sum[8]{};
    for (const int m : {3, 5, 6, 7})  // these parts have the modes of two axes and of three
        in_box[m] = {dot(axes[0], modes[m]), dot(axes[1], modes[m]), dot(axes[2], modes[m])};
    const Lanes<float> third = all_lanes(1.0F / 3), ninth = all_lanes(1.0F / 9);
    const Lanes<float> lambda_1 = third * lambda, mu_1 = third * mu, lambda_2 = ninth * lambda,
                       mu_2 = ninth * mu;
    add_part<1>(lambda_1, mu_1, boxes, in_box, sum);
    add_part<2>(lambda_1, mu_1, boxes, in_box, sum);
    add_part<4>(lambda_1, mu_1, boxes, in_box, sum);
    add_part<3>(lambda_2, mu_2, boxes, in_box, sum);
    add_part<5>(lambda_2, mu_2, boxes, in_box, sum);
    add_part<6>(lambda_2, mu_2, boxes, in_box, sum);
    for (const int m : {3, 5, 6, 7})
        forces[m] = sum[m].x * axes[0] + sum[m].y * axes[1] + sum[m].z * axes[2];
}

}  // namespace livetet::lanes
