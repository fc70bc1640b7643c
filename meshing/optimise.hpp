#pragma once

#include <cstdint>

#include "geometry/nearest_triangle.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// What `raise_dihedral_angles` did.
struct OptimiseReport {
    std::int64_t moves = 0;        ///< of nodes
    std::int64_t flips = 0;        ///< edges removed, faces swapped
    std::int64_t collapses = 0;    ///< edges drawn together
    std::int64_t peeled_tets = 0;  ///< flat tets on the boundary left out
};

/// Works on the tets of which a dihedral angle is below `aim_deg` until none is left or nothing
/// helps, in the spirit of L. Freitag and C. Ollivier-Gooch, Tetrahedral mesh improvement using
/// swapping and smoothing, 1997:
/// - nodes move to where the least angle about them is greatest; those on the boundary along
/// `body`, the surface that
///   the mesh stands for, and on creases at most a twentieth of their edges off it;
/// - a flat tet with two faces on the boundary is left out: the boundary gets its other two (an
/// edge flip);
/// - an edge is drawn together, or removed with the tets about it, or a face swapped for an edge,
/// where that raises the
///   least angle about it.
/// No step lowers the least angle of those tets that it touches, so that tets stay positive and the
/// boundary closed and manifold. Regions and named sets are not kept. Precondition: a mesh that
/// `check_tet_mesh` lets pass, without them.
OptimiseReport raise_dihedral_angles(TetMesh& mesh, const NearestTriangle& body, double aim_deg);

/// The same for a mesh of several regions, which keeps them and what they share: the nodes of an
/// interface move along the triangles that the interface has at first, or the boundary, by at most
/// a twentieth of their edges off it; those where more than two regions meet along all of their
/// interfaces, and they are not drawn away; edges and faces of an interface are not removed, but
/// for those of a flat tet with two faces towards another region, which goes over to it.
/// Precondition: a region for each tet, none of them 0.
OptimiseReport raise_dihedral_angles(TetMesh& mesh, double aim_deg);

}  // namespace livetet
