#pragma once

#include <filesystem>
#include <memory>
#include <thread>

#include "apps/live/tracked_body.hpp"
#include "tracking/mailbox.hpp"

namespace livetet {

/// `running` with what may change while it runs, from `edited`: track.sensors, track.tools and fix.
Scene with_changes(const Scene& running, const Scene& edited);

/// Reads a scene file again whenever it is written, and the files that it names, from a thread of
/// its own; what is wrong in them is said, and the scene stays as it was. Says, too, where
/// something was changed that waits for the next start.
class SceneWatch {
  public:
    /// `scene` is what `path` held when it was `written`; `mesh` its finest mesh.
    SceneWatch(std::filesystem::path path, std::filesystem::file_time_type written, Scene scene,
               const TetMesh& mesh);

    /// The newest change that was not taken yet, or nullptr. Waits for nothing.
    SceneChange* take() { return mailbox_.take() ? mailbox_.incoming().get() : nullptr; }

  private:
    void watch(const std::stop_token& stop);

    std::filesystem::path path_;
    std::filesystem::file_time_type written_;
    Scene scene_;
    const TetMesh& mesh_;
    Mailbox<std::shared_ptr<SceneChange>> mailbox_;
    std::jthread thread_;
};

}  // namespace livetet
