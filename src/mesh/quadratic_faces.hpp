#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>

#include "mesh/quadratic_hexahedra.hpp"

namespace livetet {

/// Where a point of a face of quadratic hexahedra takes its value from, and what it stands for.
struct FacePoint {
    std::array<std::int32_t, 9> nodes;
    std::array<double, 9> shares;  ///< the shape functions of these nodes; they sum to 1
    Vector3 place;                 ///< m
    Vector3 area;                  ///< outwards, m^2
};

/// Integrals over the bent faces of quadratic hexahedra, triangle by triangle of the mesh's
/// boundary: each is part of one face.
class QuadraticFaces {
  public:
    QuadraticFaces(const TetMesh& mesh, std::span<const Triangle> triangles);
    /// Seven points of one of those triangles, exact to degree 5 of the face's own coordinates
    /// (Radon 1948). Throws Error if it is part of no face.
    std::array<FacePoint, 7> points(const TetMesh& mesh, const Triangle& triangle) const;

  private:
    /// Node i + 3 j of a face is at (i, j) / 2 of its own coordinates.
    using Face = std::array<std::int32_t, 9>;
    std::unordered_map<std::int32_t, Face> faces_;  ///< by the node in the face's middle
};

}  // namespace livetet
