#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace livetet {

/// `text` without blanks, tabs and line ends at either end.
std::string_view trim(std::string_view text);

/// The pieces of `text` between blanks, tabs and line ends.
std::vector<std::string_view> split_words(std::string_view text);

/// The lines of `text`, without their ends (LF, CR LF).
std::vector<std::string_view> split_lines(std::string_view text);

/// Where two texts part, for a message: the first line of each that is not in the other at that
/// place, `was "a: 1", is "a: 2"`; "nothing" for the one where the other only has more.
std::string first_difference(std::string_view was, std::string_view is);

/// The whole of `text` as a number, whatever the locale; nothing where it is not one. NaN and
/// infinities pass, also as old Windows programs wrote them ("-1.#IND"): the caller decides.
std::optional<double> parse_number(std::string_view text);

/// The whole of `text` as an integer that is not negative; nothing where it is not one.
std::optional<std::size_t> parse_index(std::string_view text);

/// In lower case (ASCII).
std::string lower(std::string_view text);

/// The file's ending in lower case: ".mha"; both where it ends in ".gz": ".nii.gz".
std::string ending(const std::filesystem::path& path);

/// A cell of comma-separated text, quoted where it must be.
std::string csv_cell(const std::string& text);

/// The cells of one line of comma-separated text, trimmed; quotes around a cell are taken off,
/// doubled ones undone. Nothing where a quote is never closed.
std::optional<std::vector<std::string>> split_csv(std::string_view line);

}  // namespace livetet
