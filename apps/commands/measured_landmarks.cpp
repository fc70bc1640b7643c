#include "apps/commands/measured_landmarks.hpp"

#include <algorithm>

#include "base/error.hpp"

namespace livetet {

std::vector<MeasuredLandmark> matched_landmarks(const RegisterArguments& a) {
    if (a.landmarks.empty()) return {};
    const std::vector<NamedPoint> at_rest = read_point_list(a.image);
    std::vector<MeasuredLandmark> matched;
    for (const NamedPoint& p : read_point_list(a.landmarks)) {
        const auto rest = std::ranges::find(at_rest, p.name, &NamedPoint::name);
        if (rest == at_rest.end())
            fail("{}: the landmark \"{}\" is not in {}, expected the same names",
                 a.landmarks.string(), p.name, a.image.string());
        matched.push_back({p.name, rest->position, p.position});
    }
    return matched;
}

void map_landmarks(const FiducialRegistration& registration,
                   std::vector<MeasuredLandmark>& landmarks) {
    for (MeasuredLandmark& l : landmarks) l.measured = registration.image_from_base * l.measured;
}

}  // namespace livetet
