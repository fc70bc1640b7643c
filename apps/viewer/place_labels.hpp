#pragma once

#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkTextActor.h>

#include <span>
#include <string>
#include <vector>

#include "apps/plots/off_screen_window.hpp"
#include "apps/viewer/body.hpp"
#include "apps/viewer/text_layout.hpp"

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

    void set_font_size(int pixels);
    /// Where the labels are, before `spread`, in pixels of the view. Their widths are estimated
    /// from the numbers of letters: measuring them would draw them.
    std::vector<LabelBox> boxes() const;
    /// Moves labels that hide each other, or one of `taken`, up. Call it before each picture.
    void spread(std::span<const LabelBox> taken);

  private:
    vtkTextActor* add();

    vtkRenderer* renderer_;
    bool keep_texts_ = false;
    std::size_t used_ = 0;
    int font_size_ = 13;  ///< pixels
    std::vector<vtkSmartPointer<vtkTextActor>> labels_;
    std::vector<double> raised_;  ///< by how much `spread` moved each label up, pixels
};

}  // namespace livetet
