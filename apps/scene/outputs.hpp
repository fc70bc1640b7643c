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

/// Whether an output that may be a file or a folder is named like a file: by the ending of a kind
/// of file (`.png`), not by any dot (`run_0.3`).
bool is_named_as_file(const std::filesystem::path& path);

}  // namespace livetet
