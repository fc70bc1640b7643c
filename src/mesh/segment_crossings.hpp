#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mesh/cut_surface.hpp"

namespace livetet {

/// How a segment crosses a surface.
struct SegmentCrossing {
    int count = 0;                     ///< how often
    double first = 0;                  ///< the share of the way to the first crossing, from 0 to 1
    Vector3 normal = Vector3::Zero();  ///< of the surface there, a unit vector of either sign

    /// Whether its ends are on different sides.
    bool parts() const { return count % 2 != 0; }
};

/// The edges at which a surface ends: of each its ends, m.
using SurfaceBorder = std::vector<std::array<Vector3, 2>>;

/// The point of a border that is nearest to `x`, if one is within a distance, m. O(edges).
std::optional<Vector3> nearest_on(const SurfaceBorder& border, const Vector3& x, double within);

/// Finds where segments between points of a body cross a surface.
///
/// Each point is on one side of a surface, also where it lies on it: then that of a plane's normal;
/// of triangles as if the point was moved by (e, e^2, e^3) with an infinitely small e. That is
/// decided exactly, on coordinates rounded to 2^-30 of the body's longest side. So a surface
/// without holes has none for segments, wherever they meet edges and corners of its triangles.
class SegmentCrossings {
  public:
    /// `points`: the body's; segments are within their box. Throws Error, naming `where`, if a
    /// corner of a triangle is not finite or farther from the box than 100 of its sides.
    SegmentCrossings(const CutSurface& surface, std::span<const Vector3> points,
                     const std::string& where);
    ~SegmentCrossings();
    SegmentCrossings(const SegmentCrossings&) = delete;
    SegmentCrossings& operator=(const SegmentCrossings&) = delete;

    /// Of the segment between two points, m. O(1) for a patch, O(log(triangles)) otherwise.
    SegmentCrossing between(const Vector3& from, const Vector3& to) const;
    /// The surface's border. O(triangles log(triangles)).
    SurfaceBorder border() const;

  private:
    SegmentCrossing with_patch(const Vector3& from, const Vector3& to) const;

    PlanePatch patch_;
    double rounding_ = 0;  ///< m
    struct Triangles;
    std::unique_ptr<Triangles> triangles_;  ///< none: the patch
};

}  // namespace livetet
