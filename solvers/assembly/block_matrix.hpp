#pragma once

#include <span>
#include <vector>

#include "mechanics/block_pattern.hpp"
#include "solvers/parallel/partitioned_mesh.hpp"

namespace livetet {

/// How PETSc stores the operator: 3x3 blocks (fastest product), or scalars (what hypre, GAMG,
/// factorisations and the Galerkin product take).
enum class MatrixLayout { blocks, scalars };

/// A PETSc matrix of 3x3 blocks between the nodes that share a tet, filled straight into PETSc's
/// arrays. Rows and columns of constrained components are those of the identity.
class BlockMatrix {
  public:
    /// Collective.
    BlockMatrix(const PartitionedMesh& share, MatrixLayout layout);

    /// The six rigid motions, which algebraic multigrid wants; `positions` of the local nodes, m.
    /// Collective.
    void set_rigid_motions(const PartitionedMesh& share, std::span<const Vector3> positions);

    Mat get() const { return matrix_.get(); }

    /// Of local nodes.
    const BlockPattern& pattern() const { return pattern_; }
    MatrixLayout layout() const { return layout_; }

    /// Constrained components of each local node (bit 0: x, 1: y, 2: z).
    void set_constrained(std::span<const std::uint8_t> components);

    /// Fills the matrix anew: zero at first, `add` what it is made of, then `finish`.
    class Filling;

  private:
    struct MaskedBlock {
        std::int32_t row, column;
        std::uint8_t row_components, column_components;
    };
    /// The arrays behind a PETSc matrix of either layout: of its diagonal and its off-diagonal
    /// part.
    class Arrays;

    void make_matrix(const PartitionedMesh& share);
    void check_pattern() const;

    MatrixLayout layout_;
    BlockPattern pattern_;
    std::vector<MaskedBlock> masked_;
    PetscHandle<Mat> matrix_;
};

class BlockMatrix::Arrays {
  public:
    Arrays(Mat matrix, MatrixLayout layout);
    ~Arrays();
    Arrays(const Arrays&) = delete;
    Arrays& operator=(const Arrays&) = delete;
    Mat part(int p) const { return parts_[p]; }

    PetscScalar* data[2] = {nullptr, nullptr};

  private:
    MatrixLayout layout_;
    Mat parts_[2] = {nullptr, nullptr};
};

class BlockMatrix::Filling {
  public:
    explicit Filling(BlockMatrix& matrix);

    /// Adds to the block (row, column) of local nodes, which stands at `place` of the pattern.
    void add(std::int32_t row, std::int32_t column, std::int32_t place, const Eigen::Matrix3d& K) {
        const int part = matrix_.pattern_.part_of(column);
        for (int b = 0; b < 3; ++b)
            for (int a = 0; a < 3; ++a) at(row, part, place, a, b) += K(a, b);
    }
    /// PETSc's array of the diagonal (0) or off-diagonal (1) part, `blocks` layout: 9 numbers a
    /// block, column-major.
    std::span<double> blocks(int part) {
        return {arrays_.data[part], 9 * matrix_.pattern_.size(part)};
    }
    /// Adds factor times a matrix of the same mesh and layout.
    void add(const BlockMatrix& other, double factor);
    /// Adds to the three diagonal entries of an owned node.
    void add_diagonal(std::int32_t node, double value) {
        const std::int32_t place = matrix_.pattern_.place(node, node);
        for (int a = 0; a < 3; ++a) at(node, 0, place, a, a) += value;
    }
    /// Puts the identity, at the size of the mean of the diagonal, into constrained rows and
    /// columns. Collective.
    void finish();

  private:
    /// Where entry (a, b) of a block stands. Both layouts hold the same rows of blocks. `blocks`:
    /// block k of row i starts at 9 (start_i + k), column-major. `scalars`: scalar row a of node i
    /// starts at 9 start_i + 3 a (blocks in the row), and block k is at + 3 k.
    PetscScalar& at(std::int32_t row, int part, std::int32_t place, int a, int b) {
        const auto block = static_cast<std::size_t>(place);
        if (matrix_.layout_ == MatrixLayout::blocks)
            return arrays_.data[part][9 * block + 3 * b + a];
        const Lists& rows = matrix_.pattern_.rows(part);
        const std::size_t start = rows.start[row], length = rows.start[row + 1] - start;
        return arrays_.data[part][9 * start + a * 3 * length + 3 * (block - start) + b];
    }

    BlockMatrix& matrix_;
    Arrays arrays_;
};

}  // namespace livetet
