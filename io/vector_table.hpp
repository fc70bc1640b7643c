#pragma once

#include <span>
#include <string>
#include <vector>

#include "io/hdf5.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Vectors as a table of three columns, and back.
inline std::span<const double> flat(const std::vector<Vector3>& values) {
    return {values.empty() ? nullptr : values.front().data(), 3 * values.size()};
}

inline std::vector<Vector3> vectors_of(std::span<const double> flat) {
    std::vector<Vector3> values;
    values.reserve(flat.size() / 3);
    for (std::size_t i = 0; i + 2 < flat.size(); i += 3)
        values.emplace_back(Eigen::Map<const Vector3>(flat.data() + i));
    return values;
}

inline std::vector<Vector3> read_vectors(const hdf5::File& file, const std::string& name) {
    return vectors_of(file.read<double>(name, 3).values);
}

}  // namespace livetet
