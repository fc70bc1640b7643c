#pragma once

#include <random>

#include "fuzz/fuzz.hpp"

namespace livetet::fuzz {

/// One of the seeds with a few changes: bits, bytes, extreme integers of either byte order, extreme
/// words in place of numbers, pieces cut out, doubled or taken from another seed. The same for the
/// same state of `random`.
Bytes mutated(const std::vector<Bytes>& seeds, std::mt19937_64& random);

}  // namespace livetet::fuzz
