#include "solvers/linear/live_solver.hpp"

#include <algorithm>
#include <sstream>

#include "base/piece_sums.hpp"
#include "base/sliced_task.hpp"
#include "solvers/linear/live_support.hpp"
#include "solvers/linear/shells.hpp"

namespace livetet {

namespace {

/// The preconditioner's model: Hooke's law, turned unless all is of small strain. Materials keep
/// their moduli.
std::vector<Material> of_bodys_model(std::span<const Material> materials) {
    std::vector<Material> all(materials.begin(), materials.end());
    for (Material& m : all) m.model = {};
    return all;
}

/// The hierarchy, where a live solver takes it; else throws Error.
const MeshHierarchy& checked(const DistributedHierarchy& mesh, const ElasticModel& model) {
    const std::string reason =
        mesh.whole ? why_not_live(model, *mesh.whole)
                   : fmt::format("found {} ranks, expected one", mesh.levels.front().share.ranks);
    if (!reason.empty()) fail("solver.kind = live: {}", reason);
    return *mesh.whole;
}

GridHierarchy grid_of(const MeshHierarchy& hierarchy) {
    const TetMesh& mesh = hierarchy.levels.front();
    return mesh.hexahedra.empty() ? GridHierarchy{}
                                  : grid_hierarchy(mesh, GridCycle::cells_to_factor);
}

}  // namespace

LiveSolver::LiveSolver(DistributedHierarchy mesh, const ElasticModel& model,
                       const SolverOptions& options, Role role, ThreadTeam& team)
    : DisplacementSolver(mesh, role, team), grid_(grid_of(checked(mesh, model))) {
    if (!grid_.levels.empty()) mesh = DistributedHierarchy::of_grid(mesh.comm, grid_.meshes);
    pause_point();
    add_levels(mesh, model);
    constraints_.emplace(std::move(mesh.between));
    make_cycle(*mesh.whole, options.smoothing_steps > 0 ? options.smoothing_steps : 1);
    shell_ = make_shell_matrix<&LiveSolver::multiply>(mesh.comm, 3 * fine().share().owned, *this);
    run_vectors_on_team<LiveSolver>(shell_.get());
    make_krylov(mesh.comm, ErrorEstimate::from_steps);
    if (role == Role::preconditioner) return;
    watch_curvature(&is_curved_down_);
    PetscBool is_viewed = PETSC_FALSE;
    LIVETET_PETSC(PetscOptionsHasName(nullptr, nullptr, "-ksp_view", &is_viewed));
    is_viewed_ = is_viewed;
    SingleSystem& system = *this;  // its base is private
    if (iterates_itself())
        gradients_ = std::make_unique<ConjugateGradients>(
            system, 3 * static_cast<std::size_t>(fine().share().owned), team_);
}

bool LiveSolver::iterates_itself() const {
    char* all = nullptr;
    LIVETET_PETSC(PetscOptionsGetAll(nullptr, &all));
    std::istringstream options(all);
    LIVETET_PETSC(PetscFree(all));
    constexpr std::string_view heeded[] = {"-ksp_rtol", "-ksp_atol", "-ksp_max_it", "-ksp_monitor",
                                           "-ksp_view"};
    for (std::string option; options >> option;)
        if (option.starts_with("-ksp_") && std::ranges::none_of(heeded, [&](std::string_view name) {
                return option.starts_with(name);
            }))
            return false;
    return preconditions_by(PCSHELL);
}

LinearReport LiveSolver::solve(Vec b, Vec b_p, Vec x, Vec x_p, const LinearControls& controls,
                               LinearStart start) {
    if (!gradients_) return DisplacementSolver::solve(b, b_p, x, x_p, controls, start);
    const LinearControls asked = set_tolerances(controls);
    const bool goes_on = start == LinearStart::earlier_solves;
    PetscReal size = 0;
    LIVETET_PETSC(VecNorm(b, NORM_2, &size));
    gradients_->begin(b, goes_on ? &earlier_ : nullptr);
    stopping_->begin(asked, std::max(asked.relative_tolerance * size, user_residual_));
    begin_solve(gradients_->has_start());
    KSPConvergedReason reason = gradients_->run(x, *stopping_, krylov_.get());
    if (reason < 0 && change_preconditioner(reason)) {
        stopping_->resume(gradients_->iterations());
        gradients_->renew_residual(b, x);
        reason = gradients_->run(x, *stopping_, krylov_.get());
    }
    if (goes_on) {
        if (!image_) LIVETET_PETSC(VecDuplicate(x, image_.out()));
        gradients_->image(b, image_.get());
    }
    if (is_viewed_) LIVETET_PETSC(KSPViewFromOptions(krylov_.get(), nullptr, "-ksp_view"));
    LinearReport report;
    report.error = stopping_->end();
    report.iterations = gradients_->iterations();
    report.residual = gradients_->residual();
    finish_report(reason, report);
    return report;
}

void LiveSolver::add_levels(DistributedHierarchy& mesh, const ElasticModel& model) {
    const std::vector<Material> materials = of_bodys_model(model.materials);
    const ElasticModel hooke{
        materials, is_small_strain(model.materials, model.strain) ? "linear" : "corotated",
        Formulation::displacement};
    for (std::size_t l = 0; l < mesh.levels.size(); ++l) {
        add_level(mesh, l == 0 ? model : hooke, SinglePrecision{});
        pause_point();
    }
}

void LiveSolver::make_cycle(const MeshHierarchy& hierarchy, int smoothing_steps) {
    const HeapMeter meter(&costs_.preconditioner);
    const bool is_quadratic = !hierarchy.levels.front().edge_nodes.empty();
    const bool is_grid = !grid_.levels.empty();
    if (is_grid || is_quadratic || !fine().has_frozen_force())  // always in the mixed form
        fine_ = std::make_unique<MatrixFreeOperator>(fine(), team_);
    pause_point();
    std::vector<LevelAssembler*> levels;
    std::vector<const BarycentricMap*> maps;
    for (std::size_t l = is_quadratic ? 1 : 0; l < levels_.size(); ++l) {
        levels.push_back(levels_[l].get());
        if (l + 1 < levels_.size()) maps.push_back(&hierarchy.transfers[l]);
    }
    if (is_grid) {
        cycle_ =
            std::make_unique<GridCycle>(std::move(levels), grid_.levels, smoothing_steps, team_);
        return;
    }
    auto multigrid = std::make_unique<SinglePrecisionMultigrid>(std::move(levels), std::move(maps),
                                                                smoothing_steps, team_);
    if (is_quadratic) {
        cycle_ = std::make_unique<QuadraticCycle>(*fine_, *levels_[1], std::move(multigrid),
                                                  hierarchy.transfers[0], smoothing_steps, team_);
        return;
    }
    assembled_ = multigrid.get();
    cycle_ = std::move(multigrid);
}

void LiveSolver::configure(PC pc) {
    make_shell_preconditioner<&LiveSolver::cycle>(pc, *this,
                                                  "multigrid in single precision, re-discretised");
}

void LiveSolver::set_constrained(std::span<const std::uint8_t> components) {
    constraints_->set_constrained(levels_, components);
    if (fine_) fine_->set_constrained();
    cycle_->set_constrained();
    invalidate();
}

void LiveSolver::set_springs(std::span<const double> stiffness) {
    constraints_->set_springs(levels_, stiffness);
    if (fine_) fine_->set_constrained();
    cycle_->set_constrained();
    invalidate();
}

void LiveSolver::find_mass() {
    timed_mass([&] {
        for (const auto& level : levels_) level->find_mass();
    });
}

RenewalExtent LiveSolver::renew(const Configuration& at, const OperatorTerms& terms,
                                RenewalExtent wanted) {
    const double s = terms.whole_stiffness(), m = terms.mass;
    if (fine_) fine_->update(*at.rotations, s, m);
    if (terms.tangent == Tangent::positive) take_positive();
    return cycle_->update(*at.rotations, s, m, wanted);
}

void LiveSolver::multiply(std::span<const double> x, std::span<double> y) {
    if (assembled_ && !takes_law()) {
        assembled_->multiply(x, y);
        return;
    }
    fine_->multiply(x, y);
    if (takes_law() && dot_on_team(team_, x.data(), y.data(), x.size()) < 0) is_curved_down_ = true;
}

void LiveSolver::apply(std::span<float> x, std::span<float> y) {
    if (assembled_ && !takes_law())
        assembled_->multiply(x, y);
    else
        fine_->multiply(x, y);
}

void LiveSolver::multiply_mixed(MatrixFreeCoupling& coupling, std::span<const double> x,
                                std::span<const double> q, std::span<double> y,
                                std::span<double> g) {
    const auto free = fine_->free(), shift = fine_->shift();
    if (takes_law()) {
        coupling.multiply(fine_->stiffness_factor(), x, q, y, g);
        fine_->over_components([&](std::size_t i) { y[i] = free[i] * (y[i] + shift[i] * x[i]); });
        return;
    }
    coupling.multiply(0, x, q, y, g);
    positive_.resize(y.size());
    fine_->multiply(x, positive_);
    fine_->over_components([&](std::size_t i) { y[i] = free[i] * y[i] + positive_[i]; });
}

bool LiveSolver::change_preconditioner(KSPConvergedReason reason) {
    if (reason != KSP_DIVERGED_INDEFINITE_MAT || !fine_ || fine_->tangent() != Tangent::exact)
        return false;
    fine_->take(Tangent::frozen_rotation);
    return true;
}

double LiveSolver::bytes_of_solve(double iterations) const {
    const double product = fine_ ? fine_->bytes_of_multiply() : assembled_->bytes_of_multiply();
    return (iterations + 1) * product + iterations * cycle_->bytes_of_cycle();
}

std::string LiveSolver::preconditioner_name() const {
    return fmt::format("multigrid in single precision{}, {} levels, rediscretised",
                       grid_.levels.empty() ? "" : " over hexahedra", level_count());
}

}  // namespace livetet
