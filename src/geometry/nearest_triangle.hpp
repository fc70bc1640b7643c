#pragma once

#include <Eigen/Geometry>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace livetet {

/// The point of triangle (a, b, c) that is nearest to x, as weights of a, b and c: all in [0, 1],
/// sum one. From the region (vertex, edge or face) that x projects to: C. Ericson, Real-Time
/// Collision Detection, 2005, section 5.1.5.
std::array<double, 3> nearest_weights(const Vector3& x, const Vector3& a, const Vector3& b,
                                      const Vector3& c);

/// A tree of bounding boxes over triangles, to ask for the nearest of them: O(log n) for a point
/// near the surface. Holds a copy of the corners. Results do not depend on the order of questions.
class NearestTriangle {
  public:
    struct Hit {
        std::int32_t triangle = -1;
        std::array<double, 3> weights{};  ///< of the triangle's corners
        Vector3 place;                    ///< the point on the triangle, metres
        double distance = 0;              ///< metres
    };

    /// Precondition: at least one triangle.
    NearestTriangle(std::span<const Vector3> nodes, std::span<const Triangle> triangles);
    Hit find(const Vector3& x) const;

  private:
    /// A leaf holds order_[first] .. order_[first + count]; an inner box has count 0, its children
    /// at `first` and `first + 1`.
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
