#pragma once

#include <cstddef>

namespace livetet {

/// Least number of single-precision components for which a further thread is woken.
constexpr std::size_t single_grain = 1000;

}  // namespace livetet
