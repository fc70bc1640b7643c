#pragma once

#include <span>
#include <vector>

#include "base/petsc.hpp"
#include "mechanics/material.hpp"
#include "mechanics/tet_kernels.hpp"
#include "solvers/mesh_share.hpp"

namespace livetet {

/// How PETSc stores the operator: 3x3 blocks (fastest product), or scalars (what hypre, GAMG, factorisations and the
/// Galerkin product take).
enum class MatrixLayout { blocks, scalars };

/// The elements and the operator of one mesh level: A = s K(R) + m M, where K(R) is the stiffness with each element's
/// rotation held and M the lumped mass; rows and columns of constrained components are those of the identity.
class ElasticLevel {
  public:
    /// Collective. `materials` by region: exactly one applies to each tet (throws Error where none does).
    ElasticLevel(const TetMesh& mesh, MeshShare share, std::span<const Material> materials, StrainModel strain,
                 MatrixLayout layout);

    const MeshShare& share() const { return share_; }
    Mat matrix() const { return matrix_.get(); }
    /// Lumped mass of each owned node, kg.
    std::span<const double> node_mass() const { return node_mass_; }
    /// Constrained components of each local node (bit 0: x, 1: y, 2: z).
    std::span<const std::uint8_t> constrained() const { return constrained_; }

    /// `components`: for every node of the whole mesh.
    void set_constrained(std::span<const std::uint8_t> components);

    /// Takes every element's rotation from the displacement `u` (ghosts up to date). Linear strain: nothing to do.
    void update_rotations(Vec u);

    /// Writes s K(R) + m M into the matrix.
    void assemble(double s, double m);

    /// f = elastic force of displacement `u`, in N, at all owned nodes, constrained ones too (where it is the
    /// reaction).
    void elastic_force(Vec u, Vec f) const;

    /// f += factor K(R) v.
    void add_stiffness_times(double factor, Vec v, Vec f) const;

    /// Strain energy, J, of displacement `u` with the rotations held; collective.
    double strain_energy(Vec u) const;

  private:
    void make_elements(const TetMesh& mesh, std::span<const Material> materials);
    void make_pattern();
    void make_matrix(const TetMesh& mesh, MatrixLayout layout);
    void find_positions();
    template <class StressOf>
    void scatter_forces(const double* values, StressOf&& stress_of, Vec f) const;

    /// Rows of 3x3 blocks: `start[i]` .. `start[i + 1]` are the blocks of owned node i; `columns` in ascending order.
    struct BlockRows {
        std::vector<std::int32_t> start{0};
        std::vector<std::int32_t> columns;
    };
    /// Adds a block at `position` of `rows`, in either layout.
    struct BlockAdder;

    MeshShare share_;
    StrainModel strain_;
    MatrixLayout layout_;
    std::vector<TetElement> elements_;
    std::vector<Eigen::Matrix3d> rotations_;
    std::vector<double> node_mass_;
    std::vector<std::uint8_t> constrained_;
    BlockRows diagonal_, off_diagonal_;  ///< columns: local nodes; local nodes less owned
    /// For element e, entry 4 i + j: the row of node i when owned (else -1) ...
    struct Position {
        std::int32_t row, block;  ///< block: k-th block in that row; < 0: -1 - k in the off-diagonal part
    };
    std::vector<std::array<Position, 16>> positions_;
    struct MaskedBlock {
        std::int32_t row, block;
        std::uint8_t row_components, column_components;
        bool on_diagonal;
    };
    std::vector<MaskedBlock> masked_;
    PetscHandle<Mat> matrix_;
    double identity_ = 1;  ///< what stands on the diagonal of constrained rows
};

}  // namespace livetet
