#pragma once

#include <CLI/CLI.hpp>

#include <filesystem>
#include <string>

namespace livetet {

/// Adds an option that names a PNG to draw. A build without images has no such option.
void add_figure_option(CLI::App& command, const std::string& name, std::filesystem::path& figure,
                       const std::string& text);

/// Checks that a figure could be drawn, before minutes of measuring. Does nothing if `figure` is
/// empty. Throws Error if there is neither an X server nor Xvfb.
void check_display(const std::filesystem::path& figure);

}  // namespace livetet
