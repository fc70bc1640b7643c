#pragma once

#include <memory>
#include <vector>

#include "mechanics/materials/constitutive_model.hpp"

namespace livetet {

/// The constitutive models that scenes and programs can name, each with its default parameters:
/// those of registry.cpp, then those of register_material, in the order in which they were added.
std::vector<const ConstitutiveModel*> registered_materials();

/// The model of that name. Throws Error where there is none.
const ConstitutiveModel& registered_material(std::string_view name);

/// Adds a model of a program's own; its defaults are those of `model`. From then on scenes may name
/// it, and its keys are read, checked and documented like the others'. Not while bodies are made on
/// another thread. Throws Error where its name is taken, or its traits
/// contradict each other.
void register_material(std::unique_ptr<const ConstitutiveModel> model);

}  // namespace livetet
