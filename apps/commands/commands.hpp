#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace livetet {

/// A sub-command's exit status: 0 success, 1 a benchmark missed a target, 2 bad input, 3 not
/// converged, 70 internal error.
struct ExitStatus {
    int value = 0;
};

// Each adds its sub-command, whose callback runs it and throws errors.
void add_mesh_command(CLI::App& app);
void add_calibrate_command(CLI::App& app);
void add_fiducials_command(CLI::App& app, ExitStatus& status);
void add_register_command(CLI::App& app, ExitStatus& status);
void add_scene_command(CLI::App& app);
void add_reference_command(CLI::App& app);
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

/// Arguments that a sub-command does not know, for PETSc ("-ksp_view"). Throws Error if one looks
/// like a mistyped option of ours ("--jsn") or has no dash.
std::vector<std::string> petsc_arguments(const CLI::App& command);

}  // namespace livetet
