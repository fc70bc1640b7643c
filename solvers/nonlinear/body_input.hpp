#pragma once

#include "mechanics/time_scheme.hpp"
#include "solvers/linear/linear_solver.hpp"

namespace livetet {

/// Checks what a program makes a DeformableBody from, beside its mesh: there are materials; the
/// fields of materials and options are within the limits that scenes have. Throws Error.
void check_body_input(const ElasticModel& model, const TimeOptions& time,
                      const SolverOptions& options);

}  // namespace livetet
