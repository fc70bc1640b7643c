#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "mesh/geodesic.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A piece of a mesh's surface that stands for a disc.
struct SurfacePatch {
    std::vector<std::int32_t> nodes;  ///< sorted
    Vector3 at = Vector3::Zero();     ///< the point of the surface nearest to the given place, m
    Triangle triangle{};              ///< in which that point lies
    /// Node nearest to the given place, of the triangle nearest to it.
    std::int32_t centre = -1;
    double distance = 0;   ///< distance from the place to that triangle, metres
    double area = 0;       ///< that its nodes hold, m^2 (see SurfaceNeighbourhood::patch)
    double disc_area = 0;  ///< of the surface within the radius, m^2
    Vector3 normal = Vector3::UnitZ();  ///< mean over the area held, outwards, of unit length
    /// From the place to the centroid of that area, along the surface, metres.
    Vector3 off_centre = Vector3::Zero();
};

/// The surface of a mesh about the point of it that is nearest to a place: for patches of several
/// radii there and the rings about them, which need the mesh's boundary and that point once. A
/// grid's steps are smoothed for all that is measured (smoothed_surface).
class SurfaceNeighbourhood {
  public:
    /// The mesh has a tet, and outlives this.
    SurfaceNeighbourhood(const TetMesh& mesh, const Vector3& place);

    /// The surface nodes whose prescribed displacement stands for that of a disc of `radius` (m)
    /// about that point. Distances are measured along the surface (see `distances_on_surface`), so
    /// that a patch on a thin rim does not reach through to the other side.
    ///
    /// The nodes nearest to the point are taken, as many as hold the disc's area: nodes within the
    /// radius hold less. A triangle with all its corners in the patch is held whole, one with k of
    /// them by k / 6; those of ten-node tets count as four, with the middles of edges. With these
    /// shares the displacement far from the patch has hardly an error of first order in the edge
    /// (measured, see docs/theory/filters.md). A disc smaller than a triangle is held by the centre
    /// alone, which is chosen through the triangle nearest to the place: the nearest node could lie
    /// on the other side of a rim thinner than an edge.
    SurfacePatch patch(double radius) const;
    /// Nodes within `radius` of that point, with their distances along the surface, m.
    std::map<std::int32_t, double> distances(double radius) const {
        return distances_on_surface(places(), surface_, at_, radius);
    }
    const TetMesh& mesh() const { return mesh_; }
    std::size_t surface_node_count() const;

  private:
    void choose_nodes(SurfacePatch& patch, const std::map<std::int32_t, double>& distances) const;
    void find_shape(SurfacePatch& patch) const;

    /// Of the nodes, for what is measured, m.
    std::span<const Vector3> places() const { return smoothed_.empty() ? mesh_.nodes : smoothed_; }

    const TetMesh& mesh_;
    std::vector<Vector3> smoothed_;  ///< of a grid
    std::vector<Triangle> surface_;  ///< each of ten-node tets cut into four
    SurfacePoint at_;
    std::int32_t centre_ = -1;
    double distance_ = 0;  ///< from the place to the surface, m
};

/// One patch of a SurfaceNeighbourhood.
SurfacePatch surface_patch(const TetMesh& mesh, const Vector3& place, double radius);

}  // namespace livetet
