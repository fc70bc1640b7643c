#include "solvers/linear/hex_solver.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "solvers/assembly/grid_damping.hpp"
#include "solvers/linear/shells.hpp"

namespace livetet {

namespace {

/// The coarsest level has no more cells, unless coarsening brings no fewer. Levels whose cells are
/// as wide as the bridge of a body cut nearly through are too stiff there, so have few of them.
constexpr std::size_t cells_to_factor = 600;

HexCells cells_of(const TetMesh& mesh, const LevelAssembler& level) {
    HexCells cells;
    cells.frame = level.element(0);
    cells.frame.volume = cell_volume(mesh);
    cells.shares = mesh.shares;
    cells.dilation = level.has_mean_dilation() ? Dilation::of_cell : Dilation::of_points;
    for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e) {
        const auto moduli = level.lame_moduli(e);
        const auto found = std::find(cells.moduli.begin(), cells.moduli.end(), moduli);
        cells.material.push_back(static_cast<std::int32_t>(found - cells.moduli.begin()));
        if (found == cells.moduli.end()) cells.moduli.push_back(moduli);
    }
    return cells;
}

}  // namespace

HexSolver::HexSolver(DistributedHierarchy mesh, const ElasticModel& model,
                     const SolverOptions& options)
    : DisplacementSolver(mesh, Role::solver, ThreadTeam::alone()) {
    if (options.kind != SolverKind::automatic && options.kind != SolverKind::multigrid)
        fail(
            "solver.kind: found another than multigrid for a grid of hexahedra, expected "
            "automatic, "
            "multigrid or live");
    const TetMesh& grid = mesh.whole->levels.front();
    add_level(mesh, model, GeometryOnly{});
    const HeapMeter meter(&costs_.preconditioner);
    multigrid_ =
        std::make_unique<HexMultigrid>(hex_levels(grid, cells_to_factor), cells_of(grid, fine()),
                                       options.smoothing_steps > 0 ? options.smoothing_steps : 4);
    shell_ = make_shell_matrix<&HexSolver::multiply>(mesh.comm, 3 * fine().share().owned, *this);
    make_krylov(mesh.comm, ErrorEstimate::none);
}

void HexSolver::configure(PC pc) {
    make_shell_preconditioner<&HexSolver::cycle>(pc, *this, "multigrid over a grid of hexahedra");
}

void HexSolver::set_constrained(std::span<const std::uint8_t> components) {
    fine().set_constrained(components);
    multigrid_->set_constrained(fine().constrained());
    invalidate();
}

void HexSolver::set_springs(std::span<const double> stiffness) {
    fine().set_springs(stiffness);
    invalidate();
}

RenewalExtent HexSolver::renew(const Configuration& at, const OperatorTerms& terms,
                               RenewalExtent /*wanted*/) {
    at_ = at;
    terms_ = terms;
    // The same for models that rotate; the others have no tangent with frozen rotations.
    if (terms.tangent == Tangent::frozen_rotation) terms_.tangent = Tangent::positive;
    const auto mass = fine().node_mass();
    const auto springs = fine().springs();
    diagonal_.clear();
    if (terms.mass != 0 || !springs.empty()) {
        diagonal_.assign(fine().share().nodes.size(), 0);
        for (std::size_t n = 0; n < diagonal_.size(); ++n)
            diagonal_[n] =
                (terms.mass != 0 ? terms.mass * mass[n] : 0) + (springs.empty() ? 0 : springs[n]);
    }
    std::vector<Eigen::Matrix3d> rotations;
    std::vector<CellDilation> dilations;
    if (!fine().is_linear()) rotations = fine().cell_rotations(at.u);
    if (!fine().is_linear() && fine().has_mean_dilation()) {
        dilations = fine().cell_dilations(at);
        for (std::size_t e = 0; e < dilations.size(); ++e) {
            const auto [lambda, mu] = fine().lame_moduli(e);
            const double of_volume =
                terms.stiffness * lambda + terms.damping * damped_lambda(lambda, mu);
            dilations[e] *= std::sqrt(of_volume / (terms.whole_stiffness() * lambda));
        }
    }
    multigrid_->update(terms.whole_stiffness(), diagonal_, rotations, dilations);
    return RenewalExtent::whole;
}

void HexSolver::multiply(std::span<const double> x, std::span<double> y) {
    if (fine().is_linear()) {
        multigrid_->multiply(x, y);
    } else {
        std::fill(y.begin(), y.end(), 0.0);
        fine().add_hexahedra_times(terms_.stiffness, terms_.tangent, at_, x, y);
        if (terms_.damping != 0) fine().add_grid_damping_times(terms_.damping, x, y);
        for (std::size_t n = 0; n < diagonal_.size(); ++n)
            for (int d = 0; d < 3; ++d) y[3 * n + d] += diagonal_[n] * x[3 * n + d];
    }
    // Those of the identity, as of a matrix: residuals are zero there, and stay so.
    const auto constrained = fine().constrained();
    for (std::size_t i = 0; i < y.size(); ++i)
        if (constrained[i / 3] >> (i % 3) & 1) y[i] = x[i];
}

std::string HexSolver::preconditioner_name() const {
    return fmt::format("multigrid over hexahedra, {} levels, matrix-free", level_count());
}

}  // namespace livetet
