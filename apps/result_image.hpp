#pragma once

#include <optional>

#include "io/result_file.hpp"
#include "mesh/image.hpp"

namespace livetet {

/// The image that a result's mesh was made from.
struct MeshedImage {
    std::filesystem::path file;
    bool label_map = true;          ///< else it is grey, and was meshed between thresholds
    std::optional<ImageGrid> grid;  ///< where its voxels lay when it was meshed, where that is known
};

/// As the result's scene names it, or the hierarchy that the scene names. Where a file is no longer there, one of its name
/// beside the result, or beside the hierarchy, is meant. Throws Error that says what is missing where there is none.
MeshedImage find_meshed_image(const ResultReader& result, const std::filesystem::path& path);

}  // namespace livetet
