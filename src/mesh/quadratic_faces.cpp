#include "mesh/quadratic_faces.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

#include "base/error.hpp"

namespace livetet {

namespace {

/// Barycentric coordinates in a triangle, and the share of its area.
struct TrianglePoint {
    double at[3], share;
};

std::array<TrianglePoint, 7> radon_points() {
    const double root = std::sqrt(15.0);
    std::array<TrianglePoint, 7> points{};
    points[0] = {{1.0 / 3, 1.0 / 3, 1.0 / 3}, 9.0 / 40};
    for (int set = 0; set < 2; ++set) {
        const double s = set == 0 ? root : -root, near = (6 + s) / 21, share = (155 + s) / 1200;
        for (int k = 0; k < 3; ++k) {
            TrianglePoint& p = points[1 + 3 * set + k];
            p = {{near, near, near}, share};
            p.at[k] = 1 - 2 * near;
        }
    }
    return points;
}

}  // namespace

QuadraticFaces::QuadraticFaces(const TetMesh& mesh, std::span<const Triangle> triangles) {
    for (const Triangle& t : triangles)
        for (const std::int32_t n : t) faces_[n] = {};
    for (const QuadraticHexahedron& cell : mesh.quadratic_hexahedra)
        for (int axis = 0; axis < 3; ++axis)
            for (const int side : {0, 2}) {
                constexpr int steps[3] = {1, 3, 9};
                const int first = side * steps[axis], a = steps[(axis + 1) % 3],
                          b = steps[(axis + 2) % 3];
                const auto found = faces_.find(cell[first + a + b]);
                if (found == faces_.end()) continue;
                for (int i = 0; i < 9; ++i) found->second[i] = cell[first + i % 3 * a + i / 3 * b];
            }
    std::erase_if(faces_, [](const auto& f) { return f.second == Face{}; });
}

std::array<FacePoint, 7> QuadraticFaces::points(const TetMesh& mesh,
                                                const Triangle& triangle) const {
    static const auto quadrature = radon_points();
    const auto middle =
        std::ranges::find_if(triangle, [&](std::int32_t n) { return faces_.contains(n); });
    if (middle == triangle.end())
        fail("triangle ({}, {}, {}) is part of no face of a hexahedron", triangle[0], triangle[1],
             triangle[2]);
    const Face& face = faces_.at(*middle);
    Eigen::Vector2d corners[3];  // in the face's own coordinates
    for (int k = 0; k < 3; ++k) {
        const auto i = std::ranges::find(face, triangle[k]) - face.begin();
        if (i == 9)
            fail("triangle ({}, {}, {}) is part of no face of a hexahedron", triangle[0],
                 triangle[1], triangle[2]);
        corners[k] = Eigen::Vector2d(static_cast<double>(i % 3), static_cast<double>(i / 3)) / 2;
    }
    Eigen::Matrix2d sides;
    sides << corners[1] - corners[0], corners[2] - corners[0];
    const double area = sides.determinant() / 2;  // below 0 where it is wound the other way

    std::array<FacePoint, 7> points;
    for (std::size_t p = 0; p < points.size(); ++p) {
        const auto& at = quadrature[p].at;
        const Eigen::Vector2d x = at[0] * corners[0] + at[1] * corners[1] + at[2] * corners[2];
        const QuadraticPolynomials a(x[0]), b(x[1]);
        FacePoint& point = points[p];
        point.nodes = face;
        point.place.setZero();
        Vector3 along_a = Vector3::Zero(), along_b = Vector3::Zero();
        for (int i = 0; i < 9; ++i) {
            const Vector3& node = mesh.nodes[face[i]];
            point.shares[i] = a.value[i % 3] * b.value[i / 3];
            point.place += point.shares[i] * node;
            along_a += a.slope[i % 3] * b.value[i / 3] * node;
            along_b += a.value[i % 3] * b.slope[i / 3] * node;
        }
        point.area = quadrature[p].share * area * along_a.cross(along_b);
    }
    return points;
}

}  // namespace livetet
