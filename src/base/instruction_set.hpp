#pragma once

#include <string_view>

namespace livetet {

/// The level of x86-64 that the numerical libraries of this process were compiled for, as compiler
/// and loader name them: x86-64 (SSE2), x86-64-v2, -v3 (AVX2, fused multiply-add) or -v4 (AVX-512).
/// Empty on other processors. A build with LIVETET_DISPATCH has libraries of several levels, and
/// the loader takes the best that the processor has.
std::string_view instruction_set();

}  // namespace livetet
