#pragma once

#include <CLI/CLI.hpp>

#include <map>
#include <string>
#include <string_view>

namespace livetet {

/// Text for roff: nothing in it is a request or an escape, minus signs can be copied into a shell,
/// and what stands in backticks is bold. Lines are joined.
std::string roff_text(std::string_view text);

/// Manual pages of section 1, for roff with the man macros, by file name: "livetet.1" of the
/// program, "livetet-mesh.1" of a sub-command with all that is below it.
std::map<std::string, std::string> man_pages(const CLI::App& app);

}  // namespace livetet
