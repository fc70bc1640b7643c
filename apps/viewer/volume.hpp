#pragma once

#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkVolume.h>

#include "apps/viewer/body.hpp"
#include "image/image_slice.hpp"

namespace livetet {

/// The image within the deformed organ as a cloud: a ray through each pixel, through voxels of at
/// most some hundred along a side, which are computed anew for each moment that is drawn. Hidden at
/// first, and then it costs nothing.
class VolumeView {
  public:
    /// `body` has to have an image and outlive it.
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
    vtkSmartPointer<vtkVolume> volume_;  ///< made when it is first seen
    BodySlice slice_;
};

}  // namespace livetet
