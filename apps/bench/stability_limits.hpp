#pragma once

#include <string>

#include "apps/bench/stability_run.hpp"

namespace livetet {

/// Why a cell of `bench stability` that failed is known to; empty where it should not have. `cell`:
/// what became of case `c` in `column`.
std::string known_limit(const StabilityCase& c, const StabilityColumn& column,
                        const StabilityCell& cell);

}  // namespace livetet
