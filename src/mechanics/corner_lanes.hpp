#pragma once

#include "mechanics/lanes.hpp"

/// Values at the corners of hexahedra in lanes.
///
/// The corners of a row of cells (TetBatch::is_row) lie on four lines along x. A line has one node
/// more than there are cells, and its nodes stand one behind the other in memory. So a corner of
/// all eight cells is read as three registers, where cells anywhere take eight reads and a
/// transpose. Forces on a line are summed first, then added to memory as three registers and three
/// numbers; those of cells anywhere are added node by node.
namespace livetet::lanes {

/// Places 0, 3 and 6 of a, 1, 4 and 7 of b, 2 and 5 of c.
inline Lanes<float> every_third(const Lanes<float>& a, const Lanes<float>& b,
                                const Lanes<float>& c) {
    const Lanes<float> of_two = __builtin_shufflevector(a, b, 0, 9, 2, 3, 12, 5, 6, 15);
    return __builtin_shufflevector(of_two, c, 0, 1, 10, 3, 4, 13, 6, 7);
}

/// The vectors of eight nodes in a row, x y z of each from p on. Of 24 numbers, x of node l is
/// number 3 l. It stands at place 3 l modulo 8 of its register, where no other node's x stands: all
/// come together by `every_third` and one permutation; y and z likewise, one and two places on.
inline Vec3<float> load_row(const float* p) {
    Lanes<float> a, b, c;
    std::memcpy(&a, p, sizeof a);
    std::memcpy(&b, p + 8, sizeof b);
    std::memcpy(&c, p + 16, sizeof c);
    const Lanes<float> x = every_third(a, b, c), y = every_third(c, a, b), z = every_third(b, c, a);
    return {__builtin_shufflevector(x, x, 0, 3, 6, 1, 4, 7, 2, 5),
            __builtin_shufflevector(y, y, 1, 4, 7, 2, 5, 0, 3, 6),
            __builtin_shufflevector(z, z, 2, 5, 0, 3, 6, 1, 4, 7)};
}

/// Adds v to the vectors of eight nodes in a row: the way back.
inline void add_to_row(const Vec3<float>& v, float* p) {
    const Lanes<float> x = __builtin_shufflevector(v.x, v.x, 0, 3, 6, 1, 4, 7, 2, 5),
                       y = __builtin_shufflevector(v.y, v.y, 5, 0, 3, 6, 1, 4, 7, 2),
                       z = __builtin_shufflevector(v.z, v.z, 2, 5, 0, 3, 6, 1, 4, 7);
    const Lanes<float> more[3] = {every_third(x, y, z), every_third(z, x, y), every_third(y, z, x)};
    for (int k = 0; k < 3; ++k) {
        Lanes<float> sum;
        std::memcpy(&sum, p + 8 * k, sizeof sum);
        sum += more[k];
        std::memcpy(p + 8 * k, &sum, sizeof sum);
    }
}

/// {0, v_0, ..., v_6}.
inline Lanes<float> one_on(const Lanes<float>& v) {
    return __builtin_shufflevector(v, Lanes<float>{}, 8, 0, 1, 2, 3, 4, 5, 6);
}

/// The values of u at the corners of each cell.
template <class Real>
void gather_corners(const TetBatch<Real, 8>& b, const Real* u, Vec3<Real> (&corners)[8]) {
    if constexpr (std::is_same_v<Real, float>)
        if (b.is_row) {
            for_each_index<8>([&](auto c) { corners[c] = load_row(u + b.offset[c][0]); });
            return;
        }
    for_each_index<8>([&](auto c) { corners[c] = gather(u, b.offset[c]); });
}

/// f += the values at the corners of each cell.
template <class Real>
void scatter_add_corners(const TetBatch<Real, 8>& b, const Vec3<Real> (&corners)[8], Real* f) {
    if constexpr (std::is_same_v<Real, float>)
        if (b.is_row) {
            for_each_index<4>([&](auto k) {
                const Vec3<float>&lower = corners[2 * k], &upper = corners[2 * k + 1];
                float* line = f + b.offset[2 * k][0];
                add_to_row({lower.x + one_on(upper.x), lower.y + one_on(upper.y),
                            lower.z + one_on(upper.z)},
                           line);
                line[24] += upper.x[7];
                line[25] += upper.y[7];
                line[26] += upper.z[7];
            });
            return;
        }
    for_each_index<8>([&](auto c) { scatter_add(corners[c], b.offset[c], f); });
}

}  // namespace livetet::lanes
