#pragma once

#include "apps/live/registration_input.hpp"

namespace livetet {

/// `livetet register --deform`: finds how an organ is deformed from points of its surface, and
/// writes the result as `livetet solve` does; with `live` while a tip is led over it. Returns the
/// exit status: 3 if it did not converge.
int register_deforming(RegisterArguments a);

}  // namespace livetet
