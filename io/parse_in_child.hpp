#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace livetet {

/// Runs another library's parser of `path` in a child process and returns what `parse` returns.
/// Damaged files can make such parsers crash, loop or exhaust the memory, which ends only the
/// child. Its limits are 5 s of processor time plus 2 s for each MB of the file (20 times that in
/// wall time), and 2 GiB of memory plus 100 bytes for each byte of the file. A
/// child that is killed by SIGKILL is started once more. Throws the Error that
/// `parse` throws, or one that says how the child ended and names the library, `who`.
std::vector<char> parse_in_child(const std::filesystem::path& path, const std::string& who,
                                 const std::function<std::vector<char>()>& parse);

/// The same for a parser that reads several files, of `bytes` in all.
std::vector<char> parse_in_child(const std::filesystem::path& path, std::uintmax_t bytes,
                                 const std::string& who,
                                 const std::function<std::vector<char>()>& parse);

/// For use in `parse`: lowers the limits to those of `bytes`, once it is known that no more is
/// read.
void limit_parser(std::uintmax_t bytes);

}  // namespace livetet
