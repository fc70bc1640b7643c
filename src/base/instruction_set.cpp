#include "base/instruction_set.hpp"

#include <Eigen/Core>

namespace livetet {

// A program and libraries of different instruction sets exchange classes with such members.
static_assert(alignof(Eigen::Vector4d) == 32,
              "expected livetet::abi, which sets Eigen's alignment");

std::string_view instruction_set() {
#if defined(__AVX512F__) && defined(__AVX512BW__) && defined(__AVX512CD__) && \
    defined(__AVX512DQ__) && defined(__AVX512VL__)
    return "x86-64-v4";
#elif defined(__AVX2__) && defined(__FMA__) && defined(__BMI2__)
    return "x86-64-v3";
#elif defined(__SSE4_2__)
    return "x86-64-v2";
#elif defined(__x86_64__)
    return "x86-64";
#else
    return "";
#endif
}

}  // namespace livetet
