#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/scene/scene.hpp"

namespace livetet {

/// A change of the scene while it ran: what frame it came before, and the whole scene from then on.
struct SceneEvent {
    std::size_t frame = 0;
    std::string scene;
};

/// What a replay came to.
struct [[nodiscard]] ReplayReport {
    std::size_t frames = 0, same = 0;
    std::size_t first_other =
        0;  ///< the first frame that is not the same to the bit; where there is one
    double largest_gap = 0;  ///< between a frame and what was kept of it, m
};

/// Computes a recorded run again, from the samples that came in and with the solver's work of each
/// frame, and compares each frame with the recorded one to the bit. `threads`: 0 for as many as the
/// run had. Needs a PetscSession. Throws Error where the result holds no such run, or the scene's
/// mesh is another one by now.
ReplayReport replay_run(const std::filesystem::path& result, int threads = 0);

}  // namespace livetet
