#include "solvers/petsc_session.hpp"

#include <fmt/format.h>

#include <csignal>

#include "base/error.hpp"
#include "base/petsc.hpp"

namespace livetet {

PetscSession::PetscSession(std::string program, std::vector<std::string> petsc_arguments)
    : arguments_(std::move(petsc_arguments)) {
    arguments_.insert(arguments_.begin(), std::move(program));
    std::vector<char*> pointers;
    for (std::string& a : arguments_) pointers.push_back(a.data());
    pointers.push_back(nullptr);
    int count = static_cast<int>(arguments_.size());
    char** values = pointers.data();
    // PETSc takes SIGHUP for an error in the program, but where it is ignored.
    const auto hang_up = std::signal(SIGHUP, SIG_IGN);
    const PetscErrorCode failure = PetscInitialize(&count, &values, nullptr, nullptr);
    std::signal(SIGHUP, hang_up);
    LIVETET_PETSC(failure);
    LIVETET_PETSC(PetscPushErrorHandler(PetscIgnoreErrorHandler, nullptr));
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank_);
    MPI_Comm_size(PETSC_COMM_WORLD, &ranks_);
}

PetscSession::~PetscSession() {
    // A failure under mpirun leaves MPI alive for whoever catches it: finalising would wait for ranks that do not come.
    if (ranks_ > 1 && std::uncaught_exceptions() > exceptions_) return;
    if (std::uncaught_exceptions() == exceptions_) tell_unused_options();
    PetscFinalize();
}

void PetscSession::tell_unused_options() const {
    PetscInt count = 0;
    char **names = nullptr, **values = nullptr;
    if (rank_ > 0 || PetscOptionsLeftGet(nullptr, &count, &names, &values)) return;
    for (PetscInt k = 0; k < count; ++k) fmt::print(stderr, "livetet: nothing asked PETSc for its option -{}: is it spelt right, of a solver that the scene has?\n", names[k]);
    PetscOptionsLeftRestore(nullptr, &count, &names, &values);
}

void PetscSession::add_options(const std::string& options) {
    if (PetscOptionsInsertString(nullptr, options.c_str()))
        fail("solver.petsc_options = \"{}\" cannot be read by PETSc, expected -name value ...", options);
    std::string line;
    for (std::size_t i = 1; i < arguments_.size(); ++i) line += arguments_[i] + " ";
    LIVETET_PETSC(PetscOptionsInsertString(nullptr, line.c_str()));
}

}  // namespace livetet
