#include "apps/viewer/player.hpp"

#include <vtkOggTheoraWriter.h>
#include <vtkWindowToImageFilter.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "apps/scene/outputs.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/log.hpp"
#include "base/progress.hpp"
#include "io/text.hpp"
#include "tracking/source.hpp"

namespace livetet {

namespace {

void rest() { std::this_thread::sleep_for(std::chrono::milliseconds(5)); }

}  // namespace

Player::Player(const ViewRecording& recording, ViewWindow& window)
    : recording_(recording), window_(window) {
    window.handlers.toggle_play = [this] {
        if (playing_)
            playing_ = false;
        else
            start();
    };
    window.handlers.step = [this](int frames) {
        playing_ = false;
        const auto to = static_cast<std::ptrdiff_t>(frame_) + frames;
        go_to_frame(static_cast<std::size_t>(std::max<std::ptrdiff_t>(to, 0)));
    };
    window.handlers.seek = [this](double share) {
        playing_ = false;
        go_to_time(share * duration_s());
    };
    window.handlers.pull = [](const std::optional<HandPull>&) {
        log_warning("a recorded result cannot be pulled; livetet view SCENE runs one that can");
    };
    window.set_extent(recording.extent());
    window.set_range(ColourBy::displacement, recording.largest_displacement());
    if (recording.has_stress()) window.set_range(ColourBy::von_mises, recording.largest_stress());
    if (recording.states_errors())
        window.set_range(ColourBy::stated_error, recording.largest_stated_error());
    go_to_frame(0);
}

void Player::go_to_frame(std::size_t k) {
    frame_ = std::min(k, recording_.times_s().size() - 1);
    window_.show(recording_.moment(frame_));
    window_.set_time(duration_s() > 0 ? time_of(frame_) / duration_s() : 1);
}

std::size_t Player::frame_at(double time_s) const {
    const std::vector<double>& times = recording_.times_s();
    const auto after = std::upper_bound(times.begin(), times.end(), times.front() + time_s + 1e-9);
    return after == times.begin() ? 0 : static_cast<std::size_t>(after - times.begin()) - 1;
}

void Player::go_to_time(double time_s) { go_to_frame(frame_at(time_s)); }

void Player::start() {
    playing_ = true;
    started_s_ = steady_seconds();
    from_s_ = frame_ + 1 < recording_.times_s().size() ? time_of(frame_) : 0;
}

void Player::advance() {
    if (playing_) {
        const double due_s = from_s_ + steady_seconds() - started_s_;
        if (const std::size_t k = frame_at(due_s); k != frame_) go_to_frame(k);
        if (due_s >= duration_s()) playing_ = false;
    }
    if (!window_.draw()) rest();
}

bool Player::play(double seconds) {
    const double end_s = steady_seconds() + seconds;
    start();
    bool open = true;
    while (open && steady_seconds() < end_s) {
        advance();
        open = window_.process_events();
    }
    playing_ = false;
    return open;
}

void Player::run() {
    while (window_.process_events()) advance();
}

Stage Player::stage() {
    return {[this](std::size_t k) {
                if (k >= recording_.times_s().size())
                    fail("frame {}: the result holds {}", k + 1, recording_.times_s().size());
                go_to_frame(k);
            },
            [this](double time_s) { go_to_time(time_s); },
            [this](double seconds) { return play(seconds); }};
}

namespace {

std::filesystem::path picture_in(const std::filesystem::path& folder, std::size_t number) {
    return folder / fmt::format("{:06}.png", number);
}

/// Removes what an earlier, longer recording left in the folder: pictures from `number` on.
void remove_pictures_from(const std::filesystem::path& folder, std::size_t number) {
    std::error_code failure;
    while (std::filesystem::remove(picture_in(folder, number), failure)) ++number;
    if (failure)
        fail("{}: is of an earlier recording and cannot be removed ({})",
             picture_in(folder, number).string(), failure.message());
}

}  // namespace

void Player::record(const std::filesystem::path& path, double rate_Hz,
                    const ProgressCallback& progress) {
    const bool as_folder = !is_named_as_file(path);
    if (!as_folder && ending(path) != ".ogv")
        fail(
            "--record {}: the name ends in '{}', expected .ogv for a video, or none for a folder "
            "of pictures",
            path.string(), ending(path));
    std::optional<PendingFile> file;
    vtkNew<vtkWindowToImageFilter> pixels;
    pixels->SetInput(window_.window());
    pixels->ReadFrontBufferOff();
    pixels->SetInputBufferTypeToRGB();
    vtkNew<vtkOggTheoraWriter> video;
    if (as_folder) {
        std::error_code failure;
        std::filesystem::create_directories(path, failure);
        if (failure)
            fail("--record {}: the folder cannot be made ({})", path.string(), failure.message());
    } else {
        file.emplace(path);
        window_.draw();
        pixels->Update();
        video->SetInputConnection(pixels->GetOutputPort());
        video->SetFileName(file->path().c_str());
        video->SetRate(static_cast<int>(rate_Hz));
        video->SetQuality(2);
        video->Start();
    }
    const auto pictures = static_cast<std::size_t>(duration_s() * rate_Hz) + 1;
    for (std::size_t k = 0; k < pictures; ++k) {
        go_to_time(static_cast<double>(k) / rate_Hz);
        if (progress)
            progress(static_cast<double>(k) / static_cast<double>(pictures),
                     fmt::format("picture {}", k + 1));
        if (as_folder) {
            window_.write_png(picture_in(path, k));
            continue;
        }
        window_.draw();
        pixels->Modified();
        video->Write();
        if (video->GetError()) fail("--record {}: the video cannot be written", path.string());
    }
    if (as_folder) {
        remove_pictures_from(path, pictures);
        return;
    }
    video->End();
    std::error_code unknown;  // the writer does not report a full disk
    if (const auto space =
            std::filesystem::space(std::filesystem::absolute(path).parent_path(), unknown);
        !unknown && space.available < 4096)
        fail("--record {}: no room on the disk for the video", path.string());
    file->commit();
}

}  // namespace livetet
