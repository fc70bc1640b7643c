#include "image/image_slice.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>

namespace livetet {

namespace {

/// Converts positions to pixel coordinates (i, j) and the distance from the plane in units of
/// |right x up|.
class PixelFrame {
  public:
    explicit PixelFrame(const SlicePlane& plane) : origin_(plane.origin) {
        Eigen::Matrix3d axes;
        axes << plane.right, plane.up, plane.right.cross(plane.up);
        inverse_ = axes.inverse();
    }
    Vector3 operator()(const Vector3& x) const { return inverse_ * (x - origin_); }

  private:
    Vector3 origin_;
    Eigen::Matrix3d inverse_;
};

/// The pixels in the bounding box of a tet's section. `q`: the tet's corners in the pixel frame.
struct PixelBox {
    int i0 = 0, i1 = -1, j0 = 0, j1 = -1;  ///< inclusive ranges

    PixelBox(const std::array<Vector3, 4>& q, const SlicePlane& plane) {
        Eigen::AlignedBox2d box;
        for (int a = 0; a < 4; ++a) {
            if (q[a].z() == 0) box.extend(q[a].head<2>());
            for (int b = a + 1; b < 4; ++b)
                if ((q[a].z() < 0) != (q[b].z() < 0))
                    box.extend((q[a] + q[a].z() / (q[a].z() - q[b].z()) * (q[b] - q[a])).head<2>());
        }
        if (box.isEmpty()) return;
        i0 = static_cast<int>(
            std::ceil(std::clamp(box.min().x() - 1e-9, -1.0, double(plane.width))));
        i1 = static_cast<int>(
            std::floor(std::clamp(box.max().x() + 1e-9, -1.0, double(plane.width - 1))));
        j0 = static_cast<int>(
            std::ceil(std::clamp(box.min().y() - 1e-9, -1.0, double(plane.height))));
        j1 = static_cast<int>(
            std::floor(std::clamp(box.max().y() + 1e-9, -1.0, double(plane.height - 1))));
        i0 = std::max(i0, 0);
        j0 = std::max(j0, 0);
    }
};

constexpr double slice_tolerance = 1e-9;

}  // namespace

void slice_body(const TetMesh& mesh, std::span<const Vector3> displacement, const SlicePlane& plane,
                BodySlice& slice) {
    const PixelFrame pixel(plane);
    std::vector<Vector3> place(mesh.nodes.size());
    for (std::size_t n = 0; n < place.size(); ++n)
        place[n] = pixel(mesh.nodes[n] + displacement[n]);
    slice.tet.assign(plane.size(), -1);
    slice.rest.resize(plane.size());
    for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
        const Tet& tet = mesh.tets[t];
        const auto z = [&](int k) { return place[tet[k]].z(); };
        if (std::min(std::min(z(0), z(1)), std::min(z(2), z(3))) > 0 ||
            std::max(std::max(z(0), z(1)), std::max(z(2), z(3))) < 0)
            continue;
        const std::array<Vector3, 4> q{place[tet[0]], place[tet[1]], place[tet[2]], place[tet[3]]};
        Eigen::Matrix3d edges, rest_edges;
        for (int k = 0; k < 3; ++k) {
            edges.col(k) = q[k + 1] - q[0];
            rest_edges.col(k) = mesh.nodes[tet[k + 1]] - mesh.nodes[tet[0]];
        }
        if (!(edges.determinant() > 0)) continue;
        const Eigen::Matrix3d inverse = edges.inverse(), rest_per_pixel = rest_edges * inverse;
        const PixelBox box(q, plane);
        for (int j = box.j0; j <= box.j1; ++j)
            for (int i = box.i0; i <= box.i1; ++i) {
                const std::size_t p = i + static_cast<std::size_t>(plane.width) * j;
                const Vector3 way = Vector3(i, j, 0) - q[0], weights = inverse * way;
                if (weights.minCoeff() < -slice_tolerance || weights.sum() > 1 + slice_tolerance ||
                    slice.tet[p] >= 0)
                    continue;
                slice.tet[p] = static_cast<std::int32_t>(t);
                slice.rest[p] = mesh.nodes[tet[0]] + rest_per_pixel * way;
            }
    }
}

void slice_outline(std::span<const Vector3> nodes, std::span<const Vector3> displacement,
                   std::span<const Triangle> triangles, const SlicePlane& plane,
                   std::vector<OutlinePiece>& outline) {
    const PixelFrame pixel(plane);
    outline.clear();
    for (const Triangle& t : triangles) {
        std::array<Vector3, 3> q;
        for (int k = 0; k < 3; ++k) q[k] = pixel(nodes[t[k]] + displacement[t[k]]);
        OutlinePiece piece;
        int ends = 0;
        for (int k = 0; k < 3 && ends < 2; ++k) {
            const Vector3 &a = q[k], &b = q[(k + 1) % 3];
            if ((a.z() < 0) != (b.z() < 0))
                piece[ends++] = (a + a.z() / (a.z() - b.z()) * (b - a)).head<2>();
        }
        if (ends == 2) outline.push_back(piece);
    }
}

ImageSampler::ImageSampler(const GreyImage& image) : image_(image) {
    const Eigen::Matrix4d voxel_from_ras = image.ras_from_voxel.inverse();
    turn_ = voxel_from_ras.topLeftCorner<3, 3>();
    shift_ = voxel_from_ras.topRightCorner<3, 1>();
}

float ImageSampler::operator()(const Vector3& x) const {
    constexpr double rounding = 1e-6;  // of a voxel
    const Vector3 v = turn_ * x + shift_;
    int corner[3];
    float part[3];
    for (int d = 0; d < 3; ++d) {
        if (!(v[d] >= -rounding && v[d] <= image_.size[d] - 1 + rounding))
            return std::numeric_limits<float>::quiet_NaN();
        corner[d] = std::clamp(static_cast<int>(v[d]), 0, std::max(image_.size[d] - 2, 0));
        part[d] =
            image_.size[d] > 1 ? static_cast<float>(std::clamp(v[d] - corner[d], 0.0, 1.0)) : 0.0F;
    }
    const std::size_t step[3] = {
        image_.size[0] > 1 ? 1U : 0U, image_.size[1] > 1 ? std::size_t(image_.size[0]) : 0U,
        image_.size[2] > 1 ? std::size_t(image_.size[0]) * image_.size[1] : 0U};
    const float* value = &image_.values[image_.index(corner[0], corner[1], corner[2])];
    const auto along_x = [&](std::size_t at) {
        return value[at] + part[0] * (value[at + step[0]] - value[at]);
    };
    const auto along_y = [&](std::size_t at) {
        const float a = along_x(at);
        return a + part[1] * (along_x(at + step[1]) - a);
    };
    const float a = along_y(0);
    return a + part[2] * (along_y(step[2]) - a);
}

void sample_slice(const ImageSampler& image, const SlicePlane& plane, const BodySlice& at_rest,
                  const BodySlice& now, std::span<float> values) {
    for (int j = 0; j < plane.height; ++j)
        for (int i = 0; i < plane.width; ++i) {
            const std::size_t p = i + static_cast<std::size_t>(plane.width) * j;
            if (now.covers(p))
                values[p] = image(now.rest[p]);
            else
                values[p] = at_rest.covers(p) ? std::numeric_limits<float>::quiet_NaN()
                                              : image(plane.at(i, j));
        }
}

}  // namespace livetet
