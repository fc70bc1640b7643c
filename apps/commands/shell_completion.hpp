#pragma once

#include <CLI/CLI.hpp>

#include <string>

namespace livetet {

/// Completion scripts of the program: its sub-commands, their options, and the names that an
/// option's value may have. Other values complete to the names of files.
std::string bash_completion(const CLI::App& app);
/// The same for zsh, with what each means: the file `_livetet` of a folder in `fpath`.
std::string zsh_completion(const CLI::App& app);

}  // namespace livetet
