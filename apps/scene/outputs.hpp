#pragma once

#include <filesystem>
#include <set>
#include <string_view>

#include "apps/scene/scene.hpp"

namespace livetet {

/// Throws Error where `path`, which `name` (an option, a key) would have written, is one of the
/// files that the run reads or else writes. Empty paths are those of no file.
void refuse_to_overwrite(std::string_view name, const std::filesystem::path& path,
                         const std::set<std::filesystem::path>& files);

/// The same of the scene's file and all that a run of it reads and writes.
void refuse_to_overwrite(std::string_view name, const std::filesystem::path& path,
                         const Scene& scene, const std::filesystem::path& scene_file);

/// Throws Error where the name of a file that `name` would have written ends otherwise.
void expect_ending(std::string_view name, const std::filesystem::path& path,
                   std::string_view expected);

}  // namespace livetet
