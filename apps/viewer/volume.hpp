#pragma once

#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkVolume.h>

#include "apps/viewer/body.hpp"
#include "image/image_slice.hpp"

namespace livetet {

/// Draws the image within the deformed organ by volume rendering, from about a hundred voxels along
/// a side that are computed for each drawn moment. Hidden at first, when it costs nothing.
class VolumeView {
  public:
    /// `body` must have an image and outlive it.
    VolumeView(const ShownBody& body, vtkRenderer* renderer);
    void show(const ShownMoment& moment);
    void set_visible(bool visible);
    bool is_visible() const { return is_visible_; }

  private:
    const ShownBody& body_;
    vtkRenderer* renderer_;
    ImageSampler sampler_;
    bool is_visible_ = false;
    vtkNew<vtkImageData> voxels_;
    vtkSmartPointer<vtkVolume> volume_;  ///< created when first shown
    BodySlice slice_;
};

}  // namespace livetet
