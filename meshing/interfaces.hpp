#pragma once

#include <map>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A triangle between tets of two regions, or on the boundary.
struct InterfaceTriangle {
    Triangle nodes;                        ///< wound outwards from `inside`
    std::int32_t inside = 0, outside = 0;  ///< regions; outside 0: none, it is on the boundary
};

/// Each once, in the order of the tets; between two regions the lower is `inside`. A mesh without
/// regions counts as one of region 1. O(tets log tets).
std::vector<InterfaceTriangle> interface_triangles(const TetMesh& mesh);

/// Moves the nodes of interfaces and boundary, as little as will do, until the regions have the
/// volumes wanted (m^3; a region that is not named: any). With g_an the gradient of region a's
/// volume by node n and w_n the area about the node, the shifts x_n = sum_a p_a g_an / w_n are
/// those of least sum w_n |x_n|^2 for the volumes missing, sum_n g_an x_n = dV_a, which gives the
/// p_a (one Gauss-Newton step; `steps` of them). A node moves by at most a tenth of its mean edge a
/// step, and no further than where the least dihedral angle about it falls below `min_deg`, or
/// below what it was if that is less. Precondition: as for `raise_dihedral_angles` of several
/// regions.
void keep_region_volumes(TetMesh& mesh, const std::map<std::int32_t, double>& wanted_m3,
                         double min_deg, int steps);

/// Volume of each region, m^3; a mesh without regions counts as one of region 1.
std::map<std::int32_t, double> region_volumes(const TetMesh& mesh);

/// Makes the tets of other regions than 0 one piece that hangs together by faces, without hollows,
/// whose boundary is a manifold; those of region 0, the outside, fill the rest of a convex body.
/// Smaller pieces and what hangs on by a node or an edge become outside; gaps that close at a node
/// are filled, where they are smaller than what is about them. Then drops the outside and the nodes
/// that no tet uses. Throws Error, with the place, where that does not come to an end.
void make_one_body(TetMesh& mesh);

}  // namespace livetet
