#pragma once

#include <span>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Places of a grid's nodes with its stepped border smoothed, m: for distances, areas and normals,
/// which steps falsify (a path over the steps of a slope is up to sqrt(3) times too long). Nodes of
/// `surface` relax to the mean of their neighbours in it, none by more than half a cell's edge
/// along any axis of the grid; others stay. Faces along the grid stay but near their edges. The two
/// sides of a cut move as one: at rest it is closed.
///
/// Source: constrained elastic surface nets, S. F. F. Gibson (1998).
std::vector<Vector3> smoothed_surface(const TetMesh& grid, std::span<const Triangle> surface);

/// Where the nodes of a mesh are drawn, m: a grid's smoothed, others where they are.
std::vector<Vector3> drawn_places(const TetMesh& mesh, std::span<const Triangle> surface);

}  // namespace livetet
