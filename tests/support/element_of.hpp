#pragma once

#include <vector>

#include "mechanics/tet_element.hpp"

namespace livetet::test {

/// Elements as TetBatches takes them. The list must outlive it.
inline auto element_of(const std::vector<TetElement>& elements) {
    return [&elements](std::size_t e) { return elements[e]; };
}

}  // namespace livetet::test
