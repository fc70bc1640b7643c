#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace livetet {

/// The name of an output for one result, and one of its frames: in `pattern`
/// - {result} stands for the result's name without its ending,
/// - {folder} for the folder that the result is in ("." if its name has none),
/// - {frame} for the frame's number, counted from 1, with as many digits as that of the last frame.
///
/// Other text in braces is an error, which names `option`. `frames`: of the result; 0: without
/// {frame}.
std::filesystem::path output_name(std::string_view option, const std::filesystem::path& pattern,
                                  const std::filesystem::path& result, std::size_t frame,
                                  std::size_t frames);

/// The frames that a text chooses of `count`, counted from 0: numbers from 1 on and ranges
/// FIRST:LAST:STEP with both ends, separated by commas. FIRST, LAST and STEP may be left out: the
/// first, the last, 1. Throws Error, naming `where`, for anything else.
std::vector<std::size_t> chosen_frames(const std::string& text, std::size_t count,
                                       const std::string& where);

}  // namespace livetet
