#pragma once

#include <CLI/CLI.hpp>

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/live/frame_loop.hpp"
#include "base/stop_token.hpp"

namespace livetet {

struct TrackArguments {
    std::filesystem::path scene, json, replay;
    bool every_sample = false;
    std::string publish;
    std::optional<double> length_s{};
};

/// Adds the options of `livetet track` that `livetet view` has, too.
void add_track_options(CLI::App& command, TrackArguments& arguments);

/// Makes the observer of a run once its mesh is loaded. `stop` belongs to the run: the observer may
/// request a stop.
using ObserverMaker = std::function<std::unique_ptr<FrameObserver>(
    const Scene& scene, const TetMesh& mesh, const StopSource& stop)>;

/// Follows the tracker of a scene until its source ends, Ctrl-C, or the observer requests a stop;
/// writes result and report, then waits for the observer. `petsc`: options for PETSc. Returns the
/// exit status; throws Error.
int run_track(const TrackArguments& arguments, const std::vector<std::string>& petsc,
              const ObserverMaker& make_observer = {});

}  // namespace livetet
