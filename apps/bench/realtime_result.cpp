#include "apps/bench/realtime_result.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>

#include "base/error.hpp"

namespace livetet {

using nlohmann::json;

// Of four nodes by displacements: batches and rotations in float are read once for rotations and
// once for forces.
FrameBytes bytes_of_frame(const DeformableBody& body, std::size_t tets, std::size_t nodes,
                          double iterations, TimeScheme scheme) {
    const double batches = static_cast<double>(tets) / batch_width<float>;
    const double vector = 24.0 * static_cast<double>(nodes);
    const double of_state = scheme == TimeScheme::static_equilibrium ? 6 : 23;  // read or written
    const double of_start = 21;     // six solutions in float three times, and what is made of them
    const double of_iteration = 7;  // all but x in float
    const LinearSolver& op = body.linear_solver();
    return {
        .forces = batches * (2 * sizeof(TetBatch<float>) + 2 * sizeof(RotationBatch<float>)) +
                  of_state * vector,
        .operators = op.bytes_of_update(),
        .solve = op.bytes_of_solve(iterations) + (of_start + of_iteration * iterations) * vector};
}

Gap gap_between(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
    Gap gap;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double d = (a[i] - b[i]).norm();
        gap.rms += d * d / static_cast<double>(a.size());
        gap.node = d > gap.node || std::isnan(d) ? d : gap.node;
        gap.largest = std::max(gap.largest, b[i].norm());
    }
    gap.rms = std::sqrt(gap.rms);
    return gap;
}

namespace {

json stages_of(const std::vector<Measured>& frames) {
    const auto median_ms = [&](auto&& part) {
        std::vector<double> values;
        for (const Measured& m : frames) values.push_back(1e3 * part(m));
        return distribution(std::move(values)).median;
    };
    return {{"sensor", median_ms([](const Measured& m) { return m.sensor_s; })},
            {"forces", median_ms([](const Measured& m) { return m.step.forces_s; })},
            {"operator", median_ms([](const Measured& m) { return m.step.operator_s; })},
            {"solve", median_ms([](const Measured& m) { return m.step.solve_s; })},
            {"finish", median_ms([](const Measured& m) { return m.step.finish_s; })},
            {"output", median_ms([](const Measured& m) { return m.output_s; })}};
}

/// Milliseconds that the bytes of each stage take at the measured bandwidth.
json least_stages(const RealtimeResult& r) {
    const auto ms = [&](double bytes) { return 1e3 * bytes / r.bandwidth; };
    return {{"forces", ms(r.bytes.forces)},
            {"operator", ms(r.bytes.operators)},
            {"solve", ms(r.bytes.solve)}};
}

std::string text_of_stages(const json& stages) {
    std::string text;
    for (const auto& [name, ms] : stages.items())
        text += fmt::format("  {} {:.2f}", name, ms.get<double>());
    return text;
}

}  // namespace

void take_times(RealtimeResult& result, const std::vector<Measured>& frames) {
    std::vector<FrameSample> times;
    for (const Measured& m : frames) {
        times.push_back({m.seconds, m.cores});
        result.cycles_mean += m.step.iterations / static_cast<double>(frames.size());
        result.cut_short += m.step.cut_short;
        result.half_renewed += m.step.half_renewed;
    }
    result.times = frame_times(times);
    result.stages = stages_of(frames);
}

void take_errors(RealtimeResult& result, const std::vector<Measured>& frames) {
    double largest = 0, count = 0;
    for (const Measured& m : frames) largest = std::max(largest, m.largest);
    for (const Measured& m : frames) {
        if (m.error < 0) continue;
        ++count;
        result.references_not_converged += !m.reference_converged;
        result.error_mean += m.error / largest;
        result.error_worst = std::max(result.error_worst, m.error / largest);
        result.node_error_mean += m.node_error / largest;
        result.node_error_worst = std::max(result.node_error_worst, m.node_error / largest);
        result.estimate_mean += m.step.linear_error / largest;
    }
    for (double* mean : {&result.error_mean, &result.node_error_mean, &result.estimate_mean})
        *mean /= std::max(count, 1.0);
}

json json_of(const RealtimeResult& r) {
    return {{"case", r.name},
            {"motion", r.motion},
            {"tets", r.tets},
            {"nodes", r.nodes},
            {"nu", r.nu},
            {"frames", r.times.all.count},
            {"times", json_of(r.times)},
            {"ms_median", 1e3 * r.times.all.median},
            {"ms_p99", 1e3 * r.times.all.p99},
            {"fps_median", 1 / r.times.all.median},
            {"fps_p99", r.rate()},
            {"fps_asked", r.target.rate},
            {"error_mean", r.error_mean},
            {"error_worst", r.error_worst},
            {"error_mean_allowed", r.target.mean_error},
            {"error_worst_allowed", r.target.worst_error},
            {"error_estimate_mean", r.estimate_mean},
            {"node_error_mean", r.node_error_mean},
            {"node_error_worst", r.node_error_worst},
            {"ms_by_stage", r.stages},
            {"cycles_mean", r.cycles_mean},
            {"frames_cut_short", r.cut_short},
            {"frames_half_renewed", r.half_renewed},
            {"references_not_converged", r.references_not_converged},
            {"bytes_moved_per_frame", r.bytes.total()},
            {"ms_by_stage_at_bandwidth", least_stages(r)},
            {"bandwidth_bytes_per_s", r.bandwidth},
            {"fraction_of_bandwidth", r.bytes.total() / r.times.all.median / r.bandwidth},
            {"threads", r.threads},
            {"allocations", r.allocations},
            {"blocked", r.times.blocked},
            {"jump", r.jump},
            {"held", r.meets_target()},
            {"held_with_cores_alone", r.meets_target() && !r.in_time()}};
}

void print_realtime_header() {
    fmt::print(
        "{:<6} {:<8} {:>5} {:>8} {:>7} | {:>7} {:>7} {:>7} {:>6} {:>6} | {:>16} {:>9} {:>16} | "
        "{:>6} {:>6} {:>6}  {}\n",
        "case", "motion", "nu", "tets", "nodes", "median", "p99", "p99 *", "fps", "asked",
        "error mean/worst", "estimate", "worst node", "cycles", "bytes", "alloc", "held");
    fmt::print(
        "{:<6} {:<8} {:>5} {:>8} {:>7} | {:>7} {:>7} {:>7} {:>6} {:>6} | {:>16} {:>9} {:>16} | "
        "{:>6} {:>6} {:>6}\n",
        "", "", "", "", "", "ms", "ms", "ms", "at p99", "", "% RMS of nodes", "%", "% mean/worst",
        "", "of bw", "+block");
    fmt::print("* of the frames that had their cores: no involuntary switch, no steal\n");
}

void print_row(const RealtimeResult& r) {
    const std::string held = !r.meets_target() ? "NO" : r.in_time() ? "yes" : "yes *";
    fmt::print(
        "{:<6} {:<8} {:>5} {:>8} {:>7} | {:>7.2f} {:>7.2f} {:>7} {:>6.0f} {:>6.0f} | {:>7.3f} / "
        "{:>6.3f} {:>9.3f} {:>7.2f} / {:>6.2f} | {:>6.2f} {:>5.0f}% {:>6}  {}\n",
        r.name, r.motion, r.nu, r.tets, r.nodes, 1e3 * r.times.all.median, 1e3 * r.times.all.p99,
        p99_with_cores_text(r.times), r.rate(), r.target.rate, 100 * r.error_mean,
        100 * r.error_worst, 100 * r.estimate_mean, 100 * r.node_error_mean,
        100 * r.node_error_worst, r.cycles_mean,
        100 * r.bytes.total() / r.times.all.median / r.bandwidth,
        fmt::format("{}+{}", r.allocations, r.times.blocked), held);
    fmt::print("       {}\n", core_use_text(r.times));
    fmt::print("       ms by stage:{}\n", text_of_stages(r.stages));
    fmt::print("       no less at this bandwidth, by the bytes moved:{}\n",
               text_of_stages(least_stages(r)));
    if (r.references_not_converged > 0)
        fmt::print(
            "       {} of the frames' references did not converge: errors against what they "
            "reached\n",
            r.references_not_converged);
    if (!r.jump.is_null()) {
        std::string errors;
        for (const auto& e : r.jump["error"])
            errors += fmt::format(" {:.2f}", 100 * e.get<double>());
        fmt::print("       10 mm jump, % RMS in the ten frames after:{}{}\n", errors,
                   r.jump["finite"].get<bool>() ? "" : "  NOT FINITE");
    }
    std::fflush(stdout);
}

}  // namespace livetet
