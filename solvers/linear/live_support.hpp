#pragma once

#include <string>

#include "solvers/linear/linear_solver.hpp"

namespace livetet {

/// Why LiveSolver cannot take a body: "found ..., expected ...". Empty where it can. It takes any
/// model in either form, on one rank, on the meshes that are named here. `hierarchy`: with its
/// quadratic level where the body has ten-node tets.
std::string why_not_live(const ElasticModel& model, const MeshHierarchy& hierarchy);

}  // namespace livetet
