#pragma once

#include <vtkAxis.h>
#include <vtkChartXY.h>
#include <vtkContextActor.h>
#include <vtkContextScene.h>
#include <vtkNew.h>
#include <vtkPen.h>
#include <vtkPlot.h>
#include <vtkRenderer.h>

#include <array>
#include <string>
#include <vector>

#include "apps/plots/off_screen_window.hpp"

// Parts of pictures with charts.

namespace livetet {

struct ChartLine {
    std::string name;
    std::vector<double> x, y;
    look::Colour colour;
    float width = 2.5F;
    int pen = vtkPen::SOLID_LINE;
};

/// Adds a line, points or bars (`type` as in vtkChart) to a chart.
vtkPlot* add_plot(vtkChartXY* chart, int type, const ChartLine& line);

/// Fixes the range of an axis (`which` as in vtkAxis).
void set_axis(vtkChartXY* chart, int which, const std::string& title, double low, double high);

/// A chart in a rectangle of the window: x, y, width, height in pixels.
vtkSmartPointer<vtkChartXY> make_chart(vtkContextScene* scene, const std::string& title,
                                       const std::array<float, 4>& place);

void show_legend(vtkChartXY* chart);

/// A window that shows a scene of charts.
struct ChartWindow {
    vtkSmartPointer<vtkRenderWindow> window = make_window();
    vtkNew<vtkRenderer> renderer;
    vtkNew<vtkContextActor> actor;

    ChartWindow();
    vtkContextScene* scene() { return actor->GetScene(); }
};

}  // namespace livetet
