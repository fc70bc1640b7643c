#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/simulation/deforming_registration.hpp"
#include "io/registration_file.hpp"
#include "io/result_file.hpp"

namespace livetet {

/// A list of points of an organ that moves on, fitted from the state before.
struct LaterFit {
    std::string source;
    double time_s = 0;  ///< of its frame in the result
    std::size_t points = 0;
    DeformedOrgan found;
    bool goes_on = false;  ///< its iterations were used up: the next list's fit goes on
    double seconds = 0;    ///< that it took: fit, errors, equilibrium
    double settled_s = 0;  ///< the last list: until it was fitted to its end, if that took longer
};

/// Lists of points, mapped into the image.
std::vector<MeasuredOrgan> read_later_points(
    const std::vector<std::string>& files, const std::optional<FiducialRegistration>& registration);

/// Fits each list from the state before, in `deform.later_iterations` at most; the last one goes on
/// from there to its end. Appends each as a frame, a second after the one before; the first is at
/// `start_s` + 1. `writer`: may be null. The body is left in the last state. Throws Error as
/// DeformingRegistration::finish does.
std::vector<LaterFit> fit_later(const std::vector<MeasuredOrgan>& lists, double start_s,
                                const Scene& scene, const SceneBody& body,
                                DeformingRegistration& registering, ResultWriter* writer,
                                const ProgressCallback& progress);

nlohmann::json describe_later(const LaterFit& fit);

/// A table, a line a list; nothing where there is none.
void print_later(const std::vector<LaterFit>& fits);

}  // namespace livetet
