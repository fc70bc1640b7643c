#pragma once

#include <filesystem>
#include <vector>

#include "io/result_file.hpp"

namespace livetet::test {

/// Of the last frame of a result, m.
inline std::vector<Vector3> last_displacement(const std::filesystem::path& path) {
    const ResultReader result(path);
    return result.displacement(result.times_s().size() - 1);
}

}  // namespace livetet::test
