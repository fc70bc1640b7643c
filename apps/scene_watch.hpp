#pragma once

#include <filesystem>
#include <thread>

#include "apps/scene.hpp"
#include "tracking/mailbox.hpp"

namespace livetet {

/// `running` with what may change while it runs, from `edited`: track.sensors, track.tools and fix.
Scene with_changes(const Scene& running, const Scene& edited);

/// Reads a scene file again whenever it is written, from a thread of its own; what is wrong in it is said, and the scene
/// stays as it was. Says, too, where something was changed that waits for the next start.
class SceneWatch {
  public:
    SceneWatch(std::filesystem::path path, Scene scene);

    /// The newest scene that was not taken yet, or nullptr. Waits for nothing.
    const Scene* take() { return mailbox_.take() ? &mailbox_.incoming() : nullptr; }

  private:
    void watch(const std::stop_token& stop);

    std::filesystem::path path_;
    Scene scene_;
    Mailbox<Scene> mailbox_;
    std::jthread thread_;
};

}  // namespace livetet
