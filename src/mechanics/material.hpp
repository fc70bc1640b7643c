#pragma once

#include <algorithm>
#include <span>

#include "base/error.hpp"
#include "config/fields.hpp"

namespace livetet {

/// Which measure of strain the elements use; the energies stand in strain_energy.hpp. `linear`:
/// small strain (Cauchy). `corotated`: small strain in a frame that turns with each element.
/// `green`: Green's strain (St Venant-Kirchhoff). `neohookean`: rubber and tissue at large strain,
/// finite through inversion.
enum class StrainModel { linear, corotated, green, neohookean };

/// Which derivative of the stress an operator is made of. `held_rotation`: R K R^T, always positive
/// semi-definite (corotated; the other models have none and take `positive`). `exact`: the second
/// derivative of the energy. `positive`: the exact one with its negative eigenvalues, of each
/// quadrature point, set to zero.
enum class Tangent { held_rotation, exact, positive };

/// How the volumetric part of the energy is discretised. `displacement`: from the displacement
/// alone, which locks as Poisson's ratio nears 1/2. `mixed`: by a pressure of its own at the
/// corners of the tets.
enum class Formulation { automatic, displacement, mixed };

/// An isotropic elastic material.
struct Material {
    double young_Pa = 3000;
    double poisson = 0.45;
    double density_kg_per_m3 = 1060;
    int region =
        0;  ///< the mesh's region label it is for; 0: every region that no other material names

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

/// The largest of Young's moduli to the least.
inline double contrast_of(std::span<const Material> materials) {
    double least = materials.front().young_Pa, most = least;
    for (const Material& m : materials) {
        least = std::min(least, m.young_Pa);
        most = std::max(most, m.young_Pa);
    }
    return most / least;
}

template <class Visitor>
void visit_fields(Visitor& v, Material& m) {
    v.field("young_Pa", m.young_Pa, "Pa", "Young's modulus", greater_than<0>());
    v.field("poisson", m.poisson, "", "Poisson's ratio",
            Check<double>{"above -1 and below 0.5, where the material is positive definite",
                          [](const double& x) { return x > -1 && x < 0.5; }});
    v.field("density_kg_per_m3", m.density_kg_per_m3, "kg/m^3", "mass density", greater_than<0>());
    v.field("region", m.region, "",
            "region label of the mesh this material is for; 0: all that no other material names",
            at_least<0, int>());
}

}  // namespace livetet
