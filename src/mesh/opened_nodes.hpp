#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A node that has moved in the body at rest.
struct MovedNode {
    std::int32_t node = 0;
    Vector3 way = Vector3::Zero();  ///< by which it moved, m
    /// The value where it is now, in the mesh before: sum_k weights[k] * values[nodes[k]], by the
    /// shape functions of a tet of ten nodes, or of four (then the rest has no weight).
    std::array<std::int32_t, 10> nodes{};
    std::array<double, 10> weights{};
};

/// How the nodes of a mesh change when a cut opens: some move onto the cut, then copies follow
/// after all nodes.
struct OpenedNodes {
    std::vector<MovedNode> moved;
    std::vector<std::int32_t> originals;  ///< of each copy: the node that it is a copy of
};

/// Appends to one value a node those of the copies.
template <class Value>
void copy_values(std::vector<Value>& values, const std::vector<std::int32_t>& originals) {
    for (const std::int32_t n : originals) values.push_back(Value(values[n]));
}

/// Takes one value a node over to the opened mesh: of moved nodes the interpolated one.
template <class Value>
void carry_values(std::vector<Value>& values, const OpenedNodes& nodes) {
    std::vector<Value> there;
    for (const MovedNode& m : nodes.moved) {
        Value& sum = there.emplace_back(m.weights[0] * values[m.nodes[0]]);
        for (std::size_t k = 1; k < m.nodes.size(); ++k) sum += m.weights[k] * values[m.nodes[k]];
    }
    for (std::size_t i = 0; i < there.size(); ++i) values[nodes.moved[i].node] = there[i];
    copy_values(values, nodes.originals);
}

}  // namespace livetet
