#include "apps/viewer/place_labels.hpp"

#include <vtkCoordinate.h>
#include <vtkNew.h>
#include <vtkTextProperty.h>

#include <cmath>
#include <string_view>

namespace livetet {

namespace {
constexpr double beside[2] = {10, 8};  // pixels: beside its ball from any direction
}  // namespace

vtkTextActor* PlaceLabels::add() {
    // Not a billboard: one translucent actor makes VTK draw the view in several layers, a third
    // of a picture's time.
    auto actor = vtkSmartPointer<vtkTextActor>::New();
    vtkNew<vtkCoordinate> marked;
    marked->SetCoordinateSystemToWorld();
    actor->GetPositionCoordinate()->SetCoordinateSystemToViewport();
    actor->GetPositionCoordinate()->SetReferenceCoordinate(marked);
    actor->SetPosition(beside[0], beside[1]);
    set_text(actor->GetTextProperty(), font_size_, TextWeight::bold);
    actor->GetTextProperty()->SetBackgroundColor(look::paper.data());
    actor->GetTextProperty()->SetBackgroundOpacity(0.6);
    renderer_->AddActor(actor);
    labels_.push_back(actor);
    raised_.push_back(0);
    return actor;
}

void PlaceLabels::begin(bool keep_texts) {
    keep_texts_ = keep_texts;
    used_ = 0;
}

void PlaceLabels::put(const Vector3& at, const std::string& text, const look::Colour& colour) {
    vtkTextActor* actor = used_ < labels_.size() ? labels_[used_].Get() : add();
    ++used_;
    if (!actor->GetInput() || (!keep_texts_ && text != actor->GetInput()))
        actor->SetInput(text.c_str());
    actor->GetTextProperty()->SetColor(colour[0], colour[1], colour[2]);
    actor->GetPositionCoordinate()->GetReferenceCoordinate()->SetValue(1e3 * at.x(), 1e3 * at.y(),
                                                                       1e3 * at.z());
    actor->VisibilityOn();
}

void PlaceLabels::end() {
    for (std::size_t i = used_; i < labels_.size(); ++i) labels_[i]->VisibilityOff();
}

void PlaceLabels::set_font_size(int pixels) {
    font_size_ = pixels;
    for (const auto& label : labels_) label->GetTextProperty()->SetFontSize(pixels);
}

std::vector<LabelBox> PlaceLabels::boxes() const {
    constexpr double letter_width = 0.56, line_height = 1.25;  // in font sizes
    std::vector<LabelBox> boxes;
    for (std::size_t i = 0; i < used_; ++i) {
        const int* at = labels_[i]->GetPositionCoordinate()->GetComputedViewportValue(renderer_);
        const auto letters = static_cast<double>(std::string_view(labels_[i]->GetInput()).size());
        boxes.push_back({static_cast<double>(at[0]), at[1] - raised_[i],
                         letter_width * font_size_ * letters, std::ceil(line_height * font_size_)});
    }
    return boxes;
}

void PlaceLabels::spread(std::span<const LabelBox> taken) {
    const std::vector<LabelBox> from = boxes();
    std::vector<LabelBox> to = from;
    spread_labels(to, taken);
    for (std::size_t i = 0; i < to.size(); ++i) {
        const double raised = to[i].bottom - from[i].bottom;
        if (raised == raised_[i]) continue;
        raised_[i] = raised;
        labels_[i]->SetPosition(beside[0], beside[1] + raised);
    }
}

}  // namespace livetet
