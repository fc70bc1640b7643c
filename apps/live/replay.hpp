#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/scene/scene.hpp"
#include "base/progress.hpp"

namespace livetet {

/// A change of the scene during a run: the frame that it came before, and the whole scene from then
/// on.
struct SceneEvent {
    std::size_t frame = 0;
    std::string scene;
};

/// Result of a replay.
struct [[nodiscard]] ReplayReport {
    std::size_t frames = 0, same = 0;
    std::size_t first_other =
        0;                   ///< first frame that differs in any bit; meaningful if same < frames
    double largest_gap = 0;  ///< largest distance of a node from its recorded position, m
};

/// `solver.petsc_options` of a recorded run's scene, which a replay needs, too.
std::string petsc_options_of_run(const std::filesystem::path& result);

/// Computes a recorded run again from the received samples, with the same solver iterations in each
/// frame, and compares each frame bit by bit. `threads`: 0 for as many as the run had. Needs a
/// PetscSession. Throws Error if the result holds no such run, or the mesh of the scene has
/// changed.
ReplayReport replay_run(const std::filesystem::path& result, const ProgressCallback& progress = {},
                        int threads = 0);

}  // namespace livetet
