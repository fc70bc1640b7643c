#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A new node on the edge from a to b, at (1 - share) a + share b.
struct EdgeNode {
    std::int32_t a = 0, b = 0;
    double share = 0.5;
};

/// Splits edges of a mesh of four-node tets, one after the other, and all tets and triangles of
/// sets around each in two: so the mesh fits together whatever edges are split. Node i of the list
/// gets the number nodes.size() + i. A tet keeps its number for the half with its lower corner of
/// the edge; the other halves follow after all tets. A new node is in a node set if both ends are,
/// and the edge is on the boundary or one of them is not. Returns for each tet the one that it is a
/// part of. Precondition: edges of the mesh as it is, each of them once.
std::vector<std::int32_t> bisect_edges(TetMesh& mesh, std::span<const EdgeNode> splits);

}  // namespace livetet
