#pragma once

#include "apps/live/registration_input.hpp"

namespace livetet {

/// `livetet register --materials`: finds material values of a scene from landmarks of the loaded
/// body. Returns the exit status: 3 if it did not converge.
int register_materials(const RegisterArguments& a);

}  // namespace livetet
