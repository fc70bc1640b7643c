#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace livetet::house {

/// Text of every source file by its path from the root, with / between folders.
using SourceFiles = std::map<std::string, std::string>;

/// Top folders that hold the project's own C++.
const std::vector<std::string>& source_folders();

/// Every .hpp and .cpp below `folders` of the tree at `root`.
SourceFiles read_sources(const std::filesystem::path& root,
                         const std::vector<std::string>& folders = source_folders());

std::string read_text(const std::filesystem::path& file);

/// The root of the tree that this test was built from.
std::filesystem::path tree_root();

/// One finding a line, for a failure's message.
std::string lines(const std::vector<std::string>& findings);

}  // namespace livetet::house
