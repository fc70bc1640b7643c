#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace livetet {

/// Runs another library's parser of `path` in a child process and returns what `parse` returned.
/// Damaged files make such parsers crash, run without end or ask for all memory; that ends the
/// child alone. It has 5 s of processor time and 2 s for each MB of the file (and twenty times as
/// long to get it), and 2 GiB of memory and 100 bytes for each of the file's. Throws the Error that
/// `parse` throws; or one that says how the child ended, naming the library, `who`.
std::vector<char> parse_in_child(const std::filesystem::path& path, const std::string& who,
                                 const std::function<std::vector<char>()>& parse);

}  // namespace livetet
