#include <algorithm>

#include "apps/live/tracked_body.hpp"

namespace livetet {

void TrackedBody::state_errors(std::unique_ptr<ErrorStatement> statement,
                               const std::optional<ExpectedRegistrationError>& registration) {
    restart_opening();
    stating_.restart();
    stating_.statement = std::move(statement);
    stating_.registration = registration;
    for (const Target& target : stating_.statement->targets())
        stating_.names.push_back(target.name);
}

/// Whether responses are of this sensor's patch: of markers pulled by hand where errors are stated.
bool TrackedBody::has_response(const Sensor& sensor) const {
    return !sensor.leaving && !sensor.patch.nodes().empty() &&
           (stating_.statement || sensor.by_hand == 0);
}

/// Lists the patches that responses are of. Returns whether these must be computed anew.
bool TrackedBody::renew_patches() {
    std::vector<const SensorPatch*>& patches = stating_.patches;
    auto known = patches.begin();
    for (const Sensor& s : sensors_)
        if (has_response(s) && (known == patches.end() || *known++ != &s.patch))
            stating_.is_outdated = true;
    if (!stating_.is_outdated && known == patches.end()) return false;
    patches.clear();
    for (const Sensor& s : sensors_)
        if (has_response(s)) patches.push_back(&s.patch);
    stating_.is_outdated = false;
    return true;
}

void TrackedBody::state_errors_of_frame() {
    if (!stating_.statement) {
        if (stating_.for_slips) renew_responses_for_slips();
        return;
    }
    if (renew_patches()) stating_.statement->start(stating_.patches, stating_.fix);
    const auto& reference = reference_follower_.used();
    const bool is_valid = frame_.registration == RegistrationStatus::valid;
    SolveErrors solve{.has_turned_elements = frame_.turned_elements > 0};
    if (body_.body->linear_solver().kind() == SolverKind::live && frame_.step.converged)
        solve.linear = frame_.step.linear_error;
    frame_.statement = stating_.statement->update(
        {.reference = reference && is_valid ? &*reference : nullptr,
         .image_from_reference = registration_.image_from_reference(),
         .registration = stating_.registration ? &*stating_.registration : nullptr,
         .is_unknown_elsewhere =
             sensors_.empty() || settling_.has_value() ||
             !std::ranges::all_of(sensors_, [&](const Sensor& s) { return has_response(s); })},
        stating_.patches, frame_.displacement, solve);
}

}  // namespace livetet
