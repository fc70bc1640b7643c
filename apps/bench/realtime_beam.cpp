#include <fmt/format.h>

#include <numbers>

#include "apps/bench/allocation_count.hpp"
#include "apps/bench/realtime_cases.hpp"
#include "base/stopwatch.hpp"

namespace livetet {

namespace {

Constraints beam_constraints(const TetMesh& mesh, double t) {
    Constraints constraints(mesh.nodes.size());
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
        const Vector3& x = mesh.nodes[i];
        const std::int32_t n = static_cast<std::int32_t>(i);
        if (x.x() < 1e-9) constraints.prescribe(std::span(&n, 1), Vector3::Zero());
        if (x.z() > 0.1 - 1e-9 && std::abs(x.x() - 0.1) <= 0.0165 &&
            std::abs(x.y() - 0.05) <= 0.0165)
            constraints.prescribe(std::span(&n, 1),
                                  {0, 0, -0.02 * std::sin(2 * std::numbers::pi * 0.75 * t)});
    }
    return constraints;
}

}  // namespace

RealtimeResult measure_beam(const BeamSize& size, const MeshHierarchy& hierarchy,
                            const RealtimeArguments& arguments, double bandwidth,
                            ProgressLine& progress) {
    constexpr double dt = 1.0 / 30;
    constexpr int steps = 30;
    const int turns = (arguments.frames + steps - 1) / steps;
    const Material material{.young_Pa = 5000, .poisson = 0.45, .density_kg_per_m3 = 1000};
    const ElasticModel model{std::span(&material, 1), "corotated", Formulation::displacement};
    const TimeOptions time{
        .scheme = TimeScheme::implicit_euler, .rayleigh_alpha = 0.1, .rayleigh_beta = 0.1};
    const TetMesh& mesh = hierarchy.levels.front();
    RealtimeResult result;
    result.name = size.name;
    result.is_beam = true;
    result.motion = "euler";
    result.nu = 0.45;
    result.bandwidth = bandwidth;
    result.tets = mesh.tets.size();
    result.nodes = mesh.nodes.size();
    result.target = {1 / size.budget_s, size.allowed, size.allowed};

    std::vector<Vector3> reached;
    {
        DeformableBody body({PETSC_COMM_SELF, hierarchy}, model, time,
                            {.kind = SolverKind::live, .threads = arguments.threads});
        result.threads = body.threads();
        reached.resize(mesh.nodes.size());
        std::vector<Measured> frames;
        CoreWatch watch;
        for (int turn = 0; turn <= turns; ++turn) {  // the first one warms up
            body.set_displacement(std::vector<Vector3>(mesh.nodes.size(), Vector3::Zero()));
            body.set_velocity(std::vector<Vector3>(mesh.nodes.size(), Vector3::Zero()));
            for (int k = 1; k <= steps; ++k) {
                const Constraints constraints = beam_constraints(mesh, k * dt);
                const auto allocations = allocations_of_this_thread();
                Measured m;
                watch.start();
                const auto start = Clock::now();
                body.set_constraints(constraints);
                m.step =
                    body.advance(dt, {.linear_tolerance = 1e-4, .max_iterations = size.iterations});
                body.displacement(reached);
                m.seconds = seconds_since(start);
                m.cores = watch.stop();
                if (turn == 0) continue;
                result.allocations += allocations_of_this_thread() - allocations;
                frames.push_back(m);
            }
            progress.update(0.3 * turn / (turns + 1), size.name + ": times");
        }
        take_times(result, frames);
        for (const Measured& m : frames)
            result.estimate_mean += m.step.linear_error / static_cast<double>(frames.size()) / 0.02;
        result.bytes =
            bytes_of_frame(body, result.tets, result.nodes, result.cycles_mean, time.scheme);
    }
    DeformableBody converged({PETSC_COMM_SELF, hierarchy}, model, time,
                             {.kind = SolverKind::live, .threads = arguments.threads});
    for (int k = 1; k <= steps; ++k) {
        progress.update(0.3 + 0.7 * k / steps, size.name + ": converged run");
        converged.set_constraints(beam_constraints(mesh, k * dt));
        result.references_not_converged +=
            !converged.solve(dt, {.max_newton = 60, .tolerance = 1e-6, .linear_tolerance = 1e-2})
                 .converged;
    }
    const std::vector<Vector3> truth = converged.displacement();
    double gap = 0, size_of = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        gap += (truth[i] - reached[i]).squaredNorm();
        size_of += truth[i].squaredNorm();
    }
    result.error_mean = result.error_worst = std::sqrt(gap / size_of);
    const Gap worst = gap_between(reached, truth);
    result.node_error_mean = result.node_error_worst = worst.node / worst.largest;
    return result;
}

}  // namespace livetet
