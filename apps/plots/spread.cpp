#include <vtkChartLegend.h>

#include <algorithm>
#include <cmath>

#include "apps/plots/chart_parts.hpp"
#include "apps/plots/pictures.hpp"

namespace livetet {

namespace {

/// A bar from mean - spread to mean + spread with a cap at each end.
void add_error_bar(vtkChartXY* chart, double x, double mean, double spread, double cap,
                   const look::Colour& colour) {
    const double low = mean - spread, high = mean + spread;
    add_plot(chart, vtkChart::LINE,
             {"",
              {x - cap, x + cap, x, x, x - cap, x + cap},
              {low, low, low, high, high, high},
              colour,
              1.5F});
}

}  // namespace

void write_spread_picture(const std::filesystem::path& path, std::span<const SpreadChart> charts) {
    constexpr look::Colour colours[] = {
        look::red, look::blue, {0.15, 0.60, 0.35}, {0.50, 0.30, 0.65}, look::grey};
    double top = 0;  // all charts share one range
    for (const SpreadChart& c : charts)
        for (const SpreadLine& l : c.lines)
            for (std::size_t k = 0; k < l.x.size(); ++k)
                top = std::max(top, l.mean[k] + l.spread[k]);
    ChartWindow out;
    const float width = (look::width - 20.F) / static_cast<float>(charts.size());
    float left = 10;
    for (const SpreadChart& c : charts) {
        const auto chart =
            make_chart(out.scene(), c.title, {left, 10, width - 10, look::height - 20});
        left += width;
        const double first = c.lines.front().x.front(), last = c.lines.front().x.back();
        const double apart = 0.01 * (last - first);  // so that bars do not hide each other
        const bool has_bars = std::ranges::any_of(c.lines, [](const SpreadLine& l) {
            return std::ranges::any_of(l.spread, [](double spread) { return spread > 0; });
        });
        for (std::size_t i = 0; i < c.lines.size(); ++i) {
            const SpreadLine& l = c.lines[i];
            const look::Colour& colour = colours[i % std::size(colours)];
            ChartLine line{l.name, l.x, l.mean, colour, 3};
            double aside = 0;
            if (has_bars)
                aside = apart *
                        (static_cast<double>(i) - 0.5 * static_cast<double>(c.lines.size() - 1));
            for (double& x : line.x) x += aside;
            add_plot(chart, vtkChart::LINE, line);
            for (std::size_t k = 0; has_bars && k < l.x.size(); ++k)
                add_error_bar(chart, line.x[k], l.mean[k], l.spread[k], 0.4 * apart, colour);
        }
        set_axis(chart, vtkAxis::BOTTOM, c.x_axis, std::max(0.0, first - 0.1 * (last - first)),
                 last + 0.1 * (last - first));
        set_axis(chart, vtkAxis::LEFT, c.y_axis, 0, std::ceil(1.05 * top));
        show_legend(chart);
        chart->GetLegend()->SetHorizontalAlignment(vtkChartLegend::LEFT);
    }
    write_window(out.window, path);
}

}  // namespace livetet
