#pragma once

#include <algorithm>
#include <span>

#include "base/error.hpp"
#include "config/fields.hpp"
#include "mechanics/materials/model_choice.hpp"

namespace livetet {

/// How the volumetric part of the energy is discretised. `displacement`: from the displacement
/// alone, which locks as Poisson's ratio nears 1/2. `mixed`: by a pressure of its own at the
/// corners of the tets.
enum class Formulation { automatic, displacement, mixed };

/// An elastic material: Lame's moduli, by Young's modulus and Poisson's ratio, and the constitutive
/// model that they are moduli of.
struct Material {
    Uncertain young_Pa = 3000;
    Uncertain poisson = 0.45;
    double density_kg_per_m3 = 1060;
    int region =
        0;  ///< the mesh's region label it is for; 0: every region that no other material names
    ModelChoice model{};  ///< none: the body's

    double lambda() const { return young_Pa * poisson / ((1 + poisson) * (1 - 2 * poisson)); }
    double mu() const { return young_Pa / (2 * (1 + poisson)); }
};

/// The material for a region of the mesh: the one that names it, else the one for region 0. Throws
/// Error where none is.
inline const Material& material_of(std::span<const Material> materials, int region) {
    const Material* otherwise = nullptr;
    for (const Material& m : materials) {
        if (m.region == region && region != 0) return m;
        if (m.region == 0) otherwise = &m;
    }
    if (!otherwise)
        fail(
            "materials has none for region {} of the mesh, expected one with region: {} or region: "
            "0",
            region, region);
    return *otherwise;
}

/// The constitutive model of a material in a body whose own model is `body`.
inline const ConstitutiveModel& model_of(const Material& material, const ModelChoice& body) {
    return material.model ? *material.model : *body;
}

/// Whether some material of such a body rotates with its elements.
inline bool has_corotated(std::span<const Material> materials, const ModelChoice& body) {
    return std::any_of(materials.begin(), materials.end(), [&](const Material& m) {
        return model_of(m, body).kinematics() == Kinematics::corotated;
    });
}

/// Whether all materials of such a body are of small strain.
inline bool is_small_strain(std::span<const Material> materials, const ModelChoice& body) {
    return std::all_of(materials.begin(), materials.end(), [&](const Material& m) {
        return model_of(m, body).kinematics() == Kinematics::small_strain;
    });
}

/// Whether the tangents of all materials of such a body are bounded in live frames.
inline bool is_bounded(std::span<const Material> materials, const ModelChoice& body) {
    return std::all_of(materials.begin(), materials.end(),
                       [&](const Material& m) { return model_of(m, body).is_bounded(); });
}

/// Ratio of the largest Young's modulus to the smallest. There is at least one material.
inline double contrast_of(std::span<const Material> materials) {
    double smallest = materials.front().young_Pa, largest = smallest;
    for (const Material& m : materials) {
        smallest = std::min<double>(smallest, m.young_Pa);
        largest = std::max<double>(largest, m.young_Pa);
    }
    return largest / smallest;
}

template <class Visitor>
void visit_fields(Visitor& v, Material& m) {
    v.field("young_Pa", m.young_Pa, "Pa", "Young's modulus; may have a spread: 3000 +- 600",
            greater_than<0, Uncertain>());
    v.field(
        "poisson", m.poisson, "", "Poisson's ratio; may have a spread: 0.45 +- 0.03",
        within<Uncertain>({-1, 0.5, Ends::excluded}, ", where the material is positive definite"));
    v.field("density_kg_per_m3", m.density_kg_per_m3, "kg/m^3", "mass density", greater_than<0>());
    v.field("region", m.region, "",
            "region label of the mesh this material is for; 0: all regions without a material of "
            "their own",
            at_least<0, int>());
    v.variant("model", m.model,
              "constitutive model of this material; default: the scene's `strain`");
}

}  // namespace livetet
