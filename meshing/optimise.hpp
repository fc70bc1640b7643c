#pragma once

#include <cstdint>

#include "geometry/nearest_triangle.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Statistics of `raise_dihedral_angles`.
struct OptimiseReport {
    std::int64_t moves = 0;        ///< node moves
    std::int64_t flips = 0;        ///< edge removals and face swaps
    std::int64_t collapses = 0;    ///< edge collapses
    std::int64_t peeled_tets = 0;  ///< flat boundary tets removed
};

/// Improves the tets that have a dihedral angle below `aim_deg`, until none is left or no operation
/// helps, in the spirit of L. Freitag and C. Ollivier-Gooch, Tetrahedral mesh improvement using
/// swapping and smoothing, 1997. Operations:
/// - move a node to maximise the smallest angle around it; boundary nodes move along `body`, the
///   surface that the mesh represents, and at creases leave it by at most a twentieth of their mean
///   edge;
/// - remove a flat tet with two boundary faces, so that its other two become the boundary (an edge
///   flip);
/// - collapse an edge, remove an edge with its ring of tets, or swap a face for an edge.
///
/// Each operation must raise the smallest angle of the tets that it changes. So tets stay positive
/// and the boundary stays closed and manifold. Precondition: a mesh without regions and named sets
/// that passes `check_tet_mesh`.
OptimiseReport raise_dihedral_angles(TetMesh& mesh, const NearestTriangle& body, double aim_deg);

/// The same for a mesh of several regions, which keeps the regions and their interfaces. Interface
/// nodes move along the initial interface or boundary triangles and leave them by at most a
/// twentieth of their mean edge. Nodes where more than two regions meet move along all of their
/// interfaces and are not collapsed. Edges and faces of an interface are not removed, except that a
/// flat tet with two faces towards another region may change to that region. Precondition: a region
/// for each tet, none of them 0.
OptimiseReport raise_dihedral_angles(TetMesh& mesh, double aim_deg);

}  // namespace livetet
