#include "apps/viewer/regions.hpp"

#include <vtkActor.h>
#include <vtkBoundingBox.h>
#include <vtkCellArray.h>
#include <vtkPoints.h>
#include <vtkPolyDataMapper.h>
#include <vtkPolyDataNormals.h>
#include <vtkProperty.h>

#include "apps/viewer/colours.hpp"

namespace livetet {

namespace {
constexpr double opacity = 0.55;
}  // namespace

RegionsView::RegionsView(vtkRenderWindow* window, vtkRenderer* organ)
    : organ_(organ), labels_(renderer_) {
    window->SetNumberOfLayers(2);
    renderer_->SetLayer(1);
    renderer_->InteractiveOff();
    renderer_->SetActiveCamera(organ->GetActiveCamera());
    renderer_->DrawOff();
    window->AddRenderer(renderer_);

    vtkNew<vtkPolyDataNormals> normals;
    normals->SetInputData(data_);
    normals->SplittingOff();
    normals->ConsistencyOff();
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputConnection(normals->GetOutputPort());
    vtkNew<vtkActor> actor;
    actor->SetMapper(mapper);
    actor->GetProperty()->SetColor(mark_colour::target[0], mark_colour::target[1],
                                   mark_colour::target[2]);
    actor->GetProperty()->SetAmbient(0.5);
    actor->GetProperty()->SetDiffuse(0.5);
    actor->GetProperty()->SetOpacity(opacity);
    actor->GetProperty()->BackfaceCullingOn();
    // Blended as it is drawn. VTK's pass for translucent actors would cost a third of a picture's
    // time; convex bodies without back faces do not need it.
    actor->ForceOpaqueOn();
    renderer_->AddActor(actor);
}

void RegionsView::show(const ShownMoment& moment) {
    renderer_->SetDraw(!moment.targets.empty());
    if (moment.targets.empty()) return;
    renderer_->SetViewport(organ_->GetViewport());
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    vtkNew<vtkCellArray> triangles;
    labels_.begin(moment.keeps_numbers);
    for (const ShownTarget& target : moment.targets) {
        const vtkIdType first = points->GetNumberOfPoints();
        for (const Vector3& x : target.region.nodes) {
            const Vector3 mm = 1e3 * x;
            points->InsertNextPoint(mm.data());
        }
        for (const auto& [a, b, c] : target.region.triangles) {
            const vtkIdType ids[3] = {first + a, first + b, first + c};
            triangles->InsertNextCell(3, ids);
        }
        labels_.put(target.position,
                    fmt::format("{} {:.1f} mm{}", target.name, 1e3 * target.radius_95,
                                target.is_incomplete ? "*" : ""),
                    mark_colour::target);
    }
    labels_.end();
    data_->SetPoints(points);
    data_->SetPolys(triangles);
}

void RegionsView::spread_labels(std::span<const LabelBox> taken) {
    if (renderer_->GetDraw()) labels_.spread(taken);
}

void RegionsView::fit_clipping_range() {
    vtkBoundingBox box(organ_->ComputeVisiblePropBounds());
    if (renderer_->GetDraw()) box.AddBox(vtkBoundingBox(data_->GetBounds()));
    double bounds[6];
    box.GetBounds(bounds);
    organ_->ResetCameraClippingRange(bounds);
}

}  // namespace livetet
