#include <algorithm>

#include "apps/live/tracked_body.hpp"

namespace livetet {

void TrackedBody::state_errors(std::unique_ptr<ErrorStatement> statement,
                               const std::optional<ExpectedRegistrationError>& registration) {
    stating_ = {std::move(statement), {}, registration, {}, true};
    for (const Target& target : stating_.statement->targets())
        stating_.names.push_back(target.name);
}

void TrackedBody::state_errors_of_frame() {
    if (!stating_.statement) return;
    std::vector<const SensorPatch*>& patches = stating_.patches;
    const auto is_stated = [](const Sensor& s) { return !s.leaving && !s.patch.nodes().empty(); };
    auto known = patches.begin();
    for (const Sensor& s : sensors_)
        if (is_stated(s) && (known == patches.end() || *known++ != &s.patch))
            stating_.is_outdated = true;
    if (stating_.is_outdated || known != patches.end()) {
        patches.clear();
        for (const Sensor& s : sensors_)
            if (is_stated(s)) patches.push_back(&s.patch);
        stating_.statement->start(patches, scene_.fix);
        stating_.is_outdated = false;
    }
    const auto& reference = reference_follower_.used();
    const bool is_valid = frame_.registration == RegistrationStatus::valid;
    std::optional<double> solver_error;
    if (body_.body->linear_solver().kind() == SolverKind::live && frame_.step.converged)
        solver_error = frame_.step.linear_error;
    frame_.statement = stating_.statement->update(
        {.reference = reference && is_valid ? &*reference : nullptr,
         .image_from_reference = registration_.image_from_reference(),
         .registration = stating_.registration ? &*stating_.registration : nullptr,
         .is_unknown_elsewhere = sensors_.empty() || settling_.has_value() ||
                                 !std::ranges::all_of(sensors_, is_stated)},
        patches, frame_.displacement, solver_error);
}

}  // namespace livetet
