#pragma once

#include <filesystem>
#include <set>
#include <string_view>

#include "apps/scene/scene.hpp"

namespace livetet {

/// Throws Error if `path`, an output that `name` (an option, a key) requests, is one of the files
/// that the run reads or writes otherwise. Empty paths are ignored.
void refuse_to_overwrite(std::string_view name, const std::filesystem::path& path,
                         const std::set<std::filesystem::path>& files);

/// The same for the scene file and all files that a run of the scene reads and writes.
void refuse_to_overwrite(std::string_view name, const std::filesystem::path& path,
                         const Scene& scene, const std::filesystem::path& scene_file);

/// Throws Error if the output file that `name` requests does not have this ending.
void expect_ending(std::string_view name, const std::filesystem::path& path,
                   std::string_view expected);

}  // namespace livetet
