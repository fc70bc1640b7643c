#include "base/sliced_task.hpp"

#include <utility>

namespace livetet {

namespace {

/// The task whose thread this is.
thread_local SlicedTask* own_task = nullptr;

/// Ends work that nobody asks for any more.
struct Left {};

}  // namespace

void pause_point() {
    if (own_task) own_task->pause();
}

void SlicedTask::run() {
    try {
        all_();
    } catch (...) {
        failure_ = std::current_exception();
    }
    is_done_ = true;
}

void SlicedTask::pause() {
    if (!is_over_ || !(*is_over_)()) return;
    waits_.release();
    goes_on_.acquire();
    if (is_left_) throw Left{};
}

bool SlicedTask::work(const std::function<bool()>& is_over) {
    if (is_done_) return true;
    is_over_ = &is_over;
    if (thread_.joinable())
        goes_on_.release();
    else
        thread_ = std::thread([this] {
            own_task = this;
            run();
            waits_.release();
        });
    waits_.acquire();
    return is_done_;
}

void SlicedTask::finish() {
    if (!is_done_ && thread_.joinable()) {
        is_over_ = nullptr;
        goes_on_.release();
        waits_.acquire();
    }
    if (!is_done_) run();
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

SlicedTask::~SlicedTask() {
    if (!thread_.joinable()) return;
    is_left_ = true;
    if (!is_done_) goes_on_.release();
    thread_.join();
}

}  // namespace livetet
