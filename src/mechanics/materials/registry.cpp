#include "mechanics/materials/registry.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "base/error.hpp"
#include "mechanics/materials/corotated.hpp"
#include "mechanics/materials/green.hpp"
#include "mechanics/materials/holzapfel_gasser_ogden.hpp"
#include "mechanics/materials/linear.hpp"
#include "mechanics/materials/mooney_rivlin.hpp"
#include "mechanics/materials/neohookean.hpp"

namespace livetet {

namespace {

using Models = std::vector<std::unique_ptr<const ConstitutiveModel>>;

Models models_of_livetet() {
    Models models;
    models.push_back(std::make_unique<Linear>());
    models.push_back(std::make_unique<Corotated>());
    models.push_back(std::make_unique<Green>());
    models.push_back(std::make_unique<NeoHookean>());
    models.push_back(std::make_unique<MooneyRivlin>());
    models.push_back(std::make_unique<HolzapfelGasserOgden>());
    return models;
}

Models& models() {
    static Models all = models_of_livetet();
    return all;
}

const ConstitutiveModel* find(std::string_view name) {
    for (const auto& model : models())
        if (model->name() == name) return model.get();
    return nullptr;
}

}  // namespace

std::vector<const ConstitutiveModel*> registered_materials() {
    std::vector<const ConstitutiveModel*> all;
    for (const auto& model : models()) all.push_back(model.get());
    return all;
}

const ConstitutiveModel& registered_material(std::string_view name) {
    if (const ConstitutiveModel* model = find(name)) return *model;
    std::vector<std::string_view> names;
    for (const auto& model : models()) names.push_back(model->name());
    fail("constitutive model {}: found none of that name, expected one of {}", name,
         fmt::join(names, ", "));
}

void register_material(std::unique_ptr<const ConstitutiveModel> model) {
    if (find(model->name()))
        fail("constitutive model {}: found one of that name already, expected another name",
             model->name());
    if (model->is_hooke_by_rotation() && model->kinematics() == Kinematics::finite_strain)
        fail(
            "constitutive model {}: found Hooke's law by the rotation and finite strain, expected "
            "small strain or corotated kinematics",
            model->name());
    models().push_back(std::move(model));
}

}  // namespace livetet
