#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Finds the tets of a mesh that points lie in, or that are nearest to them.
class PointLocator {
  public:
    /// Throws Error if the mesh has no tets. O(tets). Copies what it needs.
    explicit PointLocator(const TetMesh& mesh);
    ~PointLocator();
    PointLocator(const PointLocator&) = delete;
    PointLocator& operator=(const PointLocator&) = delete;

    struct Hit {
        std::int32_t tet = -1;
        Tet corners{};  ///< its nodes; in another order where the point is outside
        std::array<double, 4> weights{};  ///< of the corners, in [0, 1]: of the point, or of the
                                          ///< nearest one of the boundary
        double distance = 0;              ///< from the mesh, m; 0 inside
    };
    /// O(1) inside, O(log(boundary triangles)) near the boundary. Allocates nothing; may be called
    /// from several threads. Precondition: `x` is finite.
    Hit find(const Vector3& x) const;
    /// The mesh's boundary_triangles.
    std::span<const Triangle> boundary() const;

  private:
    struct Search;
    std::unique_ptr<const Search> search_;
};

}  // namespace livetet
