#pragma once

#include "mechanics/materials/constitutive_model.hpp"

namespace livetet {

/// Factors of the terms of an operator,
///     A = stiffness K + damping K_d + mass M,
/// where K is the tangent stiffness at a configuration that is passed beside it, K_d the stiffness
/// that damps (see LevelAssembler::keep_damping), and M the lumped mass.
struct OperatorTerms {
    double stiffness = 1;
    double mass = 0;  ///< 1/s^2; 0 where no mass was found
    Tangent tangent = Tangent::frozen_rotation;
    double damping = 0;  ///< 0 where no K_d is kept

    /// Factor of K where K_d is taken to be K.
    double whole_stiffness() const { return stiffness + damping; }
};

/// How much of the finest level's operator a renewal covers; the other half is left as it is.
enum class RenewalExtent { whole, half };

}  // namespace livetet
