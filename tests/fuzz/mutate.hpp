#pragma once

#include <random>

#include "fuzz/fuzz.hpp"

namespace livetet::fuzz {

/// Returns one of the seeds with a few changes: bits, bytes, extreme integers of either byte order,
/// extreme words in place of numbers, pieces cut out, duplicated or taken from another seed.
/// Deterministic for a state of `random`.
Bytes mutated(const std::vector<Bytes>& seeds, std::mt19937_64& random);

}  // namespace livetet::fuzz
