#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "mechanics/materials/constitutive_model.hpp"

namespace livetet {

/// A constitutive model with parameters of its own, or none: what a material holds. A value: a copy
/// has its own parameters.
class ModelChoice {
  public:
    ModelChoice() = default;
    /// The registered model of that name with its default parameters. Throws Error where there is
    /// none.
    ModelChoice(std::string_view name);
    ModelChoice(const char* name) : ModelChoice(std::string_view(name)) {}
    /// A copy of a model with its parameters.
    ModelChoice(const ConstitutiveModel& model) : model_(model.clone()) {}

    ModelChoice(const ModelChoice& other) : model_(other ? other->clone() : nullptr) {}
    ModelChoice(ModelChoice&&) noexcept = default;
    ModelChoice& operator=(ModelChoice other) noexcept {
        model_ = std::move(other.model_);
        return *this;
    }

    explicit operator bool() const { return model_ != nullptr; }
    const ConstitutiveModel& operator*() const { return *model_; }
    const ConstitutiveModel* operator->() const { return model_.get(); }
    /// Empty where there is none.
    std::string_view name() const { return model_ ? model_->name() : std::string_view(); }

    /// Whether both are of one name, whatever their parameters.
    bool operator==(const ModelChoice& other) const { return name() == other.name(); }

    /// What it may be, for the visitors of field tables.
    static std::vector<ModelChoice> alternatives();
    std::string_view meaning() const { return model_->names().meaning; }
    void visit_keys(FieldVisitor& v) {
        if (model_) model_->visit_keys(v);
    }

  private:
    std::unique_ptr<ConstitutiveModel> model_;
};

/// Those of the alternatives that have no keys of their own, as a `choice` takes them.
std::vector<Choice<ModelChoice>> models_without_keys();

}  // namespace livetet
