#include "apps/verification/hyperelastic_forms.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace livetet::verification {
namespace {

/// At nu near 1/2 a material's own states are those of the incompressible closed forms.
TEST(HyperelasticForms, MooneyRivlinNearsTheIncompressibleClosedForms) {
    const Isotropic m{1, 0.4999999, 1};
    const double c01 = 0.3 * m.mu() / 2, c10 = m.mu() / 2 - c01;
    const PrincipalStress stress = mooney_rivlin(m, 0.3);
    for (const double l : {0.7, 1.2, 2.0}) {
        EXPECT_NEAR(uniaxial(stress, l).P11, incompressible_uniaxial(c10, c01, l), 1e-5);
        EXPECT_NEAR(uniaxial(stress, l).lateral, 1 / std::sqrt(l), 1e-5);
        EXPECT_NEAR(equibiaxial(stress, l).P11, incompressible_equibiaxial(c10, c01, l), 2e-5);
    }
}

TEST(HyperelasticForms, SmallStretchesAreHookesLaw) {
    const Isotropic m{2, 0.3, 1};
    const FreeState state = uniaxial(mooney_rivlin(m, 0.4), 1 + 1e-5);
    EXPECT_NEAR(state.P11, 2e-5, 1e-9);
    EXPECT_NEAR(state.lateral, 1 - 0.3e-5, 1e-9);
}

/// Fibres add 2 l k1 E exp(k2 E^2) along x, E = l^2 - 1 = 0.69, and nothing across.
TEST(HyperelasticForms, FibresAddTheirClosedForm) {
    const Isotropic m{1, 0.3, 1};
    const FreeState with = uniaxial(holzapfel_gasser_ogden(m, {.k1 = 0.5, .k2 = 2}), 1.3),
                    without = uniaxial(holzapfel_gasser_ogden(m, {.k1 = 0}), 1.3);
    EXPECT_NEAR(with.P11 - without.P11, 2 * 1.3 * 0.5 * 0.69 * std::exp(2 * 0.69 * 0.69), 1e-12);
    EXPECT_NEAR(with.lateral, without.lateral, 1e-12);
}

}  // namespace
}  // namespace livetet::verification
