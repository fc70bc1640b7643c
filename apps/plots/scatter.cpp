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

struct Range {
    double low, high;
};

/// A range slightly wider than the values.
Range around(const std::vector<double>& values) {
    const auto [min, max] = std::minmax_element(values.begin(), values.end());
    const double apart = *max > *min ? *max - *min : std::max(1e-12, std::abs(*max));
    return {*min - 0.06 * apart, *max + 0.06 * apart};
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
        auto* points = vtkPlotPoints::SafeDownCast(
            add_plot(chart, vtkChart::POINTS, {"", c.x, c.y, look::blue, 1}));
        points->SetMarkerStyle(vtkPlotPoints::CIRCLE);
        points->SetMarkerSize(10);
        const ChartLine means = means_of(c);
        if (!means.x.empty()) add_plot(chart, vtkChart::LINE, means);
        const Range y = around(c.y);
        Range x = around(c.x);
        if (c.logarithmic) {
            const auto [min, max] = std::minmax_element(c.x.begin(), c.x.end());
            chart->GetAxis(vtkAxis::BOTTOM)->SetLogScale(true);
            x = {*min / 1.1, *max * 1.1};
        }
        set_axis(chart, vtkAxis::BOTTOM, means.x.empty() ? c.x_axis : c.x_axis + " (red: the mean)",
                 x.low, x.high);
        set_axis(chart, vtkAxis::LEFT, c.y_axis, y.low, y.high);
    }
    write_window(out.window, path);
}

}  // namespace livetet
