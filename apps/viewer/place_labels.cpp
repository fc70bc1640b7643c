#include "apps/viewer/place_labels.hpp"

#include <vtkCoordinate.h>
#include <vtkNew.h>
#include <vtkTextProperty.h>

namespace livetet {

vtkTextActor* PlaceLabels::add() {
    // Not a billboard: one translucent actor makes VTK draw the view in several layers, a third
    // of a picture's time.
    auto actor = vtkSmartPointer<vtkTextActor>::New();
    vtkNew<vtkCoordinate> marked;
    marked->SetCoordinateSystemToWorld();
    actor->GetPositionCoordinate()->SetCoordinateSystemToViewport();
    actor->GetPositionCoordinate()->SetReferenceCoordinate(marked);
    actor->SetPosition(10, 8);  // pixels: beside its ball from any direction
    set_text(actor->GetTextProperty(), 13, TextWeight::bold);
    actor->GetTextProperty()->SetBackgroundColor(look::paper.data());
    actor->GetTextProperty()->SetBackgroundOpacity(0.6);
    renderer_->AddActor(actor);
    labels_.push_back(actor);
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

}  // namespace livetet
