#pragma once

#include "config/yaml.hpp"

namespace livetet {

/// Text as one cell of a Markdown table: `|` and `<` escaped, lines joined.
std::string markdown_cell(std::string_view text);

/// One row of a Markdown table.
std::string markdown_row(const std::vector<std::string>& cells);

/// The reference of a field table as Markdown. Each nested table or list of tables gets a section
/// of its own, whose heading is its path in the file; its key in the parent's table links to it.
class MarkdownPrinter {
  public:
    /// `path`: the keys from the top of the file to this table, empty for the file itself.
    explicit MarkdownPrinter(std::string path = "") : path_(std::move(path)) {}

    template <class T>
    void field(std::string_view key, const T& value, std::string_view unit, std::string_view text,
               Check<T> check = {}) {
        row(key, code(yaml_text(key, value)), unit, limited(text, check.text));
    }
    template <class T>
    void field(std::string_view key, const std::optional<T>&, std::string_view unit,
               std::string_view text, Check<T> check = {}) {
        row(key, "not given", unit, limited(text, check.text));
    }
    template <class E, class Choices = std::initializer_list<Choice<E>>>
    void choice(std::string_view key, const E& value, std::string_view text,
                const Choices& choices) {
        std::string chosen, meaning = markdown_cell(text);
        for (const auto& c : choices) {
            if (c.value == value) chosen = c.name;
            meaning += fmt::format("<br>{}: {}", code(c.name), markdown_cell(c.meaning));
        }
        row(key, code(chosen), "", meaning);
    }
    template <class V>
    void variant(std::string_view key, V& value, std::string_view text) {
        std::vector<V> alternatives = V::alternatives();
        std::string meaning = markdown_cell(text);
        for (const V& a : alternatives)
            meaning += fmt::format("<br>{}: {}", code(a.name()), markdown_cell(a.meaning()));
        row(key, value ? code(value.name()) : "not given", "", meaning);
        for (V& a : alternatives) {
            if (keys_of(a).empty()) continue;
            rows_ += markdown_row({"", "", "", fmt::format("with `{}: {}`:", key, a.name())});
            visit_keys(*this, a);
        }
    }
    template <class S>
    void group(std::string_view key, S&, std::string_view text) {
        section<S>(key, "a table", text);
    }
    template <class S>
    void group(std::string_view key, std::optional<S>&, std::string_view text) {
        section<S>(key, "a table; not given", text);
    }
    template <class S>
    void list(std::string_view key, std::vector<S>&, std::string_view text) {
        section<S>(key, "a list of tables", text);
    }

    /// The table of this file or section, followed by the sections below it.
    std::string text() const;

  private:
    template <class S>
    void section(std::string_view key, std::string_view kind, std::string_view text) {
        const std::string path =
            path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
        MarkdownPrinter inner(path);
        S defaults{};
        visit_fields(inner, defaults);
        add_section(key, path, kind, text, inner.text());
    }
    void add_section(std::string_view key, const std::string& path, std::string_view kind,
                     std::string_view text, const std::string& contents);
    void row(std::string_view key, const std::string& value, std::string_view unit,
             const std::string& meaning);
    static std::string code(std::string_view text);
    static std::string limited(std::string_view text, std::string_view check);

    std::string path_, rows_, sections_;
};

/// The reference of table S with its defaults.
template <class S>
std::string markdown_of() {
    S defaults{};
    MarkdownPrinter printer;
    visit_fields(printer, defaults);
    return printer.text();
}

}  // namespace livetet
