#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Watches for elements that a displacement turns over, some of them in each look: tets whose
/// corners span no positive volume, and hexahedra of a grid whose Jacobian at the middle is not
/// positive. Cells of which less than half is in the body are passed over: little holds them. A
/// corner alone that is turned over, of ten nodes or of a cell, is not seen.
class TurnedElements {
  public:
    /// Elements of a look, which takes some 50 us.
    static constexpr std::size_t per_look = 2048;

    explicit TurnedElements(const TetMesh& mesh);
    /// Looks at those whose turn it is. `mesh`: that of the constructor, or one that a cut has made
    /// of it, with further nodes; `displacement`: of its nodes, m. Allocates nothing.
    void look(const TetMesh& mesh, std::span<const Vector3> displacement);
    /// Elements that were turned over when they were last looked at.
    std::size_t count() const { return count_; }

  private:
    std::vector<std::size_t> of_turn_;  ///< how many were found in each turn
    std::size_t turn_ = 0, count_ = 0;
};

}  // namespace livetet
