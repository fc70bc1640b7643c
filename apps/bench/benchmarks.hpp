#pragma once

namespace CLI {
class App;
}

namespace livetet {

// Each adds its sub-command to `livetet bench`. The sub-command's callback runs the benchmark,
// prints its tables and sets `status` to the exit status: 0, or 1 if a target is missed.
// Errors are thrown.
void add_verification_benchmark(CLI::App& bench, int& status);
void add_scaling_benchmark(CLI::App& bench, int& status);
void add_workprecision_benchmark(CLI::App& bench, int& status);
void add_convergence_benchmark(CLI::App& bench, int& status);
void add_savings_benchmark(CLI::App& bench, int& status);
void add_stability_benchmark(CLI::App& bench, int& status);

// These exist only in a build with images.
void add_realtime_benchmark(CLI::App& bench, int& status);
void add_latency_benchmark(CLI::App& bench, int& status);
void add_view_benchmark(CLI::App& bench, int& status);
void add_accuracy_benchmark(CLI::App& bench, int& status);
void add_registration_benchmark(CLI::App& bench, int& status);
void add_warp_benchmark(CLI::App& bench, int& status);

}  // namespace livetet
