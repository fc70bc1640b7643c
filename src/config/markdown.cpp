#include "config/markdown.hpp"

#include <cctype>

namespace livetet {

namespace {

/// The anchor that GitHub and other renderers give a heading: lower case, without punctuation.
std::string anchor_of(std::string_view heading) {
    std::string anchor;
    for (const char c : heading)
        if (std::isalnum(static_cast<unsigned char>(c)) || c == '_')
            anchor += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return anchor;
}

}  // namespace

std::string markdown_cell(std::string_view text) {
    std::string cell;
    for (const char c : text) {
        if (c == '|')
            cell += "\\|";
        else if (c == '<')
            cell += "&lt;";
        else
            cell += c == '\n' ? ' ' : c;
    }
    return cell;
}

std::string markdown_row(const std::vector<std::string>& cells) {
    std::string row = "|";
    for (const std::string& cell : cells) row += cell.empty() ? " |" : " " + cell + " |";
    return row + "\n";
}

std::string MarkdownPrinter::text() const {
    return "| key | default | unit | meaning |\n|---|---|---|---|\n" + rows_ + sections_;
}

void MarkdownPrinter::add_section(std::string_view key, const std::string& path,
                                  std::string_view kind, std::string_view text,
                                  const std::string& contents) {
    rows_ += markdown_row({fmt::format("[`{}`](#{})", key, anchor_of(path)), std::string(kind), "",
                           markdown_cell(text)});
    sections_ += fmt::format("\n## {}\n\n{}", path, contents);
}

void MarkdownPrinter::row(std::string_view key, const std::string& value, std::string_view unit,
                          const std::string& meaning) {
    rows_ += markdown_row({code(key), value, markdown_cell(unit), meaning});
}

std::string MarkdownPrinter::code(std::string_view text) {
    return text.empty() ? "" : fmt::format("`{}`", text);
}

std::string MarkdownPrinter::limited(std::string_view text, std::string_view check) {
    return markdown_cell(text) +
           (check.empty() ? "" : fmt::format("; must be {}", markdown_cell(check)));
}

}  // namespace livetet
