#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/petsc.hpp"
#include "mesh/barycentric_map.hpp"
#include "solvers/linear/transfer_rows.hpp"

namespace livetet {

/// A quarter of each tet's volume at each of its corners, m^3.
std::vector<double> nodal_volumes(const TetMesh& mesh);

/// The same at the nodes that the rank owns, of the volumes that local tets have: their own, or
/// `share.volumes`.
std::vector<double> nodal_volumes(const PartitionedMesh& share);

/// The volume of fine tets that each local coarse tet stands for, m^3: its own, scaled by the ratio
/// of the fine volume that is restricted to its nodes to their own. The stiffness of thin rims
/// outside of the coarse mesh is not lost that way. `of_fine_nodes`: nodal_volumes of the fine
/// share. Collective.
std::vector<double> carried_volumes(std::span<const double> of_fine_nodes, const TransferRows& rows,
                                    const PartitionedMesh& coarse);

/// Interpolation between two levels, three components a node, as PETSc matrices.
class Transfer {
  public:
    /// Collective. `rows`: between the two, must outlive this. The interpolation is there after the
    /// first `set_constrained`.
    Transfer(const PartitionedMesh& fine, const PartitionedMesh& coarse, const TransferRows& rows);

    /// Coarse to fine; zero in rows of constrained fine components and columns of constrained
    /// coarse ones.
    Mat interpolation() const { return interpolation_.get(); }
    /// Fine displacement to coarse displacement: the weighted mean of the fine nodes around a
    /// coarse one.
    void restrict_displacement(Vec fine, Vec coarse) const;

    /// `fine_components`, `coarse_components`: of this rank's own nodes. Collective.
    void set_constrained(const PartitionedMesh& fine, std::span<const std::uint8_t> fine_components,
                         std::span<const std::uint8_t> coarse_components);

  private:
    void make_mean(const PartitionedMesh& fine, const PartitionedMesh& coarse);

    const TransferRows& rows_;
    PetscHandle<Mat> interpolation_;
    PetscHandle<Mat> mean_of_one_, mean_;  ///< of a number a node, and the same for three
};

}  // namespace livetet
