#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/petsc.hpp"
#include "mesh/barycentric_map.hpp"
#include "solvers/parallel/partitioned_mesh.hpp"

namespace livetet {

/// Coarse mesh data that coarse_components() reads.
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

/// Which components of the coarse nodes are constrained if `fine` are (bits 0 to 2; whole meshes).
/// A coarse component is constrained
/// - if at least 0.3 of its weight in fine nodes is in constrained ones (of 0.05 to 0.95 the value
///   with the fewest iterations on an organ pressed at a patch);
/// - if it has the place of a constrained fine node;
/// - if it has no weight in any fine node: it would be an unknown without an equation.
/// If a connected piece of the coarse mesh could then move as a rigid body, but the fine nodes in
/// it are held, a smaller share suffices in that piece: a static matrix would be singular. If only
/// the rest of the fine mesh holds a piece, one of its tets is constrained.
std::vector<std::uint8_t> coarse_components(const BarycentricMap& fine_in_coarse,
                                            std::span<const std::uint8_t> fine,
                                            const CoarseBody& coarse);

/// Of each tet, m^3.
std::vector<double> tet_volumes(const TetMesh& mesh);

/// A quarter of each tet's volume at each of its corners, m^3: of the tets' own volumes, or of
/// those given.
std::vector<double> nodal_volumes(const TetMesh& mesh);
std::vector<double> nodal_volumes(const TetMesh& mesh, std::span<const double> of_tets);

/// The volume of fine tets that each coarse tet stands for, m^3: its own, scaled by the ratio of
/// the fine volume that is restricted to its nodes to their own. The stiffness of thin rims outside
/// of the coarse mesh is not lost that way. `of_fine_nodes`: nodal_volumes of the fine mesh.
std::vector<double> carried_volumes(std::span<const double> of_fine_nodes,
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
