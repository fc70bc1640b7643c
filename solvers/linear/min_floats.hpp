#pragma once

#include <cstddef>

namespace livetet {

/// Minimum number of floats of a vector for which a further thread is woken.
constexpr std::size_t min_floats_per_thread = 1000;

}  // namespace livetet
