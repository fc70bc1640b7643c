#include "apps/viewer/organ.hpp"

#include <vtkPointData.h>
#include <vtkProperty.h>
#include <vtkTextProperty.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/plots/off_screen_window.hpp"
#include "mesh/barycentric_map.hpp"

namespace livetet {

namespace {
constexpr double bar_width = 0.1;
constexpr int bar_font = 13;

/// Of each node the point of its tet that is near to it.
BarycentricMap map_into_own(const TetMesh& mesh, const DrawnSurface& surface) {
    BarycentricMap map;
    map.nodes = surface.tets;
    for (std::size_t n = 0; n < surface.nodes.size(); ++n) {
        std::array<double, 4>& w =
            map.weights.emplace_back(weights_in(mesh, surface.tets[n], surface.nodes[n]));
        double sum = 0;
        for (double& part : w) sum += part = std::max(part, 0.0);
        for (double& part : w) part /= sum;
    }
    return map;
}

}  // namespace

OrganView::OrganView(const ShownBody& body, vtkRenderer* renderer) : body_(body) {
    for (vtkFloatArray* vectors : {places_.Get(), normals_.Get()})
        vectors->SetNumberOfComponents(3);
    vtkNew<vtkPoints> points;
    points->SetData(places_);
    data_->SetPoints(points);
    data_->GetPointData()->SetNormals(normals_);
    data_->GetPointData()->SetScalars(values_);
    take_surface();
    mapper_->SetInputData(data_);
    mapper_->UseLookupTableScalarRangeOn();
    mapper_->InterpolateScalarsBeforeMappingOn();
    mapper_->StaticOn();
    actor_->SetMapper(mapper_);
    actor_->GetProperty()->SetAmbient(0.35);
    actor_->GetProperty()->SetDiffuse(0.7);
    actor_->GetProperty()->BackfaceCullingOn();
    renderer->AddActor(actor_);

    bar_->SetNumberOfLabels(6);
    bar_->UnconstrainedFontSizeOn();
    bar_->SetOrientationToVertical();
    bar_->SetWidth(bar_width);
    bar_->SetHeight(0.6);
    bar_->SetBarRatio(0.25);
    set_text(bar_->GetLabelTextProperty(), bar_font);
    set_text(bar_->GetTitleTextProperty(), bar_font, TextWeight::bold);
    renderer->AddViewProp(bar_);
    update_bar();
}

void OrganView::take_surface() {
    const DrawnSurface& surface = body_.surface;
    map_ = surface.tets.empty() ? map_into(body_.mesh, surface.nodes)
                                : map_into_own(body_.mesh, surface);
    if (!body_.stated_places.empty()) stated_.emplace(body_.stated_places, surface.nodes);
    const auto count = static_cast<vtkIdType>(surface.nodes.size());
    for (vtkFloatArray* vectors : {places_.Get(), normals_.Get()})
        vectors->SetNumberOfTuples(count);
    values_->SetNumberOfTuples(count);
    vtkNew<vtkCellArray> triangles;
    for (const auto& [a, b, c] : surface.triangles) {
        const vtkIdType ids[3] = {a, b, c};
        triangles->InsertNextCell(3, ids);
    }
    data_->SetPolys(triangles);
}

void OrganView::set_range(ColourBy what, double largest) {
    largest_[static_cast<int>(what)] = largest;
    update_bar();
}

void OrganView::set_colour(ColourBy what) {
    colour_ = what;
    update_bar();
}

void OrganView::make_room(double width_pixels, const TextLayout& texts) {
    bar_->GetLabelTextProperty()->SetFontSize(texts.font_size(bar_font));
    bar_->GetTitleTextProperty()->SetFontSize(texts.font_size(bar_font));
    // Pixels: half the width of the title, which is centred on the bar.
    const double half_title = 55 * texts.scale;
    bar_->SetPosition(std::max(0.015, half_title / width_pixels - bar_width / 2), 0.2);
}

void OrganView::update_bar() {
    double largest = range(colour_);
    switch (colour_) {
        case ColourBy::displacement:
            bar_->SetTitle("displacement\n[mm]");
            largest = std::max(1e3 * largest, 0.1);
            break;
        case ColourBy::von_mises:
            bar_->SetTitle("von Mises\nstress [Pa]");
            largest = std::max(largest, 1e-3);
            break;
        case ColourBy::stated_error:
            bar_->SetTitle(lacks_sources_ ? "stated error*\n95 % radius\n[mm]"
                                          : "stated error\n95 % radius\n[mm]");
            largest = std::max(1e3 * largest, 0.1);
            break;
    }
    const auto map = organ_colours(largest);
    mapper_->SetLookupTable(map);
    bar_->SetLookupTable(map);
    bar_->SetLabelFormat(largest < 1 ? "%.2f" : largest < 100 ? "%.1f" : "%.0f");
}

bool OrganView::can_show(const ShownMoment& moment, ColourBy what) const {
    switch (what) {
        case ColourBy::displacement:
            return true;
        case ColourBy::von_mises:
            return !moment.von_mises.empty();
        case ColourBy::stated_error:
            return stated_ && !moment.stated.radius_95.empty();
    }
    return false;
}

double OrganView::value_at(std::size_t point, const Vector3& u, const ShownMoment& moment,
                           ColourBy what) const {
    switch (what) {
        case ColourBy::displacement:
            return 1e3 * u.norm();
        case ColourBy::von_mises: {
            double stress = 0;
            for (int k = 0; k < 4; ++k)
                stress += map_.weights[point][k] * moment.von_mises[map_.nodes[point][k]];
            return stress;
        }
        case ColourBy::stated_error:
            return 1e3 * (*stated_)(point, moment.stated.radius_95);
    }
    return 0;
}

void OrganView::show(const ShownMoment& moment) {
    const std::vector<Vector3>& rest = body_.surface.nodes;
    const ColourBy what = can_show(moment, colour_) ? colour_ : ColourBy::displacement;
    if (lacks_sources_ != !moment.stated.missing.empty()) {
        lacks_sources_ = !lacks_sources_;
        update_bar();
    }
    Eigen::Map<Eigen::Matrix3Xf> places(places_->GetPointer(0), 3,
                                        static_cast<Eigen::Index>(rest.size()));
    Eigen::Map<Eigen::Matrix3Xf> normals(normals_->GetPointer(0), 3,
                                         static_cast<Eigen::Index>(rest.size()));
    float* values = values_->GetPointer(0);
    for (std::size_t i = 0; i < rest.size(); ++i) {
        const Vector3 u = interpolate(map_, i, moment.displacement);
        places.col(static_cast<Eigen::Index>(i)) = (1e3 * (rest[i] + u)).cast<float>();
        values[i] = static_cast<float>(value_at(i, u, moment, what));
    }
    normals.setZero();
    for (const auto& [a, b, c] : body_.surface.triangles) {  // weighted by area
        const Eigen::Vector3f n =
            (places.col(b) - places.col(a)).cross(places.col(c) - places.col(a));
        normals.col(a) += n;
        normals.col(b) += n;
        normals.col(c) += n;
    }
    normals.colwise().normalize();
    for (vtkFloatArray* changed : {places_.Get(), normals_.Get(), values_.Get()})
        changed->Modified();
    data_->GetPoints()->Modified();
    data_->Modified();
}

}  // namespace livetet
