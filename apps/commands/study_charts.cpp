#include "apps/commands/study_charts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "config/unit_of.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

constexpr std::size_t max_named_values = 6, range_parts = 5;

std::string with_unit(const std::string& name, const std::string& unit) {
    return unit.empty() ? name : fmt::format("{} [{}]", name, unit);
}

std::string input_label(const std::string& key) { return with_unit(key, unit_of<Scene>(key)); }

/// Outputs end in their unit: "largest_displacement_mm".
std::string output_label(const std::string& name) {
    for (const char* unit : {"mm", "mJ", "Pa", "N"})
        if (name.ends_with(std::string("_") + unit)) return with_unit(name, unit);
    return name;
}

/// The solves that converged and have the output.
std::vector<std::size_t> drawn_solves(const StudyTable& table, std::size_t column) {
    std::vector<std::size_t> solves;
    for (std::size_t k = 0; k < table.values.size(); ++k)
        if (table.failures[k].empty() && !std::isnan(table.results[k][column])) solves.push_back(k);
    return solves;
}

/// The groups of many numbers: equal parts of their range, or of its logarithm.
class RangeParts {
  public:
    RangeParts(double low, double high, Spacing spacing)
        : logarithmic_(spacing == Spacing::logarithmic && low > 0),
          low_(scaled(low)),
          width_((scaled(high) - low_) / range_parts) {}

    std::size_t of(double x) const {
        const double part = (scaled(x) - low_) / width_;
        return std::min(range_parts - 1, static_cast<std::size_t>(std::max(0.0, part)));
    }
    std::string name(std::size_t part) const {
        return fmt::format("{:.3g} to {:.3g}", bound(part), bound(part + 1));
    }

  private:
    double scaled(double x) const { return logarithmic_ ? std::log(x) : x; }
    double bound(std::size_t part) const {
        const double x = low_ + width_ * static_cast<double>(part);
        return logarithmic_ ? std::exp(x) : x;
    }
    bool logarithmic_;
    double low_, width_;
};

/// Groups solves by the values of an input.
std::map<std::size_t, std::string> group_names(const StudyTable& table, const Study& study,
                                               const std::vector<std::size_t>& solves,
                                               std::size_t input,
                                               std::vector<std::size_t>& group_of) {
    std::vector<std::string> values;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    bool numbers = true;
    for (const std::size_t k : solves) {
        const std::string& value = table.values[k][input];
        if (std::find(values.begin(), values.end(), value) == values.end()) values.push_back(value);
        const auto x = parse_number(value);
        numbers = numbers && x && std::isfinite(*x);
        low = std::min(low, x.value_or(low));
        high = std::max(high, x.value_or(high));
    }
    std::map<std::size_t, std::string> names;
    if (values.size() < 2) return names;
    if (numbers)
        std::ranges::sort(values, {}, [](const std::string& v) { return *parse_number(v); });
    const bool named = values.size() <= max_named_values;
    if (!named && !numbers) return names;
    const RangeParts parts(low, high, study.options.vary[input].spacing);
    for (const std::size_t k : solves) {
        const std::string& value = table.values[k][input];
        const std::size_t group =
            named ? static_cast<std::size_t>(std::find(values.begin(), values.end(), value) -
                                             values.begin())
                  : parts.of(*parse_number(value));
        group_of[k] = group;
        names[group] = named ? value : parts.name(group);
    }
    return names;
}

}  // namespace

std::vector<ScatterChart> study_charts(const StudyTable& table, const Study& study,
                                       const std::string& output) {
    const auto column = static_cast<std::size_t>(
        std::find(table.outputs.begin(), table.outputs.end(), output) - table.outputs.begin());
    const std::vector<std::size_t> solves = drawn_solves(table, column);
    std::vector<ScatterChart> charts;
    for (std::size_t i = 0; i < table.inputs.size(); ++i) {
        ScatterChart chart{.x_axis = input_label(table.inputs[i]), .y_axis = output_label(output)};
        const std::size_t other = (i + 1) % table.inputs.size();
        std::vector<std::size_t> group_of(table.values.size(), 0);
        const std::map<std::size_t, std::string> groups =
            other == i ? std::map<std::size_t, std::string>{}
                       : group_names(table, study, solves, other, group_of);
        std::map<std::size_t, std::size_t> place;  // of a group in the chart
        for (const auto& [group, name] : groups) {
            place[group] = chart.groups.size();
            chart.groups.push_back(name);
        }
        if (!groups.empty()) chart.colour_axis = input_label(table.inputs[other]);
        for (const std::size_t k : solves) {
            const auto x = parse_number(table.values[k][i]);
            if (!x) continue;
            chart.x.push_back(*x);
            chart.y.push_back(table.results[k][column]);
            chart.group_of.push_back(groups.empty() ? 0 : place[group_of[k]]);
        }
        if (chart.x.empty()) continue;
        const auto [min, max] = std::minmax_element(chart.x.begin(), chart.x.end());
        if (!(*min < *max)) continue;
        chart.logarithmic = study.options.vary[i].spacing == Spacing::logarithmic && *min > 0;
        charts.push_back(std::move(chart));
    }
    return charts;
}

}  // namespace livetet
