#include <vtkColorTransferFunction.h>
#include <vtkDoubleArray.h>
#include <vtkImageData.h>
#include <vtkPlotHistogram2D.h>
#include <vtkStringArray.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "apps/plots/chart_parts.hpp"
#include "apps/plots/pictures.hpp"

namespace livetet {

namespace {

constexpr int samples = 220;    // along each side of a panel
constexpr double enlarged = 3;  // width of an enlarged panel, diameters
constexpr float panel_width = 320,
                panel_height = 314;  // makes circles round: the axes take more width than height
constexpr int max_columns = 6;
constexpr look::Colour cross_colour{1.0, 0.75, 0.1}, circle_colour{0.95, 0.25, 0.2};

/// A square of a plane across one axis of the world: axis `u` to the right, `v` upwards; m.
struct Slice {
    int u, v;
    Vector3 centre;
    double half;
};

/// Linear interpolation; `outside` beyond the centres of the outermost voxels.
float value_at(const GreyImage& image, const Vector3& voxel, float outside) {
    Eigen::Vector3i low;
    Vector3 share;
    for (int k = 0; k < 3; ++k) {
        const double clamped = std::clamp(voxel[k], 0.0, image.size[k] - 1.0);
        if (std::abs(clamped - voxel[k]) > 0.5) return outside;
        low[k] = std::min(static_cast<int>(clamped), std::max(0, image.size[k] - 2));
        share[k] = clamped - low[k];
    }
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
        double weight = 1;
        std::array<int, 3> at;
        for (int k = 0; k < 3; ++k) {
            const bool upper = corner >> k & 1;
            weight *= upper ? share[k] : 1 - share[k];
            at[k] = std::min(low[k] + upper, image.size[k] - 1);
        }
        sum += weight * image.at(at[0], at[1], at[2]);
    }
    return static_cast<float>(sum);
}

/// Range of most voxels: black and white of the picture.
std::array<float, 2> grey_range(const GreyImage& image) {
    std::vector<float> some;
    const std::size_t stride = 1 + image.values.size() / 200000;
    for (std::size_t n = 0; n < image.values.size(); n += stride) some.push_back(image.values[n]);
    std::sort(some.begin(), some.end());
    const float low = some[some.size() / 100], high = some[some.size() - 1 - some.size() / 1000];
    return {low, std::max(high, low + 1)};
}

vtkSmartPointer<vtkImageData> sampled(const GreyImage& image, const Slice& slice, float outside) {
    const Eigen::Matrix4d voxel_from_ras = image.ras_from_voxel.inverse();
    auto pixels = vtkSmartPointer<vtkImageData>::New();
    pixels->SetDimensions(samples, samples, 1);
    pixels->SetOrigin(1e3 * (slice.centre[slice.u] - slice.half),
                      1e3 * (slice.centre[slice.v] - slice.half), 0);
    pixels->SetSpacing(2e3 * slice.half / samples, 2e3 * slice.half / samples, 1);
    pixels->AllocateScalars(VTK_FLOAT, 1);
    auto* to = static_cast<float*>(pixels->GetScalarPointer());
    for (int q = 0; q < samples; ++q)
        for (int p = 0; p < samples; ++p) {
            Vector3 x = slice.centre;
            x[slice.u] += slice.half * ((2 * p + 1.0) / samples - 1);
            x[slice.v] += slice.half * ((2 * q + 1.0) / samples - 1);
            *to++ = value_at(image, (voxel_from_ras * x.homogeneous()).head<3>(), outside);
        }
    return pixels;
}

/// A cross-hair that leaves the marker's centre free, and the circle that the marker should fill.
void add_marks(vtkChartXY* chart, const Slice& s, const Vector3& marker, double radius) {
    const double u = 1e3 * marker[s.u], v = 1e3 * marker[s.v], gap = 0.25e3 * radius;
    for (const double side : {-1.0, 1.0}) {
        const double u_end = 1e3 * (s.centre[s.u] + side * s.half),
                     v_end = 1e3 * (s.centre[s.v] + side * s.half);
        add_plot(chart, vtkChart::LINE, {"", {u + side * gap, u_end}, {v, v}, cross_colour, 1});
        add_plot(chart, vtkChart::LINE, {"", {u, u}, {v + side * gap, v_end}, cross_colour, 1});
    }
    ChartLine circle{"", {}, {}, circle_colour, 1.5F};
    for (int k = 0; k <= 72; ++k) {
        const double angle = k * std::numbers::pi / 36;
        circle.x.push_back(u + 1e3 * radius * std::cos(angle));
        circle.y.push_back(v + 1e3 * radius * std::sin(angle));
    }
    add_plot(chart, vtkChart::LINE, circle);
}

/// An axis in mm, with ticks at round numbers.
void set_mm_axis(vtkChartXY* chart, int which, const char* name, double low, double high) {
    set_axis(chart, which, name, low, high);
    vtkAxis* axis = chart->GetAxis(which);
    set_text(axis->GetTitleProperties(), 13);
    set_text(axis->GetLabelProperties(), 12);
    axis->SetGridVisible(false);
    const double rough = (high - low) / 5, decade = std::pow(10, std::floor(std::log10(rough)));
    const double step = decade * (rough > 5 * decade ? 10 : rough > 2 * decade ? 5 : 2);
    vtkNew<vtkDoubleArray> ticks;
    vtkNew<vtkStringArray> labels;
    for (double tick = std::ceil(low / step) * step; tick <= high; tick += step) {
        ticks->InsertNextValue(tick);
        labels->InsertNextValue(fmt::format("{:g}", tick + 0.0));
    }
    axis->SetCustomTickPositions(ticks, labels);
}

void add_panel(vtkContextScene* scene, const GreyImage& image, const Slice& slice,
               const Vector3& marker, double radius, const std::array<float, 2>& range,
               const std::string& title, const std::array<float, 4>& place) {
    constexpr const char* names[] = {"x (R) [mm]", "y (A) [mm]", "z (S) [mm]"};
    const auto chart = make_chart(scene, title, place);
    vtkNew<vtkColorTransferFunction> greys;
    greys->AddRGBPoint(range[0], 0, 0, 0);
    greys->AddRGBPoint(range[1], 1, 1, 1);
    greys->Build();
    vtkNew<vtkPlotHistogram2D> pixels;
    pixels->SetInputData(sampled(image, slice, range[0]));
    pixels->SetTransferFunction(greys);
    chart->AddPlot(pixels);
    add_marks(chart, slice, marker, radius);
    set_text(chart->GetTitleProperties(), 15, TextWeight::bold);
    for (const auto& [which, axis] :
         {std::pair(vtkAxis::BOTTOM, slice.u), std::pair(vtkAxis::LEFT, slice.v)})
        set_mm_axis(chart, which, names[axis], 1e3 * (slice.centre[axis] - slice.half),
                    1e3 * (slice.centre[axis] + slice.half));
}

/// The slice across z through the whole image at a marker.
Slice whole(const GreyImage& image, const Vector3& marker) {
    Eigen::AlignedBox3d box;
    for (int corner = 0; corner < 8; ++corner) {
        Eigen::Vector4d voxel(0, 0, 0, 1);
        for (int k = 0; k < 3; ++k) voxel[k] = corner >> k & 1 ? image.size[k] - 1 : 0;
        box.extend(Vector3((image.ras_from_voxel * voxel).head<3>()));
    }
    Vector3 centre = box.center();
    centre.z() = marker.z();
    return {0, 1, centre, box.sizes().head<2>().maxCoeff() / 2};
}

}  // namespace

void write_marker_picture(const std::filesystem::path& path, const GreyImage& image,
                          std::span<const ImageMarker> markers, double diameter) {
    const int count = static_cast<int>(markers.size()), columns = std::min(count, max_columns);
    const int bands = (count + max_columns - 1) / max_columns;
    const auto height = static_cast<float>(4 * bands) * panel_height;
    ChartWindow out;
    out.window->SetSize(static_cast<int>(panel_width) * columns, static_cast<int>(height));
    const std::array<float, 2> range = grey_range(image);
    const double half = enlarged / 2 * diameter, radius = diameter / 2;
    for (int m = 0; m < count; ++m) {
        const ImageMarker& marker = markers[static_cast<std::size_t>(m)];
        const Vector3 c = marker.centre, mm = 1e3 * c;
        const Slice slices[] = {whole(image, c), {0, 1, c, half}, {0, 2, c, half}, {1, 2, c, half}};
        const std::string titles[] = {fmt::format("M{}: fit {:.3f}, +- {:.2f} mm", m + 1,
                                                  marker.fit, 1e3 * marker.uncertainty),
                                      fmt::format("z = {:.2f} mm", mm.z()),
                                      fmt::format("y = {:.2f} mm", mm.y()),
                                      fmt::format("x = {:.2f} mm", mm.x())};
        for (int row = 0; row < 4; ++row)
            add_panel(out.scene(), image, slices[row], c, radius, range, titles[row],
                      {panel_width * static_cast<float>(m % max_columns),
                       height - panel_height * static_cast<float>(4 * (m / max_columns) + row + 1),
                       panel_width, panel_height});
    }
    write_window(out.window, path);
}

}  // namespace livetet
