#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/live/error_statement.hpp"
#include "apps/live/pose_quality.hpp"
#include "geometry/transform.hpp"
#include "io/result_file.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// One kept frame of a tracked run, without its displacement.
struct RunFrame {
    double time_s = 0;  ///< the tracker sample's own time stamp
    RigidTransform<Tracker, ImageFrame>
        tracker_from_image;  ///< not finite before the first registration
    double frame_ms = 0, operator_ms = 0, forces_ms = 0, solve_ms = 0;
    std::optional<double> sensor_ms, finish_ms,
        output_ms;                       ///< further stages; missing in the oldest files
    std::optional<double> statement_ms;  ///< none without targets
    std::optional<double> ahead_ms;      ///< by which poses were extrapolated; none in older files
    int iterations = 0;
    double residual = 0;
    std::optional<double>
        error_estimate_mm;   ///< of the last linear solve, RMS over the nodes; live solver only
    bool cut_short = false;  ///< stopped by the budget before the solver's tolerance
    double press_mm = 0;     ///< length of the patch's displacement
    bool registration_held = false, registration_lost = false;
    bool converged = true;
    double turned_elements = 0;  ///< see FrameState; 0 in older files
    FrameStatement statement;    ///< without targets if the scene has none
    /// Number of sensors in each DriveStatus; missing in the oldest files.
    std::optional<std::array<double, 6>> sensors;
    std::uint64_t slipped = 0;  ///< see slipped_sensors
};

struct RunFiducial {
    std::string name;
    double residual_mm = 0;
    std::optional<double>
        leave_one_out_mm;  ///< distance from its position predicted by the other fiducials
};

/// What blades cut in a run.
struct RunCuts {
    std::size_t openings = 0;                 ///< how often nodes were doubled
    std::size_t parted = 0;                   ///< pairs of neighbouring cells that were parted
    std::size_t nodes_added = 0;              ///< copies
    std::size_t pieces = 1, free_pieces = 0;  ///< of the body at the end; see CutMesh
    double longest_ms = 0;                    ///< longest time that an opening took of a frame
    double prepared_ms = 0;                   ///< longest time that preparing one took
    std::size_t gaps = 0;                     ///< blade paths that were not cut; see BladeGaps
    double gaps_mm = 0;                       ///< their length, all together
    bool waits = false;                       ///< something was cut that had not opened at the end
};

/// Summary of a run.
struct RunInfo {
    std::size_t samples = 0, frames = 0,
                missed = 0;       ///< tracker samples, computed frames, samples without a frame
    std::size_t not_kept = 0;     ///< frames lost because the disk was slow or full
    double interval_ms = 0;       ///< median time between two samples
    double mean_interval_ms = 0;  ///< its mean; the median in older files
    double budget_ms = 0;         ///< time limit of a frame: track.budget, else the interval
    bool budget_given = false;    ///< track.budget is set: frames were cut short to keep it
    PoseQualities poses;          ///< of the reference and the sensors; none in older files
    double fre_mm = 0;
    std::vector<RunFiducial> fiducials;
    std::size_t tets = 0, nodes = 0, levels = 0;
    std::string solver, version;  ///< solver: empty if unknown
    std::string problem;          ///< why the recording ended early; empty if it did not
    std::optional<RunCuts> cuts;  ///< none: the scene has no blade
};

/// A tracked run as plain data. Displacements are large and are read one frame at a time.
struct RunResult {
    std::string source;      ///< the file, for messages
    std::string scene_text;  ///< with all defaults filled in; may be empty
    TetMesh mesh;            ///< with the node sets "fixed" and "patch", if known
    std::vector<RunFrame> frames;
    std::vector<std::string> targets;  ///< names of those of each frame's statement
    RunInfo info;
    std::function<std::vector<Vector3>(std::size_t frame)> displacement;  ///< of each node, metres
    std::function<TetMesh()> first_mesh;                                  ///< before blades cut it
};

/// Parses the JSON summary of a run. Throws Error naming `source` and the missing or wrong key.
RunInfo parse_run_info(const std::string& text, const std::string& source);

/// Opens a result of `livetet track`. If the mesh has no node sets "fixed" and "patch", they are
/// derived from the frame of the deepest press: surface nodes that did not move, and those that
/// moved exactly as far as the sensor. Throws Error if the file is not such a result, or holds no
/// frame.
RunResult read_run_result(std::shared_ptr<const ResultReader> reader,
                          const std::filesystem::path& path);

}  // namespace livetet
