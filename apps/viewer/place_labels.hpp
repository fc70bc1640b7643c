#pragma once

#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkTextActor.h>

#include <string>
#include <vector>

#include "apps/plots/off_screen_window.hpp"
#include "apps/viewer/body.hpp"

namespace livetet {

/// Texts beside places of the organ, drawn over it. For each moment: `begin`, `put` for each text,
/// `end`.
class PlaceLabels {
  public:
    /// `renderer` must outlive it.
    explicit PlaceLabels(vtkRenderer* renderer) : renderer_(renderer) {}

    /// `keep_texts`: labels move, but their texts stay; see ShownMoment.
    void begin(bool keep_texts);
    void put(const Vector3& at, const std::string& text, const look::Colour& colour);
    /// Hides the labels that this moment does not have.
    void end();

  private:
    vtkTextActor* add();

    vtkRenderer* renderer_;
    bool keep_texts_ = false;
    std::size_t used_ = 0;
    std::vector<vtkSmartPointer<vtkTextActor>> labels_;
};

}  // namespace livetet
