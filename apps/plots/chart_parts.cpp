#include "apps/plots/chart_parts.hpp"

#include <vtkChartLegend.h>
#include <vtkDoubleArray.h>
#include <vtkTable.h>

#include <algorithm>

namespace livetet {

namespace {

vtkSmartPointer<vtkTable> table_of(const ChartLine& line) {
    auto table = vtkSmartPointer<vtkTable>::New();
    vtkNew<vtkDoubleArray> x, y;
    x->SetName("x");
    y->SetName(line.name.c_str());
    const std::size_t rows =
        line.x.size() == 1 ? 2 : line.x.size();  // VTK reports an error for a line of one point
    for (std::size_t i = 0; i < rows; ++i) {
        x->InsertNextValue(line.x[std::min(i, line.x.size() - 1)]);
        y->InsertNextValue(line.y[std::min(i, line.x.size() - 1)]);
    }
    table->AddColumn(x);
    table->AddColumn(y);
    return table;
}

}  // namespace

vtkPlot* add_plot(vtkChartXY* chart, int type, const ChartLine& line) {
    vtkPlot* plot = chart->AddPlot(type);
    const auto table = table_of(line);
    plot->SetInputData(table, 0, 1);
    plot->SetColor(line.colour[0], line.colour[1], line.colour[2]);
    plot->SetWidth(line.width);
    plot->GetPen()->SetLineType(line.pen);
    plot->SetLabel(line.name);
    return plot;
}

void set_axis(vtkChartXY* chart, int which, const std::string& title, double low, double high) {
    vtkAxis* axis = chart->GetAxis(which);
    axis->SetVisible(true);
    axis->SetTitle(title);
    axis->SetBehavior(vtkAxis::FIXED);
    axis->SetRange(low, high);
    set_text(axis->GetTitleProperties(), look::label_size);
    set_text(axis->GetLabelProperties(), look::tick_size);
    axis->GetGridPen()->SetColorF(0.88, 0.88, 0.9);
}

vtkSmartPointer<vtkChartXY> make_chart(vtkContextScene* scene, const std::string& title,
                                       const std::array<float, 4>& place) {
    auto chart = vtkSmartPointer<vtkChartXY>::New();
    chart->SetAutoSize(false);
    chart->SetSize(vtkRectf(place[0], place[1], place[2], place[3]));
    chart->SetTitle(title);
    set_text(chart->GetTitleProperties(), look::title_size, TextWeight::bold);
    scene->AddItem(chart);
    return chart;
}

void show_legend(vtkChartXY* chart) {
    chart->SetShowLegend(true);
    vtkChartLegend* legend = chart->GetLegend();
    set_text(legend->GetLabelProperties(), look::tick_size);
    legend->SetHorizontalAlignment(vtkChartLegend::RIGHT);
    legend->SetVerticalAlignment(vtkChartLegend::TOP);
    legend->SetSymbolWidth(50);
}

ChartWindow::ChartWindow() {
    renderer->SetBackground(look::paper.data());
    window->AddRenderer(renderer);
    renderer->AddActor(actor);
    actor->GetScene()->SetRenderer(renderer);
}

}  // namespace livetet
