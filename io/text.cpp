#include "io/text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <limits>

namespace livetet {

namespace {

constexpr std::string_view blanks = " \t\r\n";

/// Bytes of the UTF-8 character that `text` begins with; 0 if it begins with none (RFC 3629,
/// section 4).
std::size_t character_length(std::string_view text) {
    const auto byte = [&](std::size_t n) {
        return n < text.size() ? static_cast<unsigned char>(text[n]) : 0;
    };
    const int first = byte(0), second = byte(1);
    if (first < 0x80) return 1;
    if (first < 0xC2 || first > 0xF4) return 0;
    const std::size_t length = first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
    for (std::size_t n = 1; n < length; ++n)
        if ((byte(n) & 0xC0) != 0x80) return 0;
    const bool overlong = (first == 0xE0 && second < 0xA0) || (first == 0xF0 && second < 0x90),
               surrogate = first == 0xED && second > 0x9F, beyond = first == 0xF4 && second > 0x8F;
    return overlong || surrogate || beyond ? 0 : length;
}

/// Whether a character is one of C0, DEL or C1 (U+0080 to U+009F).
bool is_control(std::string_view character) {
    const auto first = static_cast<unsigned char>(character[0]);
    return first < ' ' || first == 0x7F ||
           (first == 0xC2 && static_cast<unsigned char>(character[1]) < 0xA0);
}

}  // namespace

std::string_view trim(std::string_view text) {
    const auto first = text.find_first_not_of(blanks);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::vector<std::string_view> split_words(std::string_view text) {
    std::vector<std::string_view> words;
    for (auto begin = text.find_first_not_of(blanks); begin != std::string_view::npos;) {
        const auto end = std::min(text.find_first_of(blanks, begin), text.size());
        words.push_back(text.substr(begin, end - begin));
        begin = text.find_first_not_of(blanks, end);
    }
    return words;
}

std::vector<std::string_view> split_lines(std::string_view text) {
    std::vector<std::string_view> lines;
    while (!text.empty()) {
        const auto end = std::min(text.find('\n'), text.size());
        std::string_view line = text.substr(0, end);
        if (line.ends_with('\r')) line.remove_suffix(1);
        lines.push_back(line);
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return lines;
}

std::string first_difference(std::string_view was, std::string_view is) {
    const auto a = split_lines(was), b = split_lines(is);
    std::size_t begin = 0, a_end = a.size(), b_end = b.size();
    while (begin < a_end && begin < b_end && a[begin] == b[begin]) ++begin;
    while (a_end > begin && b_end > begin && a[a_end - 1] == b[b_end - 1]) --a_end, --b_end;
    const auto told = [&](const auto& lines, std::size_t end) {
        return begin < end ? fmt::format("\"{}\"", trim(lines[begin])) : "nothing";
    };
    return fmt::format("was {}, is {}", told(a, a_end), told(b, b_end));
}

std::optional<double> parse_number(std::string_view text) {
    if (text.starts_with('+') && text.size() > 1 && text[1] != '-') text.remove_prefix(1);
    if (text.find(".#") != std::string_view::npos) return std::numeric_limits<double>::quiet_NaN();
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || end != text.data() + text.size()) return std::nullopt;
    if (error == std::errc::result_out_of_range) {
        const bool tiny =
            text.find("e-") != std::string_view::npos || text.find("E-") != std::string_view::npos;
        return tiny ? 0 : std::numeric_limits<double>::infinity();
    }
    if (error != std::errc()) return std::nullopt;
    return value;
}

std::optional<std::size_t> parse_index(std::string_view text) {
    std::size_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc() || end != text.data() + text.size())
        return std::nullopt;
    return value;
}

std::string lower(std::string_view text) {
    std::string out(text);
    std::transform(out.begin(), out.end(), out.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    return out;
}

std::string ending(const std::filesystem::path& path) {
    std::string last = lower(path.extension().string());
    if (last == ".gz") last = ending(path.stem()) + last;
    return last;
}

std::string csv_cell(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos && trim(text) == text) return text;
    std::string quoted = "\"";
    for (const char c : text) {
        if (c == '"') quoted += '"';
        quoted += c == '\n' || c == '\r' ? ' ' : c;
    }
    return quoted + '"';
}

std::optional<std::vector<std::string>> split_csv(std::string_view line) {
    std::vector<std::string> cells;
    std::size_t at = 0;
    while (true) {
        at = std::min(line.find_first_not_of(" \t\r", at), line.size());
        std::string cell;
        if (at < line.size() && line[at] == '"') {
            for (++at;; ++at) {
                if (at >= line.size()) return std::nullopt;
                if (line[at] == '"' && (at + 1 >= line.size() || line[++at] != '"')) break;
                cell += line[at];
            }
            at = std::min(line.find(',', at), line.size());
        } else {
            const auto end = std::min(line.find(',', at), line.size());
            cell = trim(line.substr(at, end - at));
            at = end;
        }
        cells.push_back(std::move(cell));
        if (at >= line.size()) return cells;
        ++at;
    }
}

std::string printable_text(std::string_view text, std::size_t max_bytes) {
    std::string printable;
    while (!text.empty()) {
        const std::size_t length = character_length(text);
        const bool shown = length > 0 && !is_control(text.substr(0, length));
        if (printable.size() + (shown ? length : 1) > max_bytes) break;
        printable += shown ? text.substr(0, length) : "?";
        text.remove_prefix(std::max<std::size_t>(length, 1));
    }
    return printable;
}

std::string without_addresses(const std::string& text) {
    std::string kept;
    for (std::size_t at = 0; at < text.size(); ++at) {
        const std::size_t open = text[at] == ' ' ? at + 1 : at;
        if (text.compare(open, 3, "(0x") == 0)
            if (const std::size_t end = text.find_first_not_of("0123456789abcdefABCDEF", open + 3);
                end != std::string::npos && text[end] == ')') {
                at = end;
                continue;
            }
        kept += text[at];
    }
    return kept;
}

}  // namespace livetet
