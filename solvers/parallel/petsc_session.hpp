#pragma once

#include <exception>
#include <set>
#include <string>
#include <vector>

namespace livetet {

/// MPI and PETSc for the life of a program. One a program; every body must end before it. If MPI
/// runs already it is used and left running. PETSc's signal handlers are not installed, unless its
/// option `-no_signal_handler 0` asks for them. PETSc's own error text is kept off the screen: it
/// comes as an exception.
class PetscSession {
  public:
    /// `petsc_arguments`: what of the command line is PETSc's ("-ksp_view", "-ksp_rtol", "1e-4").
    /// Throws Error if PETSc runs already, or MPI has ended.
    PetscSession(std::string program, std::vector<std::string> petsc_arguments);
    ~PetscSession();
    PetscSession(const PetscSession&) = delete;
    PetscSession& operator=(const PetscSession&) = delete;

    int rank() const { return rank_; }
    int ranks() const { return ranks_; }
    /// A scene's options: as if given before the command line, which wins. Throws Error where PETSc
    /// cannot read them, or would pass over a word.
    void add_options(const std::string& options);

    /// Whether any session of this program was given options: an error of PETSc is then probably
    /// caused by one of them.
    static bool any_options();
    /// A line on stderr, once, for each option, of the command line's and the scene's, that no
    /// object of PETSc has looked up. `set_up`: the run's objects are, but have not ended: options
    /// that are looked up later are not told.
    enum class Moment { set_up, end };
    void tell_unused_options(Moment moment);

  private:
    std::vector<std::string> arguments_;
    std::string of_scene_;  ///< its options
    int rank_ = 0, ranks_ = 1;
    bool is_set_up_told_ = false;
    std::set<std::string> told_;  ///< options
    int exceptions_ = std::uncaught_exceptions();
};

}  // namespace livetet
