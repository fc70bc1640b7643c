#include "apps/live/statement_record.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "geometry/error_ellipsoid.hpp"

namespace livetet {

using nlohmann::json;

namespace {

constexpr const char* targets_text = "targets";
constexpr const char* surface_rows = "surface_places_mm";
constexpr const char* surface_radii = "surface_radius_95_mm";
constexpr const char* surface_missing = "surface_missing";
constexpr std::size_t covariance_numbers = 6;

std::array<double, covariance_numbers> upper_triangle_mm2(const Eigen::Matrix3d& c) {
    return {1e6 * c(0, 0), 1e6 * c(0, 1), 1e6 * c(0, 2),
            1e6 * c(1, 1), 1e6 * c(1, 2), 1e6 * c(2, 2)};
}

Eigen::Matrix3d covariance_of(const double* mm2) {
    Eigen::Matrix3d c;
    c << mm2[0], mm2[1], mm2[2], mm2[1], mm2[3], mm2[4], mm2[2], mm2[4], mm2[5];
    return c / 1e6;
}

std::vector<std::string> names_of(ErrorSources sources) {
    std::vector<std::string> names;
    for (std::size_t q = 0; q < error_source_count; ++q)
        if (sources.has(static_cast<ErrorSource>(q)))
            names.emplace_back(name_of(static_cast<ErrorSource>(q)));
    return names;
}

}  // namespace

std::string text_of_targets(const std::vector<std::string>& names) {
    return json(names).dump(-1, ' ', false, json::error_handler_t::replace);
}

void write_surface_places(ResultWriter& result, std::span<const Vector3> places) {
    for (const Vector3& x : places)
        result.append_row(surface_rows, {{1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z()}});
}

namespace {

using NamedValues = std::vector<std::pair<const char*, std::vector<double>>>;

/// The values of a frame about its targets, by their names in the file.
NamedValues values_of(const FrameStatement& statement) {
    std::vector<double> positions, radii, covariances, sources;
    for (const TargetStatement& t : statement.targets) {
        for (int i = 0; i < 3; ++i) positions.push_back(1e3 * t.position[i]);
        radii.push_back(1e3 * t.radius_95);
        const auto covariance = upper_triangle_mm2(t.covariance);
        covariances.insert(covariances.end(), covariance.begin(), covariance.end());
        for (const double square : t.by_source) sources.push_back(1e6 * square);
    }
    return {{"target_position_mm", positions},
            {"target_radius_95_mm", radii},
            {"target_covariance_mm2", covariances},
            {"target_by_source_mm2", sources},
            {"statement", {static_cast<double>(statement.missing.bits()), statement.computed}}};
}

NamedValues values_of(const SurfaceStatement& surface) {
    if (surface.radius_95.empty()) return {};
    std::vector<double> radii;
    for (const double radius : surface.radius_95) radii.push_back(1e3 * radius);
    return {{surface_radii, radii},
            {surface_missing, {static_cast<double>(surface.missing.bits())}}};
}

bool holds(const ResultReader& result, std::size_t k, const NamedValues& all) {
    return std::ranges::all_of(all, [&](const auto& named) {
        return result.values(named.first, k, named.second.size()) == named.second;
    });
}

}  // namespace

void append_statement(ResultWriter& result, const FrameStatement& statement) {
    if (statement.targets.empty()) return;
    for (const auto& [name, values] : values_of(statement)) result.append_values(name, values);
    for (const auto& [name, values] : values_of(statement.surface))
        result.append_values(name, values);
}

bool holds_statement(const ResultReader& result, std::size_t k, const FrameStatement& statement) {
    if (statement.targets.empty()) return !result.has_text(targets_text);
    return result.has_text(targets_text) && holds(result, k, values_of(statement)) &&
           holds(result, k, values_of(statement.surface));
}

StatementReader::StatementReader(const ResultReader& reader, std::string source)
    : reader_(reader), source_(std::move(source)) {
    if (!reader.has_text(targets_text)) return;
    const json names = json::parse(reader.text(targets_text), nullptr, false);
    const bool are_texts = names.is_array() && std::ranges::all_of(names, [](const json& name) {
                               return name.is_string();
                           });
    if (!are_texts) fail("{}: its targets are not a list of names", source_);
    names_ = names.get<std::vector<std::string>>();
    if (!reader.has_values(surface_radii)) return;  // there is no frame
    const std::vector<double> rows = reader.rows(surface_rows, 3);
    for (std::size_t i = 0; i + 2 < rows.size(); i += 3) {
        const Vector3 mm(rows[i], rows[i + 1], rows[i + 2]);
        if (!mm.allFinite()) fail("{}: {} has a place that is not finite", source_, surface_rows);
        surface_places_.push_back(mm / 1e3);
    }
    if (surface_places_.empty() || surface_places_.size() > max_places_of_surface)
        fail("{}: {} holds {} places, expected 1 to {}", source_, surface_rows,
             surface_places_.size(), max_places_of_surface);
}

std::vector<double> StatementReader::values(const char* name, std::size_t k,
                                            std::size_t count) const {
    std::vector<double> found = reader_.values(name, k, count);
    for (const double x : found)
        if (!std::isfinite(x))
            fail("{}: {} of frame {} has a value that is not finite", source_, name, k);
    return found;
}

double StatementReader::at_least_0(const char* name, std::size_t k, double value) const {
    if (value < 0) fail("{}: {} of frame {} is {}, expected at least 0", source_, name, k, value);
    return value;
}

/// In m. Throws Error for a radius below 0.
std::vector<double> StatementReader::radii(const char* name, std::size_t k,
                                           std::size_t count) const {
    std::vector<double> found = values(name, k, count);
    for (double& radius : found) {
        radius = at_least_0(name, k, radius) / 1e3;
    }
    return found;
}

ErrorSources StatementReader::sources_of(double bits, std::size_t k) const {
    if (!(bits >= 0 && bits < 1U << error_source_count && bits == std::floor(bits)))
        fail("{}: frame {} lacks the error sources {}, expected a number below {}", source_, k,
             bits, 1U << error_source_count);
    return ErrorSources::of_bits(static_cast<std::uint32_t>(bits));
}

FrameStatement StatementReader::read(std::size_t k) const {
    FrameStatement statement;
    const std::size_t n = names_.size();
    if (n == 0) return statement;
    const auto positions = values("target_position_mm", k, 3 * n);
    const auto of_targets = radii("target_radius_95_mm", k, n);
    const auto covariances = values("target_covariance_mm2", k, covariance_numbers * n);
    const auto sources = values("target_by_source_mm2", k, error_source_count * n);
    const auto about = values("statement", k, 2);
    statement.missing = sources_of(about[0], k);
    statement.computed = about[1];
    if (!(statement.computed >= 0 && statement.computed <= 1))
        fail("{}: of the responses of frame {} a share of {} is known, expected 0 to 1", source_, k,
             statement.computed);
    if (!surface_places_.empty()) {
        statement.surface.radius_95 = radii(surface_radii, k, surface_places_.size());
        statement.surface.missing = sources_of(values(surface_missing, k, 1)[0], k);
    }
    for (std::size_t i = 0; i < n; ++i) {
        TargetStatement& t = statement.targets.emplace_back();
        t.position = Vector3(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]) / 1e3;
        t.radius_95 = of_targets[i];
        t.covariance = covariance_of(&covariances[covariance_numbers * i]);
        check_covariance(t.covariance,
                         fmt::format("{}: target {} of frame {}", source_, names_[i], k));
        for (std::size_t q = 0; q < error_source_count; ++q)
            t.by_source[q] =
                at_least_0("target_by_source_mm2", k, sources[error_source_count * i + q]) / 1e6;
    }
    return statement;
}

json json_of(const FrameStatement& statement, const std::vector<std::string>& names) {
    json targets = json::array();
    for (std::size_t i = 0; i < statement.targets.size() && i < names.size(); ++i) {
        const TargetStatement& t = statement.targets[i];
        json sources = json::object();
        for (std::size_t q = 0; q < error_source_count; ++q)
            sources[name_of(static_cast<ErrorSource>(q))] = 1e3 * std::sqrt(t.by_source[q]);
        targets.push_back(
            {{"name", names[i]},
             {"position_mm", {1e3 * t.position.x(), 1e3 * t.position.y(), 1e3 * t.position.z()}},
             {"radius_95_mm", 1e3 * t.radius_95},
             {"covariance_mm2", upper_triangle_mm2(t.covariance)},
             {"rms_by_source_mm", sources}});
    }
    return {{"targets", targets},
            {"missing", names_of(statement.missing)},
            {"computed", statement.computed}};
}

std::string statement_text(const FrameStatement& statement, const std::vector<std::string>& names) {
    if (statement.targets.empty() || names.size() < statement.targets.size()) return "";
    const auto worst = std::ranges::max_element(statement.targets, {}, &TargetStatement::radius_95);
    std::string text = fmt::format("error within {:.1f} mm ({})", 1e3 * worst->radius_95,
                                   names[worst - statement.targets.begin()]);
    if (!statement.missing.empty())
        text += fmt::format(", without {}", fmt::join(names_of(statement.missing), ", "));
    if (statement.computed < 1)
        text += fmt::format(" ({:.0f} % computed)", 100 * statement.computed);
    return text;
}

}  // namespace livetet
