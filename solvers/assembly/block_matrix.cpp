#include "solvers/assembly/block_matrix.hpp"

#include <petscmat.h>

#include <algorithm>
#include <stdexcept>

namespace livetet {

BlockMatrix::Arrays::Arrays(Mat matrix, MatrixLayout layout) : layout_(layout) {
    PetscBool parallel = PETSC_FALSE;
    LIVETET_PETSC(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(matrix), &parallel,
                                            MATMPIBAIJ, MATMPIAIJ, ""));
    parts_[0] = matrix;
    if (parallel && layout == MatrixLayout::blocks)
        LIVETET_PETSC(MatMPIBAIJGetSeqBAIJ(matrix, &parts_[0], &parts_[1], nullptr));
    else if (parallel)
        LIVETET_PETSC(MatMPIAIJGetSeqAIJ(matrix, &parts_[0], &parts_[1], nullptr));
    for (int p = 0; p < 2; ++p)
        if (parts_[p])
            LIVETET_PETSC(layout == MatrixLayout::blocks ? MatSeqBAIJGetArray(parts_[p], &data[p])
                                                         : MatSeqAIJGetArray(parts_[p], &data[p]));
}

BlockMatrix::Arrays::~Arrays() {
    for (int p = 0; p < 2; ++p)
        if (parts_[p])
            layout_ == MatrixLayout::blocks ? MatSeqBAIJRestoreArray(parts_[p], &data[p])
                                            : MatSeqAIJRestoreArray(parts_[p], &data[p]);
}

BlockMatrix::BlockMatrix(const PartitionedMesh& share, MatrixLayout layout)
    : layout_(layout),
      pattern_(share.tets.size(), share.nodes_per_tet(), share.nodes.size(), share.owned,
               [&](std::size_t e, int i) { return share.node(e, i); }) {
    make_matrix(share);
    check_pattern();
}

void BlockMatrix::make_matrix(const PartitionedMesh& share) {
    int ranks = 1;
    MPI_Comm_size(share.comm, &ranks);
    const bool blocks = layout_ == MatrixLayout::blocks;
    const int expand = blocks ? 1 : 3;  // scalar rows a block row
    const std::int32_t owned = pattern_.owned();
    std::vector<PetscInt> nnz[2];
    for (std::int32_t i = 0; i < owned; ++i)
        for (int a = 0; a < expand; ++a)
            for (int p = 0; p < 2; ++p)
                nnz[p].push_back(expand * static_cast<PetscInt>(pattern_.rows(p)[i].size()));
    LIVETET_PETSC(MatCreate(share.comm, matrix_.out()));
    Mat A = matrix_.get();
    LIVETET_PETSC(MatSetSizes(A, 3 * owned, 3 * owned, PETSC_DETERMINE, PETSC_DETERMINE));
    LIVETET_PETSC(MatSetBlockSize(A, 3));
    LIVETET_PETSC(MatSetType(
        A, ranks > 1 ? (blocks ? MATMPIBAIJ : MATMPIAIJ) : (blocks ? MATSEQBAIJ : MATSEQAIJ)));
    LIVETET_PETSC(MatSeqBAIJSetPreallocation(A, 3, 0, nnz[0].data()));
    LIVETET_PETSC(MatMPIBAIJSetPreallocation(A, 3, 0, nnz[0].data(), 0, nnz[1].data()));
    LIVETET_PETSC(MatSeqAIJSetPreallocation(A, 0, nnz[0].data()));
    LIVETET_PETSC(MatMPIAIJSetPreallocation(A, 0, nnz[0].data(), 0, nnz[1].data()));
    std::vector<PetscInt> columns;
    const std::vector<PetscScalar> zeros(static_cast<std::size_t>(9) * 512, 0.0);
    for (std::int32_t i = 0; i < owned; ++i) {
        columns.clear();
        for (int p = 0; p < 2; ++p)
            for (const std::int32_t column : pattern_.rows(p)[i])
                columns.push_back(share.numbers[p * owned + column]);
        for (std::size_t k = 0; k < columns.size(); k += 512)
            LIVETET_PETSC(MatSetValuesBlocked(
                A, 1, &share.numbers[i],
                static_cast<PetscInt>(std::min<std::size_t>(512, columns.size() - k)),
                columns.data() + k, zeros.data(), INSERT_VALUES));
    }
    LIVETET_PETSC(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    LIVETET_PETSC(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
    if (!blocks) {  // parallel BAIJ does not take the options
        LIVETET_PETSC(MatSetOption(A, MAT_SYMMETRIC, PETSC_TRUE));
        LIVETET_PETSC(MatSetOption(A, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
    }
    LIVETET_PETSC(MatSetOption(A, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_TRUE));
}

void BlockMatrix::set_rigid_motions(const PartitionedMesh& share,
                                    std::span<const Vector3> positions) {
    const PetscHandle<Vec> x = make_vector(share);
    {
        WriteArray values(x.get());
        for (std::int32_t i = 0; i < pattern_.owned(); ++i)
            for (int c = 0; c < 3; ++c) values[3 * i + c] = positions[i][c];
    }
    LIVETET_PETSC(VecSetBlockSize(x.get(), 3));
    PetscHandle<MatNullSpace> rigid;
    LIVETET_PETSC(MatNullSpaceCreateRigidBody(x.get(), rigid.out()));
    LIVETET_PETSC(MatSetNearNullSpace(matrix_.get(), rigid.get()));
}

void BlockMatrix::check_pattern() const {
    // Filling writes into PETSc's arrays by this pattern: PETSc must have exactly these rows.
    const Arrays arrays(matrix_.get(), layout_);
    for (int p = 0; p < 2; ++p) {
        if (!arrays.part(p)) continue;
        MatInfo info;
        LIVETET_PETSC(MatGetInfo(arrays.part(p), MAT_LOCAL, &info));
        if (info.nz_used != 9.0 * static_cast<double>(pattern_.size(p)))
            throw std::logic_error("BlockMatrix: PETSc's pattern differs from the mesh's");
    }
}

void BlockMatrix::set_constrained(std::span<const std::uint8_t> components) {
    masked_.clear();
    const std::int32_t owned = pattern_.owned();
    for (std::int32_t i = 0; i < owned; ++i)
        for (int p = 0; p < 2; ++p)
            for (const std::int32_t column : pattern_.rows(p)[i]) {
                const std::int32_t j = p * owned + column;
                if (components[i] | components[j])
                    masked_.push_back({i, j, components[i], components[j]});
            }
    masked_.shrink_to_fit();
}

BlockMatrix::Filling::Filling(BlockMatrix& matrix)
    : matrix_(matrix), arrays_(matrix.get(), matrix.layout_) {
    for (int p = 0; p < 2; ++p)
        if (arrays_.data[p]) std::fill_n(arrays_.data[p], 9 * matrix_.pattern_.size(p), 0.0);
}

void BlockMatrix::Filling::add(const BlockMatrix& other, double factor) {
    const Arrays from(other.get(), other.layout_);
    for (int p = 0; p < 2; ++p)
        if (arrays_.data[p])
            for (std::size_t i = 0; i < 9 * matrix_.pattern_.size(p); ++i)
                arrays_.data[p][i] += factor * from.data[p][i];
}

void BlockMatrix::Filling::finish() {
    const BlockPattern& pattern = matrix_.pattern_;
    double identity = 1;
    if (const std::int32_t owned = pattern.owned()) {
        double sum = 0;
        for (std::int32_t i = 0; i < owned; ++i) {
            const std::int32_t place = pattern.place(i, i);
            for (int a = 0; a < 3; ++a) sum += at(i, 0, place, a, a);
        }
        identity = sum / (3 * owned);
    }
    for (const MaskedBlock& b : matrix_.masked_) {
        const int part = pattern.part_of(b.column);
        const std::int32_t place = pattern.place(b.row, b.column);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                if ((b.row_components >> i & 1) || (b.column_components >> j & 1))
                    at(b.row, part, place, i, j) = b.row == b.column && i == j ? identity : 0;
    }
    LIVETET_PETSC(MatAssemblyBegin(matrix_.get(), MAT_FINAL_ASSEMBLY));
    LIVETET_PETSC(MatAssemblyEnd(matrix_.get(), MAT_FINAL_ASSEMBLY));
}

}  // namespace livetet
