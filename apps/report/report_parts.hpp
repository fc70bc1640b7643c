#pragma once

#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/scene/explanation.hpp"

// Parts of the reports of tracked runs and of solves: text, JSON and HTML.

namespace livetet {

/// Wraps a sentence, with its later lines indented.
std::string wrapped(const std::string& sentence, std::size_t width = 96);
std::string report_line(std::string_view name, const std::string& value);
/// A table of a report as it is read: the first column holds names, the others numbers. Rows may be
/// shorter than the heads.
struct ReportTable {
    std::vector<std::string> heads;
    std::vector<std::vector<std::string>> rows{};
    std::string note{};  ///< sentences below it
};

/// The table as indented text, and its note. The first column has at least this width.
std::string table_text(const ReportTable& table, std::size_t first_width = 20);

/// Lists the parts that were built, and those left out with reasons.
std::string parts_text(std::span<const ExplainedPart> parts);

nlohmann::ordered_json parts_json(std::span<const ExplainedPart> parts);
/// Dumps JSON; replaces invalid UTF-8, which file names may contain.
std::string json_text(const nlohmann::ordered_json& json);

/// A picture of a page: PNG as base64.
struct PagePicture {
    std::string caption, base64;
};

/// A table under a heading. Numbers are right-aligned. Texts are escaped: names come from files.
class HtmlSection {
  public:
    explicit HtmlSection(std::string_view title);

    void heads(std::initializer_list<std::string_view> names);
    void heads(std::span<const std::string> names);
    void texts(std::initializer_list<std::string> cells);
    void numbers(std::string_view name, std::initializer_list<double> values, int digits);
    /// Adds a row: a cell of text, then numbers.
    void row(std::initializer_list<std::string> cells);
    void row(std::span<const std::string> cells);
    std::string end(std::string_view note = "");

  private:
    std::string html_;
};

/// A section that holds one table and its note.
std::string table_html(std::string_view title, const ReportTable& table);

std::string parts_html(std::span<const ExplainedPart> parts);

/// A self-contained page: sentences, pictures, the sections of `body`, the scene. `no_pictures`:
/// why there are none.
std::string html_page(std::string_view title, std::span<const std::string> sentences,
                      std::span<const PagePicture> pictures, const std::string& no_pictures,
                      const std::string& body, const std::string& scene_text);

}  // namespace livetet
