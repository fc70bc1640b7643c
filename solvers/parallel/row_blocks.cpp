#include "solvers/parallel/row_blocks.hpp"

namespace livetet {

namespace {

/// That many doubles, moved as one.
class RowType {
  public:
    explicit RowType(int components) {
        MPI_Type_contiguous(components, MPI_DOUBLE, &type_);
        MPI_Type_commit(&type_);
    }
    ~RowType() { MPI_Type_free(&type_); }
    RowType(const RowType&) = delete;
    RowType& operator=(const RowType&) = delete;
    MPI_Datatype get() const { return type_; }

  private:
    MPI_Datatype type_ = MPI_DATATYPE_NULL;
};

}  // namespace

RowRange row_range(MPI_Comm comm, std::size_t rows) {
    int rank = 0, ranks = 1;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &ranks);
    return row_range(rows, static_cast<std::size_t>(rank), static_cast<std::size_t>(ranks));
}

RowBlocks::RowBlocks(MPI_Comm comm, std::size_t rows, std::span<const std::int32_t> mine)
    : block_(row_range(comm, rows)), mine_(mine.size()) {
    PetscLayout layout = nullptr;
    LIVETET_PETSC(PetscLayoutCreateFromSizes(comm, static_cast<PetscInt>(block_.size()),
                                             static_cast<PetscInt>(rows), 1, &layout));
    const std::vector<PetscInt> numbers(mine.begin(), mine.end());
    LIVETET_PETSC(PetscSFCreate(comm, sf_.out()));
    LIVETET_PETSC(PetscSFSetGraphLayout(sf_.get(), layout, static_cast<PetscInt>(numbers.size()),
                                        nullptr, PETSC_COPY_VALUES, numbers.data()));
    LIVETET_PETSC(PetscLayoutDestroy(&layout));
    LIVETET_PETSC(PetscSFSetUp(sf_.get()));
}

std::vector<double> RowBlocks::to_block(std::span<const double> of_mine, int components) const {
    const RowType row(components);
    std::vector<double> of_block(block_.size() * static_cast<std::size_t>(components), 0.0);
    LIVETET_PETSC(
        PetscSFReduceBegin(sf_.get(), row.get(), of_mine.data(), of_block.data(), MPI_REPLACE));
    LIVETET_PETSC(
        PetscSFReduceEnd(sf_.get(), row.get(), of_mine.data(), of_block.data(), MPI_REPLACE));
    return of_block;
}

std::vector<double> RowBlocks::from_block(std::span<const double> of_block, int components) const {
    const RowType row(components);
    std::vector<double> of_mine(mine_ * static_cast<std::size_t>(components), 0.0);
    LIVETET_PETSC(
        PetscSFBcastBegin(sf_.get(), row.get(), of_block.data(), of_mine.data(), MPI_REPLACE));
    LIVETET_PETSC(
        PetscSFBcastEnd(sf_.get(), row.get(), of_block.data(), of_mine.data(), MPI_REPLACE));
    return of_mine;
}

}  // namespace livetet
