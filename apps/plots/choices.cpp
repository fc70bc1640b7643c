#include <vtkPlotPoints.h>
#include <vtkTextActor.h>

#include <algorithm>
#include <cmath>

#include "apps/plots/chart_parts.hpp"
#include "apps/plots/pareto.hpp"
#include "apps/plots/pictures.hpp"

namespace livetet {

namespace {

constexpr look::Colour colours[] = {look::blue,         {0.25, 0.60, 0.90}, {0.45, 0.75, 0.90},
                                    {0.15, 0.50, 0.30}, {0.35, 0.70, 0.40}, {0.60, 0.82, 0.45},
                                    look::red,          {0.90, 0.55, 0.10}, {0.50, 0.30, 0.65},
                                    {0.70, 0.40, 0.60}, {0.45, 0.35, 0.25}, look::grey};
constexpr int marks[] = {vtkPlotPoints::CIRCLE, vtkPlotPoints::SQUARE, vtkPlotPoints::DIAMOND};
constexpr int list_width = 420;

void write_text(vtkRenderer* renderer, const std::string& words, int size, double x, double y,
                const look::Colour& colour) {
    vtkNew<vtkTextActor> text;
    text->SetInput(words.c_str());
    set_text(text->GetTextProperty(), size);
    text->GetTextProperty()->SetColor(colour[0], colour[1], colour[2]);
    text->SetPosition(x, y);
    renderer->AddActor2D(text);
}

/// Whole decades about the values.
std::pair<double, double> decades(const std::vector<double>& values) {
    const auto [min, max] = std::minmax_element(values.begin(), values.end());
    return {std::pow(10, std::floor(std::log10(*min * 0.95))),
            std::pow(10, std::ceil(std::log10(*max * 1.05)))};
}

}  // namespace

void write_choices_picture(const std::filesystem::path& path, const ChoicesChart& c) {
    ChartWindow out;
    const auto chart = make_chart(out.scene(), c.title,
                                  {10, 10, look::width - list_width - 20.F, look::height - 20.F});
    std::vector<double> x, y;
    std::vector<std::string> groups;
    for (const ChoicePoint& p : c.points) {
        x.push_back(p.x);
        y.push_back(p.y);
        if (std::find(groups.begin(), groups.end(), p.group) == groups.end())
            groups.push_back(p.group);
    }
    ChartLine front{"", {}, {}, look::ink, 2, vtkPen::DASH_LINE};
    for (const std::size_t k : pareto_front(x, y)) {
        front.x.push_back(x[k]);
        front.y.push_back(y[k]);
    }
    add_plot(chart, vtkChart::LINE, front);
    for (std::size_t g = 0; g < groups.size(); ++g) {
        ChartLine line{groups[g], {}, {}, colours[g % std::size(colours)], 2};
        for (const ChoicePoint& p : c.points)
            if (p.group == groups[g]) {
                line.x.push_back(p.x);
                line.y.push_back(p.y);
            }
        auto* plot = vtkPlotPoints::SafeDownCast(add_plot(chart, vtkChart::POINTS, line));
        plot->SetMarkerStyle(marks[g % std::size(marks)]);
        plot->SetMarkerSize(13);
    }
    const auto [left, right] = decades(x);
    const auto [low, high] = decades(y);
    for (const int axis : {vtkAxis::BOTTOM, vtkAxis::LEFT}) {
        chart->GetAxis(axis)->SetLogScale(true);
        chart->GetAxis(axis)->SetNotation(vtkAxis::SCIENTIFIC_NOTATION);
        chart->GetAxis(axis)->SetPrecision(0);
    }
    set_axis(chart, vtkAxis::BOTTOM, c.x_axis, left, right);
    set_axis(chart, vtkAxis::LEFT, c.y_axis, low, high);

    // Positions of the axes are only known once drawn.
    out.window->Render();
    const int* first = chart->GetPoint1();
    const int* last = chart->GetPoint2();
    const auto place = [](double value, double from, double to, int first_pixel, int last_pixel) {
        return first_pixel +
               std::log(value / from) / std::log(to / from) * (last_pixel - first_pixel);
    };
    const double row = std::min(
        22.0, (look::height - 60.0) / static_cast<double>(c.points.size() + groups.size() + 1));
    const int size = std::max(9, static_cast<int>(0.72 * row));
    double top = look::height - 40;
    for (std::size_t g = 0; g < groups.size(); ++g) {
        const look::Colour& colour = colours[g % std::size(colours)];
        write_text(out.renderer, groups[g], size + 1, look::width - list_width, top -= row, colour);
        for (std::size_t k = 0; k < c.points.size(); ++k) {
            const ChoicePoint& p = c.points[k];
            if (p.group != groups[g]) continue;
            const std::string number = std::to_string(p.number);
            const bool above = k % 2 == 0;  // alternates the numbers of neighbours
            write_text(out.renderer, number, 14,
                       place(p.x, left, right, first[0], last[0]) + (above ? 6 : -8),
                       place(p.y, low, high, first[1], last[1]) + (above ? 6 : -24), look::ink);
            write_text(out.renderer, number, size, look::width - list_width + 12, top -= row,
                       look::ink);
            write_text(out.renderer, p.name, size, look::width - list_width + 44, top, look::ink);
        }
    }
    write_text(out.renderer, "- - -  nothing is both faster and nearer", size,
               look::width - list_width, top - row, look::ink);
    write_window(out.window, path);
}

}  // namespace livetet
