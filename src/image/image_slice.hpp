#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"

// A plane through an image that a deforming body carries along: only the pixels of the plane are
// computed.

namespace livetet {

/// A grid of pixels in space: the centre of pixel (i, j) is origin + i * right + j * up, metres.
/// `right` and `up` are not parallel.
struct SlicePlane {
    Vector3 origin = Vector3::Zero(), right = Vector3::UnitX(), up = Vector3::UnitY();
    int width = 0, height = 0;

    std::size_t size() const { return static_cast<std::size_t>(width) * height; }
    Vector3 at(double i, double j) const { return origin + i * right + j * up; }
};

/// What a body has in each pixel of a plane, pixel (i, j) at i + width * j.
struct BodySlice {
    std::vector<std::int32_t> tet;  ///< that the pixel's centre lies in; -1: none
    std::vector<Vector3>
        rest;  ///< where that material is in the rest shape, m; where there is a tet

    bool covers(std::size_t pixel) const { return tet[pixel] >= 0; }
};

/// Rasterises the deformed tets that the plane cuts. `displacement` (m) of each corner node; what
/// it holds beyond them is not looked at (the edges of a P2 tet are taken as straight). An inverted
/// tet covers nothing: where a body is folded, its upright tets lie there too, of which the first
/// one counts. O(tets + pixels covered); `slice` keeps its storage.
void slice_body(const TetMesh& mesh, std::span<const Vector3> displacement, const SlicePlane& plane,
                BodySlice& slice);

/// Where the plane cuts the surface `triangles` of the deformed body: pieces of the outline, in
/// units of pixels (i, j).
using OutlinePiece = std::array<Eigen::Vector2d, 2>;
void slice_outline(std::span<const Vector3> nodes, std::span<const Vector3> displacement,
                   std::span<const Triangle> triangles, const SlicePlane& plane,
                   std::vector<OutlinePiece>& outline);

/// A grey image's values at points in space, linear between voxels' centres; NaN beyond the
/// outermost of them.
class ImageSampler {
  public:
    /// `image` has to outlive it.
    explicit ImageSampler(const GreyImage& image);
    float operator()(const Vector3& x) const;

  private:
    const GreyImage& image_;
    Eigen::Matrix3d turn_;  ///< voxel = turn * x + shift
    Vector3 shift_;
};

/// The deformed image in each pixel of `plane`: in the body as it is now (`now`) the value of the
/// material there; of what lies outside, the image as it is, but NaN where the body was at rest
/// (`at_rest`) and has left: nobody knows what came there.
void sample_slice(const ImageSampler& image, const SlicePlane& plane, const BodySlice& at_rest,
                  const BodySlice& now, std::span<float> values);

}  // namespace livetet
