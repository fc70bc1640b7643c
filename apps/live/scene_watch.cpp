#include "apps/live/scene_watch.hpp"

#include <chrono>
#include <condition_variable>
#include <mutex>

#include "base/error.hpp"
#include "base/log.hpp"
#include "config/yaml.hpp"

namespace livetet {

namespace {

constexpr std::chrono::milliseconds look_every(100);

}  // namespace

Scene with_changes(const Scene& running, const Scene& edited) {
    Scene scene = running;
    scene.fix = edited.fix;
    scene.track->sensors = edited.track->sensors;
    scene.track->tools = edited.track->tools;
    return scene;
}

SceneWatch::SceneWatch(std::filesystem::path path, std::filesystem::file_time_type written,
                       Scene scene, const TetMesh& mesh)
    : path_(std::move(path)), written_(written), scene_(std::move(scene)), mesh_(mesh) {
    thread_ = std::jthread([this](const std::stop_token& stop) { watch(stop); });
}

void SceneWatch::watch(const std::stop_token& stop) {
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any sleep;
    std::error_code gone;  // while an editor removes the file and writes it anew
    std::string text = to_yaml(scene_);
    while (!sleep.wait_for(lock, stop, look_every, [&] { return stop.stop_requested(); })) {
        const auto now = std::filesystem::last_write_time(path_, gone);
        if (gone || now == written_) continue;
        written_ = now;
        try {
            const Scene edited = load_scene(path_);
            if (!edited.track)
                fail("{}: track is missing, expected it while the scene runs", path_.string());
            Scene next = with_changes(scene_, edited);
            const std::string next_text = to_yaml(next);
            if (to_yaml(edited) != next_text)
                log_warning(
                    path_.string() +
                    ": other changes than of track.sensors, track.tools and fix wait for the "
                    "next start");
            if (next_text == text) continue;
            auto change = std::make_shared<SceneChange>(prepare_change(next, mesh_));
            text = next_text;
            scene_ = std::move(next);
            mailbox_.outgoing() = std::move(change);
            mailbox_.post();
        } catch (const Error& error) {
            log_warning(fmt::format("{}; the scene stays as it was", error.what()));
        }
    }
}

}  // namespace livetet
