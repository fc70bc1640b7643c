#pragma once

#include "mesh/segment_crossings.hpp"
#include "mesh/tet_mesh.hpp"

/// Cuts of meshes of tets along a surface. A tet is parted if the surface crosses all edges between
/// two groups of its corners. Where the surface ends in a tet it counts as going on as a plane, if
/// the middle of the tet's section by that plane is on it. In four steps
///
/// 1. a node near which the surface crosses an edge of a parted tet moves onto it, as far as the
///    angles around allow; nodes of the boundary move along it;
/// 2. edges of parted tets that are still crossed are split at the crossing;
/// 3. faces with all their nodes on the surface, between tets on both sides of it, open: a node is
///    doubled where such faces separate the tets around it;
/// 4. nodes of these faces that stay whole, at the cut's front, move onto the surface's border.
///
/// So the cut lies on the surface, and ends where that ends, but where that would make flat tets.
///
/// Compare Labelle, Shewchuk (2007), "Isosurface stuffing", for the snapping before the splits.
namespace livetet {

/// How much a cut has changed.
struct CutCounts {
    std::size_t parted = 0;   ///< tets that the surface parts
    std::size_t added = 0;    ///< nodes on split edges
    std::size_t doubled = 0;  ///< copies of nodes
};

/// A mesh that was cut. Nodes keep their numbers; those on split edges follow, and then the copies.
struct CutTets {
    TetMesh mesh;
    CutCounts counts;
};

/// Cuts a mesh of four-node tets. Tets keep their numbers for one part; others follow. Node sets
/// take all copies, and new nodes as `bisect_edges` says; triangles of sets are split with their
/// tets. `crossings`: of a surface with segments between the mesh's nodes. Where the surface parts
/// no tet, nothing changes.
CutTets cut_tets(TetMesh mesh, const SegmentCrossings& crossings);

}  // namespace livetet
