#include "apps/viewer/volume.hpp"

#include <vtkColorTransferFunction.h>
#include <vtkDataArray.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPointData.h>
#include <vtkSmartVolumeMapper.h>
#include <vtkVolumeProperty.h>

#include <algorithm>
#include <cmath>

namespace livetet {

namespace {

constexpr int max_voxels = 96;  // along a side
constexpr float outside = -1,
                brightest = 255;  // a voxel is a grey value from 0 to brightest, or outside

}  // namespace

VolumeView::VolumeView(const ShownBody& body, vtkRenderer* renderer)
    : body_(body), renderer_(renderer), sampler_(*body.image) {}

void VolumeView::set_visible(bool visible) {
    is_visible_ = visible;
    if (visible && !volume_) {
        vtkNew<vtkSmartVolumeMapper> mapper;
        mapper->SetInputData(voxels_);
        vtkNew<vtkColorTransferFunction> colour;
        colour->AddRGBPoint(0, 0.25, 0.05, 0.03);
        colour->AddRGBPoint(0.5 * brightest, 0.75, 0.40, 0.30);
        colour->AddRGBPoint(brightest, 1, 0.97, 0.90);
        vtkNew<vtkPiecewiseFunction> opacity;
        opacity->AddPoint(outside, 0);
        opacity->AddPoint(0, 0.002);
        opacity->AddPoint(brightest, 0.08);
        volume_ = vtkSmartPointer<vtkVolume>::New();
        volume_->SetMapper(mapper);
        volume_->GetProperty()->SetColor(colour);
        volume_->GetProperty()->SetScalarOpacity(opacity);
        volume_->GetProperty()->SetScalarOpacityUnitDistance(4);
        volume_->GetProperty()->SetInterpolationTypeToLinear();
        volume_->GetProperty()->ShadeOff();
        renderer_->AddVolume(volume_);
    }
    if (volume_) volume_->SetVisibility(visible);
}

void VolumeView::show(const ShownMoment& moment) {
    if (!is_visible_) return;
    Eigen::AlignedBox3d box;
    for (std::size_t n = 0; n < body_.mesh.nodes.size(); ++n)
        box.extend(body_.mesh.nodes[n] + moment.displacement[n]);
    const double finest =
        ImageGrid{body_.image->size, body_.image->ras_from_voxel}.spacing().minCoeff();
    const double spacing = std::max(finest, box.sizes().maxCoeff() / max_voxels);
    const Eigen::Vector3i size = (box.sizes() / spacing).array().ceil().cast<int>() + 2;
    voxels_->SetDimensions(size.data());
    voxels_->SetSpacing(1e3 * spacing, 1e3 * spacing, 1e3 * spacing);
    voxels_->SetOrigin(Vector3(1e3 * box.min()).data());
    voxels_->AllocateScalars(VTK_FLOAT, 1);
    auto* values = static_cast<float*>(voxels_->GetScalarPointer());
    SlicePlane plane{box.min(), spacing * Vector3::UnitX(), spacing * Vector3::UnitY(), size.x(),
                     size.y()};
    float low = std::numeric_limits<float>::infinity(), high = -low;
    for (int k = 0; k < size.z(); ++k) {
        plane.origin.z() = box.min().z() + k * spacing;
        slice_body(body_.mesh, moment.displacement, plane, slice_);
        for (std::size_t p = 0; p < plane.size(); ++p) {
            float& value = values[p + plane.size() * static_cast<std::size_t>(k)];
            value = slice_.covers(p) ? sampler_(slice_.rest[p]) : std::nanf("");
            if (std::isnan(value)) continue;
            low = std::min(low, value);
            high = std::max(high, value);
        }
    }
    const float scale = high > low ? brightest / (high - low) : 0;
    for (float* v = values; v < values + plane.size() * static_cast<std::size_t>(size.z()); ++v)
        *v = std::isnan(*v) ? outside : scale * (*v - low);
    voxels_->GetPointData()->GetScalars()->Modified();
    voxels_->Modified();
}

}  // namespace livetet
