#include "solvers/linear/live_solver.hpp"

#include "solvers/linear/live_support.hpp"

namespace livetet {

namespace {

/// What a shell matrix and a shell preconditioner do: work(multigrid, x, y) on local arrays.
template <class Shell, class Get, class Work>
PetscErrorCode in_shell(Get get, Shell shell, Vec x, Vec y, Work&& work) noexcept {
    return in_callback([&] {
        void* context = nullptr;
        LIVETET_PETSC(get(shell, &context));
        const ReadArray from(x);
        WriteArray to(y);
        work(*static_cast<SinglePrecisionMultigrid*>(context), from.span(), to.span());
    });
}

int rank_count(MPI_Comm comm) {
    int ranks = 1;
    MPI_Comm_size(comm, &ranks);
    return ranks;
}

}  // namespace

LiveSolver::LiveSolver(const DistributedHierarchy& mesh, const ElasticModel& model,
                       const SolverOptions& options, ThreadTeam& team)
    : DisplacementSolver(mesh, Role::solver, team), constraints_(mesh.hierarchy) {
    if (const std::string reason = why_not_live(model, mesh.hierarchy, rank_count(mesh.comm));
        !reason.empty())
        fail("solver.kind = live: {}", reason);
    std::vector<LevelAssembler*> levels;
    std::vector<const BarycentricMap*> maps;
    for (std::size_t l = 0; l < mesh.hierarchy.levels.size(); ++l) {
        add_level(mesh, model, SinglePrecision{});
        levels.push_back(levels_.back().get());
    }
    for (const BarycentricMap& map : mesh.hierarchy.transfers) maps.push_back(&map);
    const HeapMeter meter(&costs_.preconditioner);
    multigrid_ = std::make_unique<SinglePrecisionMultigrid>(
        std::move(levels), std::move(maps),
        options.smoothing_steps > 0 ? options.smoothing_steps : 1, team);
    make_shell(mesh.comm);
    make_krylov(mesh.comm, ErrorEstimate::from_steps);
}

void LiveSolver::make_shell(MPI_Comm comm) {
    const PetscInt n = 3 * fine().share().owned;
    LIVETET_PETSC(MatCreateShell(comm, n, n, n, n, multigrid_.get(), shell_.out()));
    const auto multiply = [](Mat A, Vec x, Vec y) noexcept -> PetscErrorCode {
        return in_shell(MatShellGetContext, A, x, y,
                        [](auto& multigrid, auto from, auto to) { multigrid.multiply(from, to); });
    };
    LIVETET_PETSC(MatShellSetOperation(
        shell_.get(), MATOP_MULT,
        reinterpret_cast<void (*)()>(static_cast<PetscErrorCode (*)(Mat, Vec, Vec)>(multiply))));
}

void LiveSolver::configure(PC pc) {
    LIVETET_PETSC(PCSetType(pc, PCSHELL));
    LIVETET_PETSC(PCShellSetName(pc, "multigrid in single precision, re-discretised"));
    LIVETET_PETSC(PCShellSetContext(pc, multigrid_.get()));
    const auto apply = [](PC shell, Vec r, Vec z) noexcept -> PetscErrorCode {
        return in_shell(PCShellGetContext, shell, r, z,
                        [](auto& multigrid, auto from, auto to) { multigrid.cycle(from, to); });
    };
    LIVETET_PETSC(PCShellSetApply(pc, apply));
}

void LiveSolver::set_constrained(std::span<const std::uint8_t> components) {
    constraints_.set_constrained(levels_, components);
    multigrid_->set_constrained();
    invalidate();
}

void LiveSolver::set_springs(std::span<const double> stiffness) {
    constraints_.set_springs(levels_, stiffness);
    multigrid_->set_constrained();
    invalidate();
}

void LiveSolver::find_mass() {
    timed_mass([&] {
        for (const auto& level : levels_) level->find_mass();
    });
}

RenewalExtent LiveSolver::renew(const Configuration& at, const OperatorTerms& terms,
                                RenewalExtent wanted) {
    return multigrid_->update(*at.rotations, terms.whole_stiffness(), terms.mass, wanted);
}

std::string LiveSolver::preconditioner_name() const {
    return fmt::format("multigrid in single precision, {} levels, rediscretised", level_count());
}

}  // namespace livetet
