#pragma once

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

#include "apps/bench/core_watch.hpp"
#include "apps/plots/pictures.hpp"
#include "base/progress.hpp"

namespace livetet {

/// Frames of one kind of element, law and mesh with a fixed number of iterations. The errors are
/// whole: of elements, law, patch and solver, against the truth.
struct FrontRow {
    std::string elements;  ///< P1, P2: tets of four and ten nodes; Q1: hexahedra of a voxel grid
    std::string law;
    bool graded = false;  ///< shorter edges at the patch; else of even length
    double poisson = 0;
    std::size_t cells = 0, nodes = 0;
    int iterations = 0;
    FrameTimes times{};                                ///< of frames that are not judged
    double forces_s = 0, operator_s = 0, solve_s = 0;  ///< means of its stages
    double solver = 0;  ///< RMS over nodes, of the distance from the converged frame, m
    double rms = 0;     ///< RMS over targets and frames, of the distance from the truth, m
    double worst = 0;   ///< of the same distances, m
    double volume_change =
        0;  ///< largest change of the body's volume at the deepest press, share of it
    bool on_front = false;  ///< no row is both faster (median) and has a smaller error (rms)
};

struct FrontOptions {
    int frames = 10000;             ///< timed frames of each row
    int error_frames = 180;         ///< its first frames, whose errors are taken
    int truth_tets = 14000;         ///< ten-node tets of the truth
    int threads = 0;                ///< see solver.threads
    double poisson = 0.45;          ///< from 0.49 on with pressures
    std::filesystem::path organ{};  ///< see read_front_organ; empty: the phantom
    int label = 0;
};

struct Front {
    std::string organ;  ///< its name
    std::vector<FrontRow> rows;
};

/// An organ pressed by 15 mm once a second, sixty frames a second, by a sensor without noise;
/// static, with four-node and ten-node tets of several meshes: corotated and neo-Hookean on even
/// ones, neo-Hookean on graded ones; neo-Hookean on grids. Truth: `press_front_organ`.
Front measure_front(const FrontOptions& options, ProgressLine& progress);

void print_front(const Front& front);
nlohmann::json json_of(const std::vector<FrontRow>& rows);
/// Sets `on_front` of each row.
void mark_front(std::vector<FrontRow>& rows);
/// Error against median frame time, a line for each kind of element, law and mesh, and the front.
WorkPrecisionChart chart_of(const Front& front);

}  // namespace livetet
