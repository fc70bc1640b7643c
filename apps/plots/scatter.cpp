#include <vtkPlotPoints.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "apps/plots/chart_parts.hpp"
#include "apps/plots/pictures.hpp"

namespace livetet {

namespace {

/// A line through the mean at each x, if there are less than half as many of them as points.
ChartLine means_of(const ScatterChart& chart) {
    std::map<double, std::pair<double, int>> sums;
    for (std::size_t k = 0; k < chart.x.size(); ++k) {
        auto& [sum, count] = sums[chart.x[k]];
        sum += chart.y[k];
        ++count;
    }
    ChartLine line{"mean", {}, {}, look::red, 3};
    if (2 * sums.size() > chart.x.size()) return line;
    for (const auto& [x, s] : sums) {
        line.x.push_back(x);
        line.y.push_back(s.first / s.second);
    }
    return line;
}

/// From dark to light, so that the order shows in grey, too.
constexpr look::Colour group_colours[] = {{0.27, 0.00, 0.33}, {0.25, 0.27, 0.53},
                                          {0.16, 0.47, 0.56}, {0.13, 0.66, 0.52},
                                          {0.48, 0.82, 0.32}, {0.99, 0.75, 0.12}};

/// Colours as far apart as the number of groups allows.
const look::Colour& group_colour(std::size_t group, std::size_t groups) {
    constexpr std::size_t last = std::size(group_colours) - 1;
    return group_colours[groups < 2 ? 0 : group * last / (groups - 1) % std::size(group_colours)];
}

void add_points(vtkChartXY* chart, const ScatterChart& c, const ChartLine& line) {
    auto* points = vtkPlotPoints::SafeDownCast(add_plot(chart, vtkChart::POINTS, line));
    points->SetMarkerStyle(vtkPlotPoints::CIRCLE);
    points->SetMarkerSize(c.groups.empty() ? 10 : 12);
}

/// The points of each group in a colour of its own, with a legend.
void add_points(vtkChartXY* chart, const ScatterChart& c) {
    if (c.groups.empty()) return add_points(chart, c, {"", c.x, c.y, look::blue, 1});
    for (std::size_t g = 0; g < c.groups.size(); ++g) {
        ChartLine line{c.groups[g], {}, {}, group_colour(g, c.groups.size()), 1};
        if (g == 0) line.name = c.colour_axis + " = " + line.name;
        for (std::size_t k = 0; k < c.x.size(); ++k) {
            if (c.group_of[k] != g) continue;
            line.x.push_back(c.x[k]);
            line.y.push_back(c.y[k]);
        }
        if (!line.x.empty()) add_points(chart, c, line);
    }
    show_legend(chart);
}

struct Range {
    double low, high;
};

/// A range slightly wider than the values.
Range around(const std::vector<double>& values) {
    const auto [min, max] = std::minmax_element(values.begin(), values.end());
    const double apart = *max > *min ? *max - *min : std::max(1e-12, std::abs(*max));
    return {*min - 0.06 * apart, *max + 0.06 * apart};
}

/// The range with room above the values for a legend of these groups and the mean, in a chart of
/// that height in pixels.
Range with_legend(const Range& values, std::size_t groups, float height) {
    constexpr double row = 36;
    const double share = std::min(0.6, row * (static_cast<double>(groups) + 2) / height);
    return {values.low, values.low + (values.high - values.low) / (1 - share)};
}

}  // namespace

void write_scatter_picture(const std::filesystem::path& path, const std::string& title,
                           std::span<const ScatterChart> charts) {
    ChartWindow out;
    const auto columns =
        static_cast<int>(std::ceil(std::sqrt(static_cast<double>(charts.size()) * 1.2)));
    const int rows = (static_cast<int>(charts.size()) + columns - 1) / columns;
    const float width = (look::width - 20.F) / static_cast<float>(columns),
                height = (look::height - 20.F) / static_cast<float>(rows);
    for (std::size_t i = 0; i < charts.size(); ++i) {
        const ScatterChart& c = charts[i];
        const int row = static_cast<int>(i) / columns, column = static_cast<int>(i) % columns;
        const auto chart =
            make_chart(out.scene(), i == 0 ? title : "",
                       {10 + static_cast<float>(column) * width,
                        10 + static_cast<float>(rows - 1 - row) * height, width - 10, height - 10});
        add_points(chart, c);
        const ChartLine means = means_of(c);
        if (!means.x.empty()) add_plot(chart, vtkChart::LINE, means);
        Range y = around(c.y);
        if (!c.groups.empty()) y = with_legend(y, c.groups.size(), height);
        Range x = around(c.x);
        if (c.logarithmic) {
            const auto [min, max] = std::minmax_element(c.x.begin(), c.x.end());
            chart->GetAxis(vtkAxis::BOTTOM)->SetLogScale(true);
            x = {*min / 1.1, *max * 1.1};
        }
        set_axis(chart, vtkAxis::BOTTOM,
                 means.x.empty() || !c.groups.empty() ? c.x_axis : c.x_axis + " (red: the mean)",
                 x.low, x.high);
        set_axis(chart, vtkAxis::LEFT, c.y_axis, y.low, y.high);
    }
    write_window(out.window, path);
}

}  // namespace livetet
