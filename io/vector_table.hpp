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

inline std::vector<Vector3> read_vectors(const hdf5::File& file, const std::string& name) {
    const auto table = file.read<double>(name, 3);
    std::vector<Vector3> values;
    values.reserve(table.rows);
    for (std::size_t i = 0; i < table.rows; ++i)
        values.emplace_back(Eigen::Map<const Vector3>(table.values.data() + 3 * i));
    return values;
}

}  // namespace livetet
