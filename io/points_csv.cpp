#include "io/points_csv.hpp"

#include <cmath>
#include <set>
#include <string>

#include "base/error.hpp"
#include "base/file.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

const std::string header(points_csv_header);

NamedPoint parse_row(std::string_view line, const std::string& where) {
    const auto cells = split_csv(line);
    if (!cells || cells->size() < 4)
        fail("{}: found {}, expected {}", where,
             cells ? fmt::format("{} cells", cells->size()) : "a quote that is not closed", header);
    NamedPoint point{(*cells)[0], {}};
    for (int i = 0; i < 3; ++i) {
        const auto value = parse_number((*cells)[i + 1]);
        if (!value || !std::isfinite(*value))
            fail("{}: found '{}', expected a number in mm", where, (*cells)[i + 1]);
        point.position[i] = 1e-3 * *value;
    }
    return point;
}

bool is_header(std::string_view line) {
    const auto cells = split_csv(line);
    return cells && cells->size() >= 4 &&
           fmt::format("{},{},{},{}", (*cells)[0], (*cells)[1], (*cells)[2], (*cells)[3]) == header;
}

/// What to change in a first line that is not the header.
std::string header_advice(std::string_view line) {
    const auto cells = split_csv(line);
    const auto expected = split_csv(header);
    if (!cells || cells->size() < expected->size()) return "";
    if (parse_number((*cells)[1])) return "; add this line above the first point";
    std::string text;
    for (std::size_t i = 0; i < expected->size(); ++i)
        if ((*cells)[i] != (*expected)[i])
            text += fmt::format("{}'{}' to '{}'", text.empty() ? "; rename " : ", ", (*cells)[i],
                                (*expected)[i]);
    return text;
}

}  // namespace

std::string point_csv_row(const NamedPoint& point) {
    const Eigen::Vector3d mm = 1e3 * point.position;
    return fmt::format("{},{},{},{}", csv_cell(point.name), mm.x(), mm.y(), mm.z());
}

std::vector<NamedPoint> read_points_csv(const fs::path& path) {
    const std::string text = read_text_file(path);
    std::vector<NamedPoint> points;
    std::set<std::string> names;
    bool headed = false;
    std::size_t number = 0;
    for (std::string_view line : split_lines(text)) {
        const std::string where = fmt::format("{}:{}", path.string(), ++number);
        if (number == 1 && line.starts_with("\xEF\xBB\xBF"))
            line.remove_prefix(3);  // byte order mark
        if (trim(line).empty() || line.starts_with('#')) continue;
        if (!headed) {
            if (!is_header(line))
                fail("{}: found '{}', expected the header {}{}", where, trim(line).substr(0, 60),
                     header, header_advice(line));
            headed = true;
            continue;
        }
        points.push_back(parse_row(line, where));
        if (!names.insert(points.back().name).second)
            fail("{}: found the name '{}' twice, expected each once", where, points.back().name);
    }
    if (points.empty()) fail("{}: holds no point, expected lines of {}", path.string(), header);
    return points;
}

void write_points_csv(const fs::path& path, std::span<const NamedPoint> points) {
    std::string text = header + "\n";
    for (const NamedPoint& point : points) text += point_csv_row(point) + "\n";
    write_text_file(path, text);
}

void write_displacements_csv(const fs::path& path, std::span<const NamedPoint> points,
                             std::span<const Eigen::Vector3d> displacements) {
    if (points.size() != displacements.size())
        fail("{}: {} displacements for {} points, expected one each", path.string(),
             displacements.size(), points.size());
    std::string text = header + ",ux_mm,uy_mm,uz_mm\n";
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Eigen::Vector3d mm = 1e3 * displacements[i];
        text += fmt::format("{},{},{},{}\n", point_csv_row(points[i]), mm.x(), mm.y(), mm.z());
    }
    write_text_file(path, text);
}

}  // namespace livetet
