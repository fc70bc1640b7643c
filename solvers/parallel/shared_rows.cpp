#include "solvers/parallel/shared_rows.hpp"

namespace livetet {

namespace {

/// So many elements of an MPI type, moved as one. One is the type itself: of a derived type of one
/// element PETSc has MPI take the sum, which MPI cannot.
class RowType {
  public:
    RowType(std::size_t count, MPI_Datatype of) : type_(of), is_own_(count != 1) {
        if (!is_own_) return;
        MPI_Type_contiguous(static_cast<int>(count), of, &type_);
        MPI_Type_commit(&type_);
    }
    ~RowType() {
        if (is_own_) MPI_Type_free(&type_);
    }
    RowType(const RowType&) = delete;
    RowType& operator=(const RowType&) = delete;
    MPI_Datatype get() const { return type_; }

  private:
    MPI_Datatype type_;
    bool is_own_;
};

}  // namespace

SharedRows::SharedRows(MPI_Comm comm, std::size_t owned, std::span<const PetscInt> used)
    : owned_(owned), used_(used.size()) {
    PetscLayout layout = nullptr;
    LIVETET_PETSC(PetscLayoutCreateFromSizes(comm, static_cast<PetscInt>(owned), PETSC_DETERMINE, 1,
                                             &layout));
    LIVETET_PETSC(PetscSFCreate(comm, sf_.out()));
    LIVETET_PETSC(PetscSFSetGraphLayout(sf_.get(), layout, static_cast<PetscInt>(used.size()),
                                        nullptr, PETSC_COPY_VALUES, used.data()));
    LIVETET_PETSC(PetscLayoutDestroy(&layout));
    LIVETET_PETSC(PetscSFSetUp(sf_.get()));
}

void SharedRows::broadcast(const void* of_owned, void* of_used, MPI_Datatype type,
                           std::size_t numbers) const {
    const RowType row(numbers, type);
    LIVETET_PETSC(PetscSFBcastBegin(sf_.get(), row.get(), of_owned, of_used, MPI_REPLACE));
    LIVETET_PETSC(PetscSFBcastEnd(sf_.get(), row.get(), of_owned, of_used, MPI_REPLACE));
}

std::vector<double> SharedRows::reduce(std::span<const double> of_used, int components,
                                       MPI_Op op) const {
    const RowType row(static_cast<std::size_t>(components), MPI_DOUBLE);
    std::vector<double> of_owned(owned_ * static_cast<std::size_t>(components), 0.0);
    LIVETET_PETSC(PetscSFReduceBegin(sf_.get(), row.get(), of_used.data(), of_owned.data(), op));
    LIVETET_PETSC(PetscSFReduceEnd(sf_.get(), row.get(), of_used.data(), of_owned.data(), op));
    return of_owned;
}

}  // namespace livetet
