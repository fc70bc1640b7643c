#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace livetet::house {

/// Anchors of a Markdown page: its headings as GitHub names them, and <a id="...">.
std::set<std::string> anchors(std::string_view page);

/// Targets of a page's links and pictures: [text](target), [label]: target, href="target" and
/// src="target"; none of those in code.
std::vector<std::string> link_targets(std::string_view page);

/// Every relative link of the pages `pages` (relative to `root`) whose file does not exist, or has
/// no such heading.
std::vector<std::string> broken_links(const std::filesystem::path& root,
                                      const std::vector<std::filesystem::path>& pages);

}  // namespace livetet::house
