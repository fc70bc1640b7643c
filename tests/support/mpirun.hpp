#pragma once

#include <fmt/format.h>

#include <string>

namespace livetet::test {

/// What starts a program on several ranks, and ends it after five minutes; nothing for one rank.
inline std::string mpirun(int ranks) {
    return ranks > 1 ? fmt::format("timeout 300 mpirun --oversubscribe -n {}", ranks) : "";
}

}  // namespace livetet::test
