#pragma once

#include <string>
#include <vector>

#include "apps/live/error_statement.hpp"
#include "apps/simulation/deforming_registration.hpp"
#include "io/result_file.hpp"

namespace livetet {

/// The error at the targets, as a frame states it. Of a fit that did not converge every source is
/// missing.
FrameStatement statement_of(const DeformedOrgan& found, PointFrame frame);

std::vector<std::string> names_of_targets(const DeformedOrgan& found);

/// Appends the body's present state and the statement as a frame of the result.
void append_found(ResultWriter& writer, const Scene& scene, const SceneBody& body,
                  const DeformedOrgan& found, double time_s);

}  // namespace livetet
