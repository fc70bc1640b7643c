#pragma once

#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>

#include "apps/viewer/body.hpp"
#include "apps/viewer/place_labels.hpp"

namespace livetet {

/// Draws the 95 % ellipsoids of the targets, translucent, with name and radius. Targets lie inside
/// the organ: a layer of its own, over the organ's, shows them.
class RegionsView {
  public:
    /// `organ`: the renderer of the organ. Both must outlive it.
    RegionsView(vtkRenderWindow* window, vtkRenderer* organ);

    void show(const ShownMoment& moment);
    /// Lets the camera see the organ and all ellipsoids. Call it before each picture.
    void fit_clipping_range();
    void set_font_size(int pixels) { labels_.set_font_size(pixels); }
    /// Moves labels that hide each other, or one of `taken`, up. Call it before each picture.
    void spread_labels(std::span<const LabelBox> taken);

  private:
    vtkRenderer* organ_;
    vtkNew<vtkRenderer> renderer_;
    vtkNew<vtkPolyData> data_;
    PlaceLabels labels_;
};

}  // namespace livetet
