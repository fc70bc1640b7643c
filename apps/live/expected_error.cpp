#include "apps/live/expected_error.hpp"

#include <cmath>

#include "geometry/registration_covariance.hpp"

namespace livetet {

ExpectedRegistrationError expected_error(const CollectedFiducials& fiducials) {
    const FiducialRegistration& r = fiducials.registration;
    FiducialErrors errors;
    for (const RegisteredFiducial& f : r.fiducials) {
        const double variance = r.fle * r.fle / (3 * f.weight);
        // A fiducial of weight 0 has no influence, whatever its error.
        errors.in_to.push_back((std::isfinite(variance) ? variance : 0) *
                               Eigen::Matrix3d::Identity());
    }
    if (fiducials.tip_covariance) {
        errors.tip = *fiducials.tip_covariance;
        errors.from_from_tool = fiducials.base_from_tool;
    }
    return {registration_covariance(places_in_base(r), r.image_from_base.rotation, errors,
                                    weights_of(r)),
            fiducials.tip_covariance.has_value()};
}

}  // namespace livetet
