#include "io/volume.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

#include "base/error.hpp"

namespace livetet {

std::size_t bytes_of(ScalarType type) {
    switch (type) {
        case ScalarType::uint8:
        case ScalarType::int8:
            return 1;
        case ScalarType::uint16:
        case ScalarType::int16:
            return 2;
        case ScalarType::uint32:
        case ScalarType::int32:
        case ScalarType::float32:
            return 4;
        default:
            return 8;
    }
}

void check_spans_space(const Eigen::Matrix4d& ras_from_voxel, const std::string& where,
                       const char* source) {
    const Eigen::Matrix3d axes = ras_from_voxel.topLeftCorner<3, 3>();
    const double lengths = axes.colwise().norm().prod();
    if (!ras_from_voxel.allFinite() || !(lengths > 0) ||
        !(std::abs(axes.determinant()) > 1e-6 * lengths))
        fail(
            "{}: its {} does not span space (axes of {:.3g}, {:.3g}, {:.3g} mm), expected three "
            "directions",
            where, source, 1e3 * axes.col(0).norm(), 1e3 * axes.col(1).norm(),
            1e3 * axes.col(2).norm());
}

std::size_t checked_voxel_count(const std::array<std::int64_t, 3>& size, const std::string& where) {
    const auto [smallest, largest] = std::minmax_element(size.begin(), size.end());
    if (*smallest < 1 || *largest > 1 << 20 ||
        static_cast<double>(size[0]) * size[1] * size[2] > 4e9)
        fail(
            "{}: has {} x {} x {} voxels, expected an image of three dimensions and at most 4e9 "
            "voxels",
            where, size[0], size[1], size[2]);
    return static_cast<std::size_t>(size[0]) * size[1] * size[2];
}

}  // namespace livetet
