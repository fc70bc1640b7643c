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

#include "geometry/transform.hpp"
#include "io/result_file.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// One kept frame of a tracked run, without its displacement.
struct RunFrame {
    double time_s = 0;  ///< the tracker sample's own time stamp
    RigidTransform<Tracker, ImageFrame>
        tracker_from_image;  ///< not finite while there was no registration yet
    double frame_ms = 0, operator_ms = 0, forces_ms = 0, solve_ms = 0;
    std::optional<double> sensor_ms, finish_ms,
        output_ms;  ///< the other stages; not in the oldest files
    int iterations = 0;
    double residual = 0;
    std::optional<double> error_estimate_mm;  ///< of what was left unsolved, RMS over the nodes;
                                              ///< the live solver's alone
    bool cut_short = false;                   ///< by the budget, before the solver's tolerance
    double press_mm = 0;                      ///< length of the patch's displacement
    bool registration_held = false, registration_lost = false;
    bool converged = true;
    /// How many sensors are in each DriveStatus; not in the oldest files.
    std::optional<std::array<double, 6>> sensors;
};

struct RunFiducial {
    std::string name;
    double residual_mm = 0;
    std::optional<double>
        leave_one_out_mm;  ///< its distance from where the other fiducials alone put it
};

/// What a run says about itself as a whole.
struct RunInfo {
    std::size_t samples = 0, frames = 0,
                missed = 0;     ///< tracker samples, frames computed, samples never computed
    std::size_t not_kept = 0;   ///< frames that the disk was too slow for, or too full
    double interval_ms = 0;     ///< time between two samples
    double budget_ms = 0;       ///< what a frame may take: track.budget, else the interval
    bool budget_given = false;  ///< there is a track.budget: frames were cut short to keep it
    double fre_mm = 0;
    std::vector<RunFiducial> fiducials;
    std::size_t tets = 0, nodes = 0, levels = 0;
    std::string solver, version;  ///< solver: empty where the run does not say
    std::string problem;  ///< what ended the recording before its time; empty where nothing did
};

/// A tracked run as plain data. Displacements are large and are read one frame at a time.
struct RunResult {
    std::string source;      ///< the file, for messages
    std::string scene_text;  ///< with every value it resolved to; empty where there is none
    TetMesh mesh;            ///< with the node sets "fixed" and "patch", where they are known
    std::vector<RunFrame> frames;
    RunInfo info;
    std::function<std::vector<Vector3>(std::size_t frame)> displacement;  ///< of each node, metres
};

/// `text`, the JSON that a run left about itself. Throws Error naming `source` and the key that is
/// missing or wrong.
RunInfo parse_run_info(const std::string& text, const std::string& source);

/// Opens what `livetet track` wrote. Where the mesh has no node sets "fixed" and "patch" they are
/// read off the frame of the deepest press: the surface nodes that did not move, and those that
/// moved exactly as far as the sensor. Throws Error for a file that is none of its, or holds no
/// frame.
RunResult read_run_result(std::shared_ptr<const ResultReader> reader,
                          const std::filesystem::path& path);

}  // namespace livetet
