#pragma once

#include <vtkActor.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>

#include "apps/plots/off_screen_window.hpp"
#include "apps/viewer/body.hpp"
#include "apps/viewer/place_labels.hpp"

namespace livetet {

/// Draws the marks on the organ: fixed nodes, sensors with their patches and their positions at
/// placement and now, tools with their tips, fiducials of image and tracker with their distance,
/// and the marker pulled by hand.
class MarksView {
  public:
    /// `body` must outlive it.
    MarksView(const ShownBody& body, vtkRenderer* renderer);
    void show(const ShownMoment& moment);
    /// A small window has labels of sensors alone. Takes effect at the next `show`.
    void set_texts(const TextLayout& texts);
    /// Where the labels are, in pixels of the view.
    std::vector<LabelBox> label_boxes() const { return labels_.boxes(); }

  private:
    struct Dots {
        vtkSmartPointer<vtkPolyData> places;
        vtkSmartPointer<vtkActor> actor;
    };
    enum class DotShape { square, ball };
    Dots add_dots(const look::Colour& colour, double size, DotShape shape);

    const ShownBody& body_;
    vtkRenderer* renderer_;
    PlaceLabels labels_;
    TextLayout texts_;
    double ball_mm_;
    Dots fixed_, patches_, bases_, sensors_, tips_, touched_, pulled_;
    vtkNew<vtkPolyData> lines_;
};

}  // namespace livetet
