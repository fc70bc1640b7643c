#pragma once

#include <filesystem>
#include <memory>
#include <thread>

#include "apps/live/tracked_body.hpp"
#include "tracking/mailbox.hpp"

namespace livetet {

/// `running` with the parts of `edited` that may change during a run: track.sensors, track.tools
/// and fix.
Scene with_changes(const Scene& running, const Scene& edited);

/// Watches a scene file from a thread of its own and reads it, and the files that it names,
/// whenever it is written. Errors are logged, and the scene stays as it was. Changes that only take
/// effect at the next start are logged, too.
class SceneWatch {
  public:
    /// `scene`: the contents of `path` when it was `written`; `mesh`: its finest mesh, as it was
    /// loaded.
    SceneWatch(std::filesystem::path path, std::filesystem::file_time_type written, Scene scene,
               const TetMesh& mesh);

    /// The newest change not yet taken, or nullptr. Does not wait.
    SceneChange* take() { return mailbox_.take() ? mailbox_.incoming().get() : nullptr; }

  private:
    void watch(const std::stop_token& stop);

    std::filesystem::path path_;
    std::filesystem::file_time_type written_;
    Scene scene_;
    const TetMesh mesh_;  ///< as it was loaded
    Mailbox<std::shared_ptr<SceneChange>> mailbox_;
    std::jthread thread_;
};

}  // namespace livetet
