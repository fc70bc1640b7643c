#include "apps/bench/benchmarks.hpp"
#include "apps/commands/commands.hpp"

namespace livetet {

void add_bench_command(CLI::App& app, ExitStatus& status) {
    CLI::App* bench =
        app.add_subcommand("bench", "Runs a benchmark: verification, accuracy or run time");
    bench->require_subcommand(1);
    add_verification_benchmark(*bench, status.value);
    add_scaling_benchmark(*bench, status.value);
    add_workprecision_benchmark(*bench, status.value);
    add_convergence_benchmark(*bench, status.value);
    add_savings_benchmark(*bench, status.value);
    add_stability_benchmark(*bench, status.value);
#ifdef LIVETET_IMAGES
    add_realtime_benchmark(*bench, status.value);
    add_latency_benchmark(*bench, status.value);
    add_view_benchmark(*bench, status.value);
    add_accuracy_benchmark(*bench, status.value);
    add_registration_benchmark(*bench, status.value);
    add_warp_benchmark(*bench, status.value);
#endif
}

}  // namespace livetet
