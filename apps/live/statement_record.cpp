#include "apps/live/statement_record.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.hpp"

namespace livetet {

using nlohmann::json;

namespace {

constexpr const char* targets_text = "targets";
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

namespace {

/// The values of a frame, by their names in the file.
std::vector<std::pair<const char*, std::vector<double>>> values_of(
    const FrameStatement& statement) {
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

}  // namespace

void append_statement(ResultWriter& result, const FrameStatement& statement) {
    if (statement.targets.empty()) return;
    for (const auto& [name, values] : values_of(statement)) result.append_values(name, values);
}

bool holds_statement(const ResultReader& result, std::size_t k, const FrameStatement& statement) {
    if (statement.targets.empty()) return !result.has_text(targets_text);
    return result.has_text(targets_text) &&
           std::ranges::all_of(values_of(statement), [&](const auto& named) {
               return result.values(named.first, k, named.second.size()) == named.second;
           });
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
}

FrameStatement StatementReader::read(std::size_t k) const {
    FrameStatement statement;
    const std::size_t n = names_.size();
    if (n == 0) return statement;
    const auto values = [&](const char* name, std::size_t count) {
        std::vector<double> found = reader_.values(name, k, count);
        for (const double x : found)
            if (!std::isfinite(x))
                fail("{}: {} of frame {} has a value that is not finite", source_, name, k);
        return found;
    };
    const auto positions = values("target_position_mm", 3 * n);
    const auto radii = values("target_radius_95_mm", n);
    const auto covariances = values("target_covariance_mm2", covariance_numbers * n);
    const auto sources = values("target_by_source_mm2", error_source_count * n);
    const auto about = values("statement", 2);
    if (!(about[0] >= 0 && about[0] < 1U << error_source_count && about[0] == std::floor(about[0])))
        fail("{}: frame {} lacks the error sources {}, expected a number below {}", source_, k,
             about[0], 1U << error_source_count);
    statement.missing = ErrorSources::of_bits(static_cast<std::uint32_t>(about[0]));
    statement.computed = about[1];
    for (std::size_t i = 0; i < n; ++i) {
        TargetStatement& t = statement.targets.emplace_back();
        t.position = Vector3(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]) / 1e3;
        t.radius_95 = radii[i] / 1e3;
        if (t.radius_95 < 0)
            fail("{}: target_radius_95_mm of frame {} is {}, expected at least 0", source_, k,
                 radii[i]);
        t.covariance = covariance_of(&covariances[covariance_numbers * i]);
        for (std::size_t q = 0; q < error_source_count; ++q)
            t.by_source[q] = sources[error_source_count * i + q] / 1e6;
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
