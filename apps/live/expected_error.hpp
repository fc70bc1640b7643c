#pragma once

#include "apps/live/registration_input.hpp"

namespace livetet {

/// Expected error of a rigid registration of these fiducials, whose `image_from_base` and `fle` are
/// set. A fiducial of weight w is localised with an isotropic error of FLE^2 / (3 w) an axis; one
/// of weight 0 is not part of the fit. The tip's error is included if it is known. Throws Error as
/// `registration_covariance` does.
ExpectedRegistrationError expected_error(const CollectedFiducials& fiducials);

}  // namespace livetet
