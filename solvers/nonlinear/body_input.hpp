#pragma once

#include "mechanics/time_scheme.hpp"
#include "solvers/linear/linear_solver.hpp"

namespace livetet {

/// Checks what a program makes a DeformableBody from: PETSc runs; the hierarchy and the parts of
/// its tets fit each other; there are materials; the fields of materials and options are within the
/// limits that scenes have. Throws Error.
void check_body_input(const DistributedHierarchy& mesh, const ElasticModel& model,
                      const TimeOptions& time, const SolverOptions& options);

}  // namespace livetet
