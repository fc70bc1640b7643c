#include "io/fiducial_file.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "base/error.hpp"
#include "base/file.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

enum class Axes { ras, lps };

constexpr const char* schema =
    "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/"
    "Schema/markups-schema-v1.0.3.json#";

/// Converts between RAS and LPS, which negates x and y in both directions.
Eigen::Vector3d to_ras(const Eigen::Vector3d& position_mm, Axes axes, const std::string& where) {
    if (!position_mm.allFinite())
        fail("{}: the position is not finite, expected three numbers in mm", where);
    const double turn = axes == Axes::lps ? -1 : 1;
    return 1e-3 * Eigen::Vector3d(turn * position_mm.x(), turn * position_mm.y(), position_mm.z());
}

std::string text_of(const Json& object, const char* key, const std::string& otherwise,
                    const std::string& where) {
    if (!object.contains(key)) return otherwise;
    if (!object[key].is_string())
        fail("{}: \"{}\" is {}, expected a text", where, key, object[key].dump());
    return object[key].get<std::string>();
}

Axes parse_axes(const std::string& text, const std::string& where) {
    if (text == "LPS" || text == "1") return Axes::lps;
    if (text == "RAS" || text == "0") return Axes::ras;
    fail("{}: the coordinate system is '{}', expected LPS or RAS", where, text);
}

const Json& array_of(const Json& object, const char* key, const std::string& where) {
    if (!object.is_object() || !object.contains(key) || !object[key].is_array())
        fail("{}: found no list \"{}\", expected Slicer's markups", where, key);
    return object[key];
}

Eigen::Vector3d parse_position(const Json& point, const std::string& where) {
    const auto found = point.find("position");
    if (found == point.end() || !found->is_array() || found->size() != 3)
        fail("{}: found no \"position\" of three numbers", where);
    Eigen::Vector3d position;
    for (int i = 0; i < 3; ++i) {
        if (!(*found)[i].is_number())
            fail("{}: \"position\" is {}, expected three numbers", where, found->dump());
        position[i] = (*found)[i].get<double>();
    }
    return position;
}

std::vector<NamedPoint> read_markups(const fs::path& path) {
    const std::string file = path.string();
    Json root;
    try {
        root = Json::parse(read_text_file(path));
    } catch (const Json::parse_error& error) {
        fail("{}: is not JSON (or truncated) at byte {}", file, error.byte);
    } catch (const Json::exception&) {
        fail("{}: holds a number too large to be one, expected Slicer's markups", file);
    }
    std::vector<NamedPoint> points;
    for (const Json& list : array_of(root, "markups", file)) {
        const Json& controls = array_of(list, "controlPoints", file);
        const Axes axes = parse_axes(text_of(list, "coordinateSystem", "LPS", file), file);
        for (std::size_t i = 0; i < controls.size(); ++i) {
            const std::string number = fmt::format("{}: control point {}", file, i + 1);
            if (!controls[i].is_object())
                fail("{}: is not an object, expected a label and a position", number);
            if (text_of(controls[i], "positionStatus", "defined", number) != "defined") continue;
            NamedPoint point{text_of(controls[i], "label", std::to_string(i + 1), number), {}};
            const std::string where = fmt::format("{} ('{}')", number, point.name);
            point.position = to_ras(parse_position(controls[i], where), axes, where);
            points.push_back(std::move(point));
        }
    }
    return points;
}

/// The layout of an `.fcsv`, from its comments; without them that of the oldest version.
struct FcsvColumns {
    std::size_t label = 0, x = 1, z = 3;
    Axes axes = Axes::ras;
};

void parse_comment(FcsvColumns& columns, std::string_view line, const std::string& where) {
    const auto mark = line.find('=');
    if (mark == std::string_view::npos) return;
    const std::string_view key = trim(line.substr(1, mark - 1)),
                           value = trim(line.substr(mark + 1));
    if (key == "CoordinateSystem") columns.axes = parse_axes(std::string(value), where);
    if (key != "columns") return;
    const auto names = split_csv(value).value_or(std::vector<std::string>{});
    const auto place = [&](const char* name) {
        const auto found = std::find(names.begin(), names.end(), name);
        if (found == names.end())
            fail("{}: found columns {}, expected {} among them", where, value, name);
        return static_cast<std::size_t>(found - names.begin());
    };
    columns.label = place("label");
    columns.x = place("x");
    columns.z = place("z");
    if (place("y") != columns.x + 1 || columns.z != columns.x + 2)
        fail("{}: found columns {}, expected x,y,z in this order", where, value);
}

std::vector<NamedPoint> read_fcsv(const fs::path& path) {
    const std::string text = read_text_file(path);
    FcsvColumns columns;
    std::vector<NamedPoint> points;
    std::size_t number = 0;
    for (const std::string_view line : split_lines(text)) {
        const std::string where = fmt::format("{}:{}", path.string(), ++number);
        if (trim(line).empty()) continue;
        if (line.starts_with('#')) {
            parse_comment(columns, line, where);
            continue;
        }
        const auto cells = split_csv(line);
        if (!cells || cells->size() <= columns.z)
            fail("{}: found {}, expected at least {} cells: a label and x,y,z in mm", where,
                 cells ? fmt::format("{} cells", cells->size()) : "a quote that is not closed",
                 columns.z + 1);
        Eigen::Vector3d position;
        for (int i = 0; i < 3; ++i) {
            const std::string& cell = (*cells)[columns.x + i];
            const auto value = parse_number(cell);
            if (!value) fail("{}: found '{}', expected a number in mm", where, cell);
            position[i] = *value;
        }
        const bool named = columns.label < cells->size() && !(*cells)[columns.label].empty();
        points.push_back({named ? (*cells)[columns.label] : std::to_string(points.size() + 1),
                          to_ras(position, columns.axes, where)});
    }
    return points;
}

}  // namespace

std::vector<NamedPoint> read_fiducials(const fs::path& path) {
    const std::string end = ending(path);
    if (end != ".json" && end != ".fcsv")
        fail("{}: the name ends in '{}', expected Slicer's points: .mrk.json or .fcsv",
             path.string(), end);
    auto points = end == ".json" ? read_markups(path) : read_fcsv(path);
    if (points.empty()) fail("{}: holds no placed point, expected at least one", path.string());
    return points;
}

void write_fiducials(const fs::path& path, const std::vector<NamedPoint>& points) {
    if (!path.string().ends_with(".mrk.json"))
        fail("{}: the name ends in '{}', expected .mrk.json for Slicer's points", path.string(),
             ending(path));
    Json controls = Json::array();
    for (const NamedPoint& point : points) {
        const Eigen::Vector3d& p = point.position;
        if (!p.allFinite())
            fail("{}: point '{}' has a coordinate that is not finite", path.string(), point.name);
        controls.push_back({{"id", std::to_string(controls.size() + 1)},
                            {"label", point.name},
                            {"description", ""},
                            {"associatedNodeID", ""},
                            {"position", {-1e3 * p.x(), -1e3 * p.y(), 1e3 * p.z()}},
                            {"orientation", {-1.0, -0.0, -0.0, -0.0, -1.0, -0.0, 0.0, 0.0, 1.0}},
                            {"selected", true},
                            {"locked", false},
                            {"visibility", true},
                            {"positionStatus", "defined"}});
    }
    const Json list{{"type", "Fiducial"},
                    {"coordinateSystem", "LPS"},
                    {"coordinateUnits", "mm"},
                    {"locked", false},
                    {"fixedNumberOfControlPoints", false},
                    {"labelFormat", "%N-%d"},
                    {"lastUsedControlPointNumber", points.size()},
                    {"controlPoints", controls}};
    const Json root{{"@schema", schema}, {"markups", Json::array({list})}};
    write_text_file(path, root.dump(4, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace livetet
