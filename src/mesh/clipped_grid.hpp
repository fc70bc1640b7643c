#pragma once

#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A point of an edge, (1 - share) a + share b, for places and displacements alike.
struct EdgePoint {
    std::int32_t a = 0, b = 0;
    double share = 0;
};

/// The part of a grid that is the body. Nodes from mesh.nodes.size() on are `points`, in order.
struct ClippedTets {
    std::vector<Tet> tets;
    std::vector<std::int32_t> parents;  ///< of each tet: the one of the mesh that it is a part of
    std::vector<EdgePoint> points;

    /// Values at all nodes, from those at the nodes of the mesh.
    std::vector<Vector3> at_nodes(std::vector<Vector3> of_mesh) const;
};

/// Cuts off of a grid's tets what lies outside of the body. Cells that are inside as a whole stay;
/// others end where the share of tissue around, linear between the nodes (tissue_around, both sides
/// of a cut together), falls below one half: of a plane surface through the cells that is the plane
/// itself. The surface goes through nodes that are nearer than a tenth of an edge; no tet is flat.
/// Solid cells (see grid_border.hpp) without a node above one half, as in thin sheets, stay whole.
/// Faces of neighbours match, but for slits of no width beside such nodes. `mesh` has shares, and
/// either order.
ClippedTets clipped_grid(const TetMesh& mesh);

}  // namespace livetet
