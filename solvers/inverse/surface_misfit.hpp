#pragma once

#include <array>
#include <span>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace livetet {

/// A measured point and the place of the deformed surface that is nearest to it: sum_k weights[k]
/// x[nodes[k]].
struct SurfaceMatch {
    Triangle nodes{};
    std::array<double, 3> weights{};  ///< barycentric
    Vector3 direction;                ///< unit vector from the place to the point, or the reverse
    double distance = 0;              ///< of the point from the place along `direction`, m
    /// d rho / d(z): 1 at distance 0, towards 0 for an outlier.
    double confidence = 1;
};

/// How well a deformed surface passes through measured points.
struct SurfaceMatches {
    std::vector<SurfaceMatch> points;
    double scale = 0;  ///< s, m
    double value = 0;  ///< phi
    double rms = 0;    ///< of all distances, m
};

/// The misfit of points c_i, whose places on the organ are not known, from a deforming surface:
///
///     phi(x) = 1/2 sum_i rho(d_i(x)^2 / s^2),   rho(z) = z / (1 + z / 9),
///
/// with d_i the distance of c_i from the nearest point of the surface and s the scale of an error.
/// rho (Geman and McClure 1987) bounds what one point contributes to 9 / 2: an outlier does not
/// pull. phi is continuously differentiable where nearest points are unique; since the nearest
/// point minimises the distance, its own motion does not enter the gradient.
class SurfaceMisfit {
  public:
    /// `surface` indexes the nodes of the body. Throws Error if it is empty, or for fewer than 10
    /// points or points that are not finite.
    SurfaceMisfit(std::span<const Triangle> surface, std::span<const Vector3> points);

    std::size_t size() const { return points_.size(); }
    /// At these positions of the body's nodes, m. `scale`: s, m.
    SurfaceMatches match(std::span<const Vector3> positions, double scale) const;
    /// At these positions with s = max(smallest_scale, 1.5 median |d_i|): from a poor start
    /// all points count.
    SurfaceMatches match_from_afar(std::span<const Vector3> positions, double smallest_scale) const;

  private:
    std::vector<SurfaceMatch> nearest(std::span<const Vector3> positions) const;

    std::vector<Triangle> surface_;
    std::vector<Vector3> points_;
};

/// d phi / d x for each of `nodes` nodes, 1/m.
std::vector<Vector3> misfit_gradient(const SurfaceMatches& matches, std::size_t nodes);

/// The nodes of the triangles that points were matched with, sorted: the part of the surface that
/// was seen.
std::vector<std::int32_t> matched_nodes(const SurfaceMatches& matches);

}  // namespace livetet
