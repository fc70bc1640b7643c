#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "image/image.hpp"
#include "mesh/tet_mesh.hpp"

// Slices a deformed image along a plane. Only the pixels of the plane are computed.

namespace livetet {

/// Grid of pixels in space. The centre of pixel (i, j) is origin + i * right + j * up, metres.
/// `right` and `up` must not be parallel.
struct SlicePlane {
    Vector3 origin = Vector3::Zero(), right = Vector3::UnitX(), up = Vector3::UnitY();
    int width = 0, height = 0;

    std::size_t size() const { return static_cast<std::size_t>(width) * height; }
    Vector3 at(double i, double j) const { return origin + i * right + j * up; }
};

/// The body's material at each pixel of a plane; pixel (i, j) has index i + width * j.
struct BodySlice {
    std::vector<std::int32_t> tet;  ///< tet that contains the pixel's centre; -1: none
    /// Rest position of the material at the pixel, m; undefined without a tet.
    std::vector<Vector3> rest;

    bool covers(std::size_t pixel) const { return tet[pixel] >= 0; }
};

/// Rasterises the deformed tets that the plane cuts. `displacement` (m) has at least one vector for
/// each corner node; midpoint nodes are ignored, so the edges of a P2 tet count as straight.
/// Inverted tets cover nothing: where the body folds over itself, the first upright tet counts.
/// O(tets + pixels covered). Reuses the storage of `slice`.
void slice_body(const TetMesh& mesh, std::span<const Vector3> displacement, const SlicePlane& plane,
                BodySlice& slice);

/// One segment of the outline, in pixels (i, j).
using OutlinePiece = std::array<Eigen::Vector2d, 2>;
/// Intersects the plane with the surface `triangles` of the deformed body. `nodes` and
/// `displacement` in metres. Reuses the storage of `outline`.
void slice_outline(std::span<const Vector3> nodes, std::span<const Vector3> displacement,
                   std::span<const Triangle> triangles, const SlicePlane& plane,
                   std::vector<OutlinePiece>& outline);

/// Trilinear interpolation of a grey image at points in space (metres, RAS); NaN beyond the
/// outermost voxel centres.
class ImageSampler {
  public:
    /// Keeps a reference to `image`, which must outlive the sampler.
    explicit ImageSampler(const GreyImage& image);
    float operator()(const Vector3& x) const;

  private:
    const GreyImage& image_;
    Eigen::Matrix3d turn_;  ///< voxel = turn * x + shift
    Vector3 shift_;
};

/// Samples the deformed image at each pixel of `plane`. A pixel inside the deformed body (`now`)
/// takes the image at its material's rest position. A pixel outside takes the image unchanged, but
/// NaN if the body covered it at rest (`at_rest`) and has left: the tissue there is unknown.
/// `values` has plane.size() entries.
void sample_slice(const ImageSampler& image, const SlicePlane& plane, const BodySlice& at_rest,
                  const BodySlice& now, std::span<float> values);

}  // namespace livetet
