#pragma once

#include <filesystem>
#include <initializer_list>
#include <string_view>

namespace livetet {

/// Throws Error where `path`, which `name` (an option, a key) would have written, is one of the files that are read. Empty
/// paths are those of no file.
void refuse_to_overwrite(std::string_view name, const std::filesystem::path& path, std::initializer_list<std::filesystem::path> read);

/// Throws Error where the name of a file that `name` would have written ends otherwise.
void expect_ending(std::string_view name, const std::filesystem::path& path, std::string_view expected);

}  // namespace livetet
