#include "apps/viewer/organ.hpp"

#include <vtkPointData.h>
#include <vtkProperty.h>
#include <vtkTextProperty.h>

#include <algorithm>

#include "apps/plots/off_screen_window.hpp"

namespace livetet {

namespace {
constexpr double bar_width = 0.1;
}  // namespace

OrganView::OrganView(const ShownBody& body, vtkRenderer* renderer)
    : body_(body), map_(map_into(body.mesh, body.surface.nodes)) {
    const auto count = static_cast<vtkIdType>(body.surface.nodes.size());
    for (vtkFloatArray* vectors : {places_.Get(), normals_.Get()}) {
        vectors->SetNumberOfComponents(3);
        vectors->SetNumberOfTuples(count);
    }
    values_->SetNumberOfTuples(count);
    vtkNew<vtkPoints> points;
    points->SetData(places_);
    vtkNew<vtkCellArray> triangles;
    for (const auto& [a, b, c] : body.surface.triangles) {
        const vtkIdType ids[3] = {a, b, c};
        triangles->InsertNextCell(3, ids);
    }
    data_->SetPoints(points);
    data_->SetPolys(triangles);
    data_->GetPointData()->SetNormals(normals_);
    data_->GetPointData()->SetScalars(values_);
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
    set_text(bar_->GetLabelTextProperty(), 13);
    set_text(bar_->GetTitleTextProperty(), 13, TextWeight::bold);
    renderer->AddViewProp(bar_);
    update_bar();
}

void OrganView::set_range(ColourBy what, double largest) {
    largest_[static_cast<int>(what)] = largest;
    update_bar();
}

void OrganView::set_colour(ColourBy what) {
    colour_ = what;
    update_bar();
}

void OrganView::make_room(double width_pixels) {
    constexpr double half_title =
        55;  // pixels: half the width of the title, which is centred on the bar
    bar_->SetPosition(std::max(0.015, half_title / width_pixels - bar_width / 2), 0.2);
}

void OrganView::update_bar() {
    const bool is_stress = colour_ == ColourBy::von_mises;
    const double largest =
        is_stress ? std::max(largest_[1], 1e-3) : std::max(1e3 * largest_[0], 0.1);
    const auto map = organ_colours(largest);
    mapper_->SetLookupTable(map);
    bar_->SetLookupTable(map);
    bar_->SetTitle(is_stress ? "von Mises\nstress [Pa]" : "displacement\n[mm]");
    bar_->SetLabelFormat(largest < 1 ? "%.2f" : largest < 100 ? "%.1f" : "%.0f");
}

void OrganView::show(const ShownMoment& moment) {
    const std::vector<Vector3>& rest = body_.surface.nodes;
    const bool is_stress = colour_ == ColourBy::von_mises && !moment.von_mises.empty();
    Eigen::Map<Eigen::Matrix3Xf> places(places_->GetPointer(0), 3,
                                        static_cast<Eigen::Index>(rest.size()));
    Eigen::Map<Eigen::Matrix3Xf> normals(normals_->GetPointer(0), 3,
                                         static_cast<Eigen::Index>(rest.size()));
    float* values = values_->GetPointer(0);
    for (std::size_t i = 0; i < rest.size(); ++i) {
        const Vector3 u = interpolate(map_, i, moment.displacement);
        places.col(static_cast<Eigen::Index>(i)) = (1e3 * (rest[i] + u)).cast<float>();
        values[i] = static_cast<float>(1e3 * u.norm());
        if (!is_stress) continue;
        values[i] = 0;
        for (int k = 0; k < 4; ++k)
            values[i] +=
                static_cast<float>(map_.weights[i][k] * moment.von_mises[map_.nodes[i][k]]);
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
