#pragma once

#include <vtkActor.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkTextActor.h>

#include "apps/plots/off_screen_window.hpp"
#include "apps/viewer/body.hpp"

namespace livetet {

/// Draws the marks on the organ: fixed nodes, sensors with their patches and their positions at
/// placement and now, tools with their tips, fiducials of image and tracker with their distance,
/// and the marker pulled by hand.
class MarksView {
  public:
    /// `body` must outlive it.
    MarksView(const ShownBody& body, vtkRenderer* renderer);
    void show(const ShownMoment& moment);

  private:
    struct Dots {
        vtkSmartPointer<vtkPolyData> places;
        vtkSmartPointer<vtkActor> actor;
    };
    enum class DotShape { square, ball };
    Dots add_dots(const look::Colour& colour, double size, DotShape shape);
    void label(std::size_t which, const Vector3& at, const std::string& text,
               const look::Colour& colour);

    const ShownBody& body_;
    vtkRenderer* renderer_;
    double ball_mm_;
    bool keeps_numbers_ = false;  ///< see ShownMoment
    Dots fixed_, patches_, bases_, sensors_, tips_, touched_, pulled_;
    vtkNew<vtkPolyData> lines_;
    std::vector<vtkSmartPointer<vtkTextActor>> labels_;
};

}  // namespace livetet
