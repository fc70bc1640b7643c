#pragma once

#include <CLI/CLI.hpp>

#include <filesystem>
#include <initializer_list>
#include <string>

namespace livetet {

/// Adds an option that names a PNG to draw. A build without images has no such option.
void add_figure_option(CLI::App& command, const std::string& name, std::filesystem::path& figure,
                       const std::string& text);

/// Checks, before minutes of measuring, that these files could be written. Empty paths are
/// ignored. Throws Error if a path is a folder, or if its folder does not exist or is not writable.
void check_output_files(std::initializer_list<std::filesystem::path> files);

/// The same for figures. Throws Error also if there is neither an X server nor Xvfb to draw with.
void check_figures(std::initializer_list<std::filesystem::path> figures);

}  // namespace livetet
