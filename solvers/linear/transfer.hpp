#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/petsc.hpp"
#include "mesh/barycentric_map.hpp"
#include "solvers/parallel/partitioned_mesh.hpp"

namespace livetet {

/// What `coarse_components` looks at of a coarse mesh.
struct CoarseBody {
    CoarseBody(const TetMesh& mesh, const TetMesh& fine, const BarycentricMap& fine_in_coarse);

    struct Piece {
        Vector3 centre;          ///< m
        double extent = 0;       ///< m: half of its box's diagonal
        std::int32_t whole = 0;  ///< the lowest of the pieces that hang together in the fine mesh
        Tet tet;                 ///< one of it
    };
    std::vector<Vector3> places;         ///< of the nodes, m
    std::vector<std::int32_t> piece_of;  ///< of the nodes: which of `pieces`
    std::vector<Piece> pieces;           ///< each connected in the coarse mesh
};

/// Which components of the coarse nodes are constrained when `fine` are (bits 0 to 2; whole
/// meshes): a coarse component is, where at least 0.3 of the weight that it lends to fine nodes
/// goes to constrained ones (of 0.05 to 0.95 the value with the fewest iterations on an organ
/// pressed at a patch), where it is itself a fine node that is, or where it lends none. Where that
/// would leave a connected piece free to move as a rigid body which the fine one is not, whose
/// patch is small on the coarse mesh, a lesser share will do there: static, the matrix would be
/// singular. Where the fine one hangs together by what the coarse mesh has not, and no share will
/// do, a tet of it is. One rule for masks, groups, patches and node lists, and no coarse level has
/// an unknown without an equation.
std::vector<std::uint8_t> coarse_components(const BarycentricMap& fine_in_coarse,
                                            std::span<const std::uint8_t> fine,
                                            const CoarseBody& coarse);

/// Of each tet, m^3.
std::vector<double> tet_volumes(const TetMesh& mesh);

/// What each coarse tet carries of the fine tets' volumes, m^3: its own, scaled by what its nodes
/// are lent against what they have. Stiffness of fine material that lies outside of the coarse
/// mesh, in thin rims, is not lost that way.
std::vector<double> carried_volumes(const TetMesh& fine, std::span<const double> fine_volumes,
                                    const BarycentricMap& fine_in_coarse, const TetMesh& coarse);

/// Interpolation between two levels, three components a node, as PETSc matrices.
class Transfer {
  public:
    /// Collective. `fine_in_coarse` places every node of the whole fine mesh in the whole coarse
    /// mesh. The interpolation is there after the first `set_constrained`.
    Transfer(const PartitionedMesh& fine, const PartitionedMesh& coarse,
             const BarycentricMap& fine_in_coarse);

    /// Coarse to fine; zero in rows of constrained fine components and columns of constrained
    /// coarse ones.
    Mat interpolation() const { return interpolation_.get(); }
    /// Fine displacement to coarse displacement: the weighted mean of the fine nodes around a
    /// coarse one.
    void restrict_displacement(Vec fine, Vec coarse) const;

    const BarycentricMap& map() const { return map_; }

    void set_constrained(const PartitionedMesh& fine, const PartitionedMesh& coarse,
                         std::span<const std::uint8_t> fine_components,
                         std::span<const std::uint8_t> coarse_components);

  private:
    void make_mean(const PartitionedMesh& fine, const PartitionedMesh& coarse);

    const BarycentricMap& map_;
    PetscHandle<Mat> interpolation_;
    PetscHandle<Mat> mean_of_one_, mean_;  ///< of a number a node, and the same for three
};

}  // namespace livetet
