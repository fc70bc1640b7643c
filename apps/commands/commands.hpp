#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace livetet {

/// What a sub-command says to `main`: its exit status. 0 well, 1 a benchmark missed a target, 2 bad
/// input, 3 not converged; 70: our fault.
struct ExitStatus {
    int value = 0;
};

// Each adds its sub-command, whose callback runs it. Errors are thrown.
void add_mesh_command(CLI::App& app);
void add_calibrate_command(CLI::App& app);
void add_fiducials_command(CLI::App& app, ExitStatus& status);
void add_register_command(CLI::App& app);
void add_scene_command(CLI::App& app);
void add_explain_command(CLI::App& app);
void add_solve_command(CLI::App& app, ExitStatus& status);
void add_study_command(CLI::App& app, ExitStatus& status);
void add_tune_command(CLI::App& app, ExitStatus& status);
void add_bench_command(CLI::App& app, ExitStatus& status);
void add_track_command(CLI::App& app, ExitStatus& status);
void add_record_command(CLI::App& app);
void add_serve_command(CLI::App& app);
void add_report_command(CLI::App& app);
void add_warp_command(CLI::App& app);
void add_phantom_command(CLI::App& app);
void add_view_command(CLI::App& app, ExitStatus& status);

/// The arguments that a sub-command did not know, as PETSc's ("-ksp_view"). Throws Error for one
/// that looks like a mistyped option of ours ("--jsn") or that stands alone.
std::vector<std::string> petsc_arguments(const CLI::App& command);

}  // namespace livetet
