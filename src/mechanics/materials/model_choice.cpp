#include "mechanics/materials/model_choice.hpp"

#include "mechanics/materials/registry.hpp"

namespace livetet {

ModelChoice::ModelChoice(std::string_view name) : ModelChoice(registered_material(name)) {}

std::vector<ModelChoice> ModelChoice::alternatives() {
    std::vector<ModelChoice> all;
    for (const ConstitutiveModel* model : registered_materials()) all.emplace_back(*model);
    return all;
}

std::vector<Choice<ModelChoice>> models_without_keys() {
    std::vector<Choice<ModelChoice>> choices;
    for (ModelChoice& model : ModelChoice::alternatives())
        if (keys_of(model).empty()) choices.push_back({model, model.name(), model.meaning()});
    return choices;
}

}  // namespace livetet
