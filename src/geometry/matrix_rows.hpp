#pragma once

#include <array>
#include <span>

#include "geometry/transform.hpp"

namespace livetet {

/// A rigid transform as files store it: the upper 3 x 4 part of its matrix, row by row; the
/// translation in metres.
inline std::array<double, 12> matrix_rows(const Eigen::Matrix3d& rotation,
                                          const Eigen::Vector3d& translation) {
    std::array<double, 12> rows;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) rows[4 * i + k] = rotation(i, k);
        rows[4 * i + 3] = translation[i];
    }
    return rows;
}

/// Inverse of `matrix_rows`. Does not check that the matrix is a rotation.
template <class To, class From>
RigidTransform<To, From> transform_of_rows(std::span<const double, 12> rows) {
    RigidTransform<To, From> t;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) t.rotation(i, k) = rows[4 * i + k];
        t.translation[i] = rows[4 * i + 3];
    }
    return t;
}

}  // namespace livetet
