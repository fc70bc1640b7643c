#pragma once

#include <array>

#include "mesh/shapes.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet::test {

inline const Vector3 beam_size(0.2, 0.1, 0.1);  ///< m

/// The block [0, size] m of so many cells, six tets each.
inline TetMesh block(std::array<int, 3> cells, const Vector3& size) {
    return shapes::box(size, cells);
}

/// The nodes for which `chosen(x)` holds.
template <class Chosen>
std::vector<std::int32_t> nodes_where(const TetMesh& mesh, Chosen&& chosen) {
    std::vector<std::int32_t> nodes;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
        if (chosen(mesh.nodes[n])) nodes.push_back(static_cast<std::int32_t>(n));
    return nodes;
}

}  // namespace livetet::test
