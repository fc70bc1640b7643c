#include <vtkPlotPoints.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "apps/plots/chart_parts.hpp"
#include "apps/plots/pareto.hpp"
#include "apps/plots/pictures.hpp"
#include "base/counted.hpp"

namespace livetet {

namespace {

double largest(const std::vector<double>& values) {
    return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}

ChartLine level(const std::string& name, double first, double last, double y,
                const look::Colour& colour, int pen) {
    return {name, {first, last}, {y, y}, colour, 2.5F, pen};
}

/// The points of all lines that none is better than.
ChartLine front_of(const WorkPrecisionChart& chart) {
    std::vector<double> seconds, error;
    for (const WorkPrecisionLine& l : chart.lines) {
        seconds.insert(seconds.end(), l.seconds.begin(), l.seconds.end());
        error.insert(error.end(), l.error.begin(), l.error.end());
    }
    ChartLine front{chart.front, {}, {}, look::ink, 2, vtkPen::DASH_LINE};
    for (const std::size_t k : pareto_front(seconds, error)) {
        front.x.push_back(seconds[k]);
        front.y.push_back(error[k]);
    }
    return front;
}

void add_marks(vtkChartXY* chart, const ChartLine& line, float size) {
    auto* marks = vtkPlotPoints::SafeDownCast(add_plot(chart, vtkChart::POINTS, line));
    marks->SetMarkerStyle(vtkPlotPoints::CIRCLE);
    marks->SetMarkerSize(size);
    marks->SetLabel("");
}

}  // namespace

void write_target_error_picture(const std::filesystem::path& path, const TargetErrors& errors) {
    ChartLine press{"press depth (right axis)", {}, {}, look::grey, 2, vtkPen::DASH_LINE};
    ChartLine rigid{fmt::format("rigid-only: {:.1f} mm RMS at deepest press", errors.rigid_mm.rms),
                    {},
                    {},
                    look::red,
                    3};
    ChartLine deforming{fmt::format("with deformation: {:.1f} mm RMS", errors.deforming_mm.rms),
                        {},
                        {},
                        look::blue,
                        3};
    for (const TargetErrorSample& s : errors.samples) {
        for (ChartLine* line : {&press, &rigid, &deforming}) line->x.push_back(s.time_s);
        press.y.push_back(s.press_mm);
        rigid.y.push_back(s.rigid_mm);
        deforming.y.push_back(s.deforming_mm);
    }
    // Leaves room for the legend. Both vertical axes are in mm and share one range.
    const double top = 1.3 * std::max({largest(rigid.y), largest(deforming.y), largest(press.y)});
    ChartWindow out;
    const auto chart = make_chart(
        out.scene(),
        fmt::format("Error at the {} of {} that move, {:.1f} times smaller with deformation",
                    errors.moving, counted(errors.targets, "target"), errors.gain()),
        {10, 10, look::width - 20, look::height - 20});
    for (const ChartLine* line : {&rigid, &deforming}) add_plot(chart, vtkChart::LINE, *line);
    chart->SetPlotCorner(add_plot(chart, vtkChart::LINE, press), 1);
    set_axis(chart, vtkAxis::BOTTOM, "time [s]", press.x.front(), press.x.back());
    set_axis(chart, vtkAxis::LEFT, "error, RMS over targets [mm]", 0, top);
    set_axis(chart, vtkAxis::RIGHT, "press depth [mm]", 0, top);
    show_legend(chart);
    write_window(out.window, path);
}

void write_frame_times_picture(const std::filesystem::path& path, std::span<const RunFrame> frames,
                               const Report& report) {
    const Distribution& ms = report.frames.frame_ms;
    // Omits a budget far above all frames, which would flatten the curve.
    const double budget = report.run.budget_ms, seen = budget <= 4 * ms.worst ? budget : 0;
    const double top = 1.35 * std::max(ms.worst, seen);
    std::string title = fmt::format("Frame times: {} of {} missed", report.run.missed,
                                    counted(report.run.samples, "sample"));
    if (report.run.budget_given)
        title += fmt::format(", {} of {} cut short", report.frames.cut_short,
                             counted(report.frames.kept, "frame"));
    ChartLine times{"each frame", {}, {}, look::blue, 2};
    for (const RunFrame& frame : frames) {
        times.x.push_back(frame.time_s);
        times.y.push_back(frame.frame_ms);
    }
    ChartWindow out;
    const auto chart =
        make_chart(out.scene(), title, {10, 10, look::width - 500, look::height - 20});
    add_plot(chart, vtkChart::LINE, times);
    const double first = times.x.front(), last = times.x.back();
    if (seen > 0)
        add_plot(chart, vtkChart::LINE,
                 level(fmt::format("{} {:g} ms",
                                   report.run.budget_given ? "budget" : "between samples", budget),
                       first, last, budget, look::red, vtkPen::SOLID_LINE));
    add_plot(chart, vtkChart::LINE,
             level(fmt::format("99 %: {:.1f} ms", ms.p99), first, last, ms.p99, look::ink,
                   vtkPen::DOT_LINE));
    add_plot(chart, vtkChart::LINE,
             level(fmt::format("median {:.1f} ms", ms.median), first, last, ms.median, look::ink,
                   vtkPen::DASH_LINE));
    set_axis(chart, vtkAxis::BOTTOM, "time [s]", first, last);
    set_axis(chart, vtkAxis::LEFT, "frame time [ms]", 0, top);
    show_legend(chart);

    constexpr int bins = 40;
    ChartLine counts{"frames", std::vector<double>(bins), std::vector<double>(bins), look::blue, 1};
    const double widest = std::max(ms.worst, seen) * 1.02;
    for (int b = 0; b < bins; ++b) counts.x[b] = (b + 0.5) * widest / bins;
    for (const double t : times.y)
        ++counts.y[std::clamp(static_cast<int>(t / widest * bins), 0, bins - 1)];
    const auto histogram =
        make_chart(out.scene(), "Distribution", {look::width - 480.F, 10, 470, look::height - 20});
    add_plot(histogram, vtkChart::BAR, counts);
    if (seen > 0)
        add_plot(histogram, vtkChart::LINE,
                 {"budget",
                  {budget, budget},
                  {0, 1.1 * largest(counts.y)},
                  look::red,
                  2.5F,
                  vtkPen::SOLID_LINE});
    set_axis(histogram, vtkAxis::BOTTOM, "frame time [ms]", 0, widest);
    set_axis(histogram, vtkAxis::LEFT, "frames", 0, 1.1 * largest(counts.y));
    write_window(out.window, path);
}

void write_work_precision_picture(const std::filesystem::path& path,
                                  std::span<const WorkPrecisionChart> charts) {
    constexpr look::Colour colours[] = {look::red,          look::blue,         {0.90, 0.55, 0.10},
                                        {0.15, 0.60, 0.35}, {0.50, 0.30, 0.65}, look::grey,
                                        look::ink,          {0.35, 0.75, 0.85}};
    ChartWindow out;
    const float width = (look::width - 20.F) / static_cast<float>(charts.size());
    float left = 10;
    for (const WorkPrecisionChart& c : charts) {
        const auto chart =
            make_chart(out.scene(), c.title, {left, 10, width - 10, look::height - 20});
        left += width;
        double low[2] = {1e30, 1e30}, high[2] = {0, 0};
        if (!c.front.empty()) {  // below the points, so that its marks show as rings
            const ChartLine front = front_of(c);
            add_plot(chart, vtkChart::LINE, front);
            add_marks(chart, front, 22);
        }
        std::map<std::string, std::size_t> groups;
        for (const WorkPrecisionLine& l : c.lines) {
            const auto [group, is_first] =
                groups.emplace(l.group.empty() ? l.name : l.group, groups.size());
            const look::Colour& colour = colours[group->second % std::size(colours)];
            ChartLine line{l.name, l.seconds, l.error, colour, 3};
            if (!is_first) line.pen = vtkPen::DOT_LINE;
            add_plot(chart, vtkChart::LINE, line);
            add_marks(chart, line, 14);
            for (std::size_t k = 0; k < l.seconds.size(); ++k) {
                low[0] = std::min(low[0], l.seconds[k]);
                high[0] = std::max(high[0], l.seconds[k]);
                low[1] = std::min(low[1], l.error[k]);
                high[1] = std::max(high[1], l.error[k]);
            }
        }
        for (const int axis : {vtkAxis::BOTTOM, vtkAxis::LEFT}) {
            const int d = axis == vtkAxis::LEFT;
            chart->GetAxis(axis)->SetLogScale(true);
            chart->GetAxis(axis)->SetNotation(vtkAxis::SCIENTIFIC_NOTATION);
            chart->GetAxis(axis)->SetPrecision(0);
            // Whole decades, with room for the legend.
            set_axis(chart, axis, d ? c.error_axis : c.time_axis,
                     std::pow(10, std::floor(std::log10(low[d]))),
                     std::pow(10, std::ceil(std::log10(high[d])) + d));
        }
        show_legend(chart);
    }
    write_window(out.window, path);
}

}  // namespace livetet
