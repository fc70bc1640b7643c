#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Number of cells: the hexahedra of a grid, else the tets.
inline std::size_t cell_count(const TetMesh& mesh) {
    return mesh.hexahedra.empty() ? mesh.tets.size() : mesh.hexahedra.size();
}
/// A cell's corners.
inline std::span<const std::int32_t> corners_of_cell(const TetMesh& mesh, std::size_t cell) {
    if (mesh.hexahedra.empty()) return mesh.tets[cell];
    return mesh.hexahedra[cell];
}

/// A connected part of a mesh.
struct MeshPiece {
    std::vector<std::int32_t> cells;     ///< rising
    double volume = 0;                   ///< inside the body, m^3
    Vector3 centroid = Vector3::Zero();  ///< of that, cell by cell, m
};

/// The pieces of a mesh, the largest first.
std::vector<MeshPiece> mesh_pieces(const TetMesh& mesh);

/// The nodes of pieces, rising.
std::vector<std::int32_t> nodes_of_pieces(std::span<const MeshPiece> pieces, const TetMesh& mesh);

/// The mesh without some of its cells (one entry a cell) and the nodes that only they have. What is
/// left is numbered in the same order. Sets that lose all members stay, empty. Not for ten nodes.
TetMesh without_cells(const TetMesh& mesh, std::span<const std::uint8_t> left_out);

}  // namespace livetet
