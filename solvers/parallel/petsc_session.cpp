#include "solvers/parallel/petsc_session.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <iterator>
#include <set>
#include <sstream>

#include "base/error.hpp"
#include "base/log.hpp"
#include "base/petsc.hpp"

namespace livetet {

namespace {

constexpr const char* asked_at_the_end[] = {
    "-options_", "-log_", "-malloc_",  "-memory_",   "-objects_dump",
    "-mpidump",  "-info", "-on_error", "-citations", "-get_total_flops"};

/// Views are drawn at the end of a solve; what replaces a preconditioner is made when it fails.
bool is_looked_up_late(const std::string& name) {
    return name.find("view") != name.npos || name.find("substitute_") != name.npos;
}

bool options_were_given = false;

void check_may_begin() {
    PetscBool runs = PETSC_FALSE;
    LIVETET_PETSC(PetscInitialized(&runs));
    if (runs) fail("PetscSession: PETSc runs already, expected one session in a program");
    int ended = 0;
    MPI_Finalized(&ended);
    if (ended) fail("PetscSession: MPI has ended, expected one session in a program");
}

}  // namespace

PetscSession::PetscSession(std::string program, std::vector<std::string> petsc_arguments) {
    check_may_begin();
    options_were_given = options_were_given || !petsc_arguments.empty();
    // Signals are the program's own; first, so that an option given can say otherwise.
    arguments_ = {std::move(program), "-no_signal_handler"};
    std::move(petsc_arguments.begin(), petsc_arguments.end(), std::back_inserter(arguments_));
    std::vector<char*> pointers;
    for (std::string& a : arguments_) pointers.push_back(a.data());
    pointers.push_back(nullptr);
    int count = static_cast<int>(arguments_.size());
    char** values = pointers.data();
    PETSC_MPI_THREAD_REQUIRED = MPI_THREAD_SERIALIZED;  // see SlicedTask
    LIVETET_PETSC(PetscInitialize(&count, &values, nullptr, nullptr));
    LIVETET_PETSC(PetscPushErrorHandler(PetscIgnoreErrorHandler, nullptr));
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank_);
    MPI_Comm_size(PETSC_COMM_WORLD, &ranks_);
}

PetscSession::~PetscSession() {
    // A failure under mpirun leaves MPI alive for whoever catches it: finalising would wait for
    // ranks that do not come.
    if (ranks_ > 1 && std::uncaught_exceptions() > exceptions_) return;
    PetscFinalize();
}

bool PetscSession::any_options() { return options_were_given; }

void PetscSession::tell_unused_options(Moment moment) {
    if (moment == Moment::set_up && std::exchange(is_set_up_told_, true)) return;
    PetscInt count = 0;
    char **names = nullptr, **values = nullptr;
    if (rank_ > 0 || PetscOptionsLeftGet(nullptr, &count, &names, &values)) return;
    std::set<std::string> given(arguments_.begin(), arguments_.end());
    std::istringstream words(of_scene_);
    given.insert(std::istream_iterator<std::string>(words), {});
    for (PetscInt k = 0; k < count; ++k) {
        const std::string name = std::string("-") + names[k];
        // Not reported: options that our own code sets, and those that PETSc reads at its end.
        const bool of_the_end =
            std::any_of(std::begin(asked_at_the_end), std::end(asked_at_the_end),
                        [&](const char* begin) { return name.starts_with(begin); });
        const bool may_come = moment == Moment::set_up && is_looked_up_late(name);
        if (given.contains(name) && !of_the_end && !may_come && told_.insert(name).second)
            log_warning(fmt::format(
                "PETSc option {} was not used: expected the name of an option of a solver that the "
                "scene has",
                name));
    }
    PetscOptionsLeftRestore(nullptr, &count, &names, &values);
}

void PetscSession::add_options(const std::string& options) {
    bool takes_value = false;  // the word before: an option's name
    std::istringstream words(options);
    for (std::string word; words >> word;) {
        const bool is_name =
            word[0] == '-' &&
            !(word.size() > 1 &&
              (std::isdigit(static_cast<unsigned char>(word[1])) || word[1] == '.'));
        if (!is_name && !takes_value && options.find_first_of("\"'{}") == options.npos)
            fail(
                "solver.petsc_options = \"{}\": found '{}' where an option's name should be, "
                "expected -name value ...",
                options, word);
        takes_value = is_name;
    }
    if (PetscOptionsInsertString(nullptr, options.c_str()))
        fail("solver.petsc_options = \"{}\" cannot be read by PETSc, expected -name value ...",
             options);
    std::string line;
    for (std::size_t i = 1; i < arguments_.size(); ++i) line += arguments_[i] + " ";
    LIVETET_PETSC(PetscOptionsInsertString(nullptr, line.c_str()));
    of_scene_ = options;
    options_were_given = options_were_given || !options.empty();
}

}  // namespace livetet
