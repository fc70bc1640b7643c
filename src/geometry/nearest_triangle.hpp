#pragma once

#include <Eigen/Geometry>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace livetet {

/// Barycentric weights of the point of triangle (a, b, c) nearest to x: each in [0, 1], sum 1.
/// Follows C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5: finds the Voronoi region
/// (vertex, edge or face) that contains x. Degenerate triangles are allowed.
std::array<double, 3> nearest_weights(const Vector3& x, const Vector3& a, const Vector3& b,
                                      const Vector3& c);

/// Bounding volume hierarchy of triangles for nearest-point queries. A query costs O(log n) for a
/// point near the surface. Copies the corners, so the input may go out of scope. `find` is const
/// and may be called from several threads. Equal distances resolve by the tree's order, not by
/// earlier queries.
class NearestTriangle {
  public:
    struct Hit {
        std::int32_t triangle = -1;
        std::array<double, 3> weights{};  ///< barycentric, of the triangle's corners
        Vector3 place;                    ///< nearest point on the triangle, metres
        double distance = 0;              ///< from the query point, metres
    };

    /// `triangles` index `nodes` (metres). Precondition: at least one triangle.
    NearestTriangle(std::span<const Vector3> nodes, std::span<const Triangle> triangles);
    Hit find(const Vector3& x) const;
    /// Corners of a triangle, m.
    const std::array<Vector3, 3>& corners(std::int32_t triangle) const {
        return corners_[triangle];
    }

  private:
    /// A leaf holds the triangles order_[first] to order_[first + count - 1]. An inner box has
    /// count 0 and the children boxes_[first] and boxes_[first + 1].
    struct Box {
        Eigen::AlignedBox3d box;
        std::int32_t first = 0, count = 0;
    };
    void build(std::int32_t box, std::int32_t first, std::int32_t count);

    std::vector<std::array<Vector3, 3>> corners_;
    std::vector<std::int32_t> order_;
    std::vector<Box> boxes_;
};

}  // namespace livetet
