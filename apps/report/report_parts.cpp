#include "apps/report/report_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace livetet {

namespace {

/// Escapes text for HTML: names come from files.
std::string escaped(std::string_view text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            default:
                out += c;
        }
    }
    return out;
}

constexpr const char* style = R"(<style>
body { font: 15px/1.5 sans-serif; color: #222; max-width: 60rem; margin: 2rem auto;
  padding: 0 1rem; }
h2 { margin-top: 2rem; border-bottom: 1px solid #ccc; font-size: 1.15rem; }
table { border-collapse: collapse; }
th, td { padding: .15rem .8rem .15rem 0; text-align: left; vertical-align: top; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
tr + tr { border-top: 1px solid #eee; }
img { max-width: 100%; border: 1px solid #ddd; }
figure { margin: 1rem 0; }
figcaption, .note { color: #555; }
pre { overflow-x: auto; background: #f6f6f6; padding: 1rem; }
</style>)";

}  // namespace

std::string wrapped(const std::string& sentence, std::size_t width) {
    std::string out;
    std::size_t begin = 0;
    while (sentence.size() - begin > width) {
        std::size_t end = sentence.rfind(' ', begin + width);
        if (end == std::string::npos || end <= begin)
            end = sentence.find(' ', begin + width);  // breaks after a long word, such as a path
        if (end == std::string::npos) break;
        out += sentence.substr(begin, end - begin) + "\n    ";
        begin = end + 1;
    }
    return out + sentence.substr(begin) + "\n";
}

std::string report_line(std::string_view name, const std::string& value) {
    return fmt::format("  {:<21} {}\n", name, value);
}

std::string table_text(const ReportTable& table, std::size_t first_width) {
    std::vector<std::size_t> widths;
    const auto widen = [&](std::span<const std::string> cells) {
        for (std::size_t i = 0; i < cells.size(); ++i) {
            if (i == widths.size()) widths.push_back(i == 0 ? first_width : 7);
            widths[i] = std::max(widths[i], cells[i].size() + (i == 0 ? 2 : 1));
        }
    };
    widen(table.heads);
    for (const auto& row : table.rows) widen(row);
    std::string out;
    const auto append = [&](std::span<const std::string> cells) {
        out += "  ";
        for (std::size_t i = 0; i < cells.size(); ++i)
            out += i == 0 ? fmt::format("{:<{}}", cells[i], widths[i])
                          : fmt::format("{:>{}}", cells[i], widths[i]);
        out += "\n";
    };
    append(table.heads);
    for (const auto& row : table.rows) append(row);
    return table.note.empty() ? out : out + "  " + wrapped(table.note);
}

std::string parts_text(std::span<const ExplainedPart> parts) {
    std::string out = "BUILT, AND LEFT OUT\n";
    for (const ExplainedPart& p : parts)
        out += "  " + wrapped(fmt::format("{:<11}{:<22}{}", p.built ? "built" : "left out", p.part,
                                          p.why));
    return out;
}

nlohmann::ordered_json parts_json(std::span<const ExplainedPart> parts) {
    auto list = nlohmann::ordered_json::array();
    for (const ExplainedPart& p : parts)
        list.push_back({{"part", p.part}, {"built", p.built}, {"why", p.why}});
    return list;
}

std::string json_text(const nlohmann::ordered_json& json) {
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

HtmlSection::HtmlSection(std::string_view title)
    : html_(fmt::format("<section><h2>{}</h2>\n<table>\n", escaped(title))) {}

void HtmlSection::heads(std::initializer_list<std::string_view> names) {
    heads(std::vector<std::string>(names.begin(), names.end()));
}

void HtmlSection::heads(std::span<const std::string> names) {
    html_ += "<tr>";
    for (const auto& name : names)
        html_ += fmt::format("<th class=\"{}\">{}</th>", &name == names.data() ? "" : "n",
                             escaped(name));
    html_ += "</tr>\n";
}

void HtmlSection::texts(std::initializer_list<std::string> cells) {
    html_ += "<tr>";
    for (const auto& cell : cells) html_ += fmt::format("<td>{}</td>", escaped(cell));
    html_ += "</tr>\n";
}

void HtmlSection::numbers(std::string_view name, std::initializer_list<double> values, int digits) {
    html_ += fmt::format("<tr><td>{}</td>", escaped(name));
    for (const double v : values) html_ += fmt::format("<td class=\"n\">{:.{}f}</td>", v, digits);
    html_ += "</tr>\n";
}

void HtmlSection::row(std::initializer_list<std::string> cells) {
    row(std::span(cells.begin(), cells.size()));
}

void HtmlSection::row(std::span<const std::string> cells) {
    html_ += "<tr>";
    for (const auto& cell : cells)
        html_ += fmt::format("<td{}>{}</td>", &cell == cells.data() ? "" : " class=\"n\"",
                             escaped(cell));
    html_ += "</tr>\n";
}

std::string HtmlSection::end(std::string_view note) {
    html_ += "</table>\n";
    if (!note.empty()) html_ += fmt::format("<p class=\"note\">{}</p>\n", escaped(note));
    return html_ + "</section>\n";
}

std::string table_html(std::string_view title, const ReportTable& table) {
    HtmlSection section(title);
    section.heads(table.heads);
    for (const auto& row : table.rows) section.row(row);
    return section.end(table.note);
}

std::string parts_html(std::span<const ExplainedPart> parts) {
    std::string out;
    for (const bool built : {true, false}) {
        HtmlSection s(built ? "What was built" : "What was left out, and why");
        for (const ExplainedPart& p : parts)
            if (p.built == built) s.texts({p.part, p.why});
        out += s.end();
    }
    return out;
}

std::string html_page(std::string_view title, std::span<const std::string> sentences,
                      std::span<const PagePicture> pictures, const std::string& no_pictures,
                      const std::string& body, const std::string& scene_text) {
    std::string out = fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
        "content=\"width=device-width\">\n"
        "<title>Livetet: {0}</title>\n{1}</head><body>\n<h1>{0}</h1>\n<ul>\n",
        escaped(title), style);
    for (const std::string& sentence : sentences)
        out += fmt::format("<li>{}</li>\n", escaped(sentence));
    out += "</ul>\n";
    for (const PagePicture& p : pictures)
        out += fmt::format(
            "<figure><img alt=\"{0}\" "
            "src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>\n",
            escaped(p.caption), p.base64);
    if (!no_pictures.empty())
        out +=
            fmt::format("<p class=\"note\">Pictures are left out: {}.</p>\n", escaped(no_pictures));
    out += body;
    if (!scene_text.empty())
        out += fmt::format(
            "<section><h2>Scene</h2><details><summary>every value it resolved "
            "to</summary>\n<pre>{}</pre></details></section>\n",
            escaped(scene_text));
    return out + "</body></html>\n";
}

}  // namespace livetet
