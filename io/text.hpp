#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace livetet {

/// `text` without leading and trailing blanks, tabs and line ends.
std::string_view trim(std::string_view text);

/// The words of `text`, separated by blanks, tabs and line ends.
std::vector<std::string_view> split_words(std::string_view text);

/// The lines of `text`, without line ends (LF, CR LF).
std::vector<std::string_view> split_lines(std::string_view text);

/// The first difference of two texts, for a message: the first differing line of each, `was "a: 1",
/// is "a: 2"`; "nothing" for a text that has ended.
std::string first_difference(std::string_view was, std::string_view is);

/// Parses all of `text` as a number, independent of the locale; nothing if it is not one. Accepts
/// NaN and infinities, also as old Windows programs write them ("-1.#IND").
std::optional<double> parse_number(std::string_view text);

/// Parses all of `text` as an integer that is not negative; nothing if it is not one.
std::optional<std::size_t> parse_index(std::string_view text);

/// `text` in lower case (ASCII).
std::string lower(std::string_view text);

/// The file extension in lower case: ".mha"; the last two if the last is ".gz": ".nii.gz".
std::string ending(const std::filesystem::path& path);

/// At most `max_bytes` of a file's text, cut between characters, for a terminal: '?' for each
/// control character and each byte that is no UTF-8.
std::string printable_text(std::string_view text, std::size_t max_bytes);

/// `text` without addresses such as " (0x55d0c8)", which libraries put in their messages.
std::string without_addresses(const std::string& text);

/// A cell of comma-separated text, quoted if necessary.
std::string csv_cell(const std::string& text);

/// The cells of a line of comma-separated text, trimmed and unquoted. Nothing if a quote is not
/// closed.
std::optional<std::vector<std::string>> split_csv(std::string_view line);

}  // namespace livetet
