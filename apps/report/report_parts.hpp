#pragma once

#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>

#include "apps/scene/explanation.hpp"

// What the reports of tracked runs and of solves are made of: text, JSON and HTML.

namespace livetet {

/// A sentence, its later lines indented.
std::string wrapped(const std::string& sentence, std::size_t width = 96);
std::string report_line(std::string_view name, const std::string& value);
/// What was built, and what was left out and why.
std::string parts_text(std::span<const ExplainedPart> parts);

nlohmann::ordered_json parts_json(std::span<const ExplainedPart> parts);
/// Text in a file: names of files need not be UTF-8.
std::string json_text(const nlohmann::ordered_json& json);

/// A picture to stand in a page: PNG, as base64.
struct PagePicture {
    std::string caption, base64;
};

/// A table under a heading, row by row. Cells that are numbers stand to the right. Texts are
/// escaped: names come from files.
class HtmlSection {
  public:
    explicit HtmlSection(std::string_view title);

    void heads(std::initializer_list<std::string_view> names);
    void texts(std::initializer_list<std::string> cells);
    void numbers(std::string_view name, std::initializer_list<double> values, int digits);
    /// A cell of text first, the others as numbers stand.
    void row(std::initializer_list<std::string> cells);
    std::string end(std::string_view note = "");

  private:
    std::string html_;
};

std::string parts_html(std::span<const ExplainedPart> parts);

/// A page that needs no other file: sentences first, then pictures, the sections of `body`, the
/// scene. `no_pictures`: why there are none, where there are none.
std::string html_page(std::string_view title, std::span<const std::string> sentences,
                      std::span<const PagePicture> pictures, const std::string& no_pictures,
                      const std::string& body, const std::string& scene_text);

}  // namespace livetet
