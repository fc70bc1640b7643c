#pragma once

#include <limits>
#include <map>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A triangle between tets of different regions, or on the boundary.
struct InterfaceTriangle {
    Triangle nodes;                        ///< wound outwards from `inside`
    std::int32_t inside = 0, outside = 0;  ///< regions; outside 0: on the boundary
};

/// All interface triangles, each once, in the order of the tets; the lower region is `inside`. A
/// mesh without regions has the single region 1. O(n log n) in the number of tets.
std::vector<InterfaceTriangle> interface_triangles(const TetMesh& mesh);

/// Moves interface and boundary nodes as little as possible until the regions have the wanted
/// volumes (m^3; regions that are not listed are free). Minimises sum_n w_n |x_n|^2 over the
/// displacements x_n subject to the missing volumes,
///
///     sum_n g_an . x_n = dV_a   =>   x_n = sum_a p_a g_an / w_n
///
/// with g_an the gradient of region a's volume by node n, w_n the area around the node and p_a the
/// multipliers. Takes `steps` such Gauss-Newton steps. A step moves a node by at most a tenth of
/// its mean edge, and only as far as the smallest dihedral angle around it stays above `min_deg`,
/// or above its current value if that is less. Precondition: as for `raise_dihedral_angles` of
/// several regions.
void keep_region_volumes(TetMesh& mesh, const std::map<std::int32_t, double>& wanted_m3,
                         double min_deg, int steps);

/// Volume of each region, m^3. A mesh without regions has the single region 1.
std::map<std::int32_t, double> region_volumes(const TetMesh& mesh);

/// Smallest parts and cavities that a body keeps, m^3. By default it is its largest part, without
/// cavities.
struct KeptPieces {
    double part_m3 = std::numeric_limits<double>::infinity();
    double cavity_m3 = std::numeric_limits<double>::infinity();
};

/// Makes the tets with a region other than 0 one body: connected by faces but for the parts that
/// are `kept`, with no cavities but those, with a manifold boundary. Region 0 is the outside, which
/// fills the rest of a convex hull. Smaller pieces, and parts connected only by a node or an edge,
/// become outside; gaps that close at a node are filled if they are smaller than their
/// surroundings. Then drops the outside and unused nodes. Throws Error, with the position, if this
/// does not terminate.
void make_one_body(TetMesh& mesh, const KeptPieces& kept = {});

}  // namespace livetet
