#include "apps/warp/warp_results.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <thread>

#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/parallel_jobs.hpp"

namespace livetet {

namespace {

/// The results of a batch: each is read when its first frame begins, and given up when its last one
/// has ended.
class WarpInputs {
  public:
    WarpInputs(const WarpArguments& arguments, const std::vector<WarpJob>& jobs)
        : arguments_(arguments), slots_(arguments.results.size()) {
        for (const WarpJob& job : jobs) ++slots_[job.result].jobs_left;
    }

    /// May be called by several threads.
    std::shared_ptr<const WarpInput> get(std::size_t result) {
        Slot& slot = slots_[result];
        const std::lock_guard lock(slot.mutex);
        if (!slot.input)
            slot.input = std::make_shared<const WarpInput>(arguments_.results[result], arguments_);
        return slot.input;
    }

    void end_job(std::size_t result) {
        Slot& slot = slots_[result];
        const std::lock_guard lock(slot.mutex);
        if (--slot.jobs_left == 0) slot.input.reset();
    }

  private:
    struct Slot {
        std::mutex mutex;
        std::shared_ptr<const WarpInput> input;
        std::size_t jobs_left = 0;
    };
    const WarpArguments& arguments_;
    std::vector<Slot> slots_;
};

int cores_for(const WarpArguments& a) {
    const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    return a.threads > 0 ? a.threads : cores;
}

std::string name_of(const WarpArguments& a, const WarpJob& job) {
    return fmt::format("frame {} of {}", job.frame + 1, a.results[job.result].string());
}

/// Passes on why a batch ended early.
[[noreturn]] void rethrow(const JobsEnd& end, const WarpArguments& a,
                          const std::vector<WarpJob>& jobs) {
    const WarpJob& job = jobs[end.first_failed];
    try {
        std::rethrow_exception(end.first_error);
    } catch (const Error& e) {
        if (jobs.size() == 1) throw;
        fail("{} (frame {} of {}; {} of {} frames are written)", e.what(), job.frame + 1,
             a.results[job.result].string(), end.done, jobs.size());
    }
}

}  // namespace

int warp_threads(const WarpArguments& arguments, std::size_t frames) {
    return static_cast<int>(std::min<std::size_t>(cores_for(arguments), frames));
}

std::vector<WarpedFrame> warp_results(const WarpArguments& a, const ProgressCallback& progress) {
    const std::vector<WarpJob> jobs = plan_warp(a);
    std::vector<WarpedFrame> frames(jobs.size());
    // Frames side by side: most of a frame's time is compression and files, which its threads could
    // not share.
    const int workers = warp_threads(a, jobs.size());
    WarpInputs inputs(a, jobs);
    std::mutex telling;
    std::size_t written = 0;
    if (progress) progress(0, name_of(a, jobs.front()));
    const JobsEnd end = run_jobs(jobs.size(), workers, AfterError::stop, [&](std::size_t n) {
        const WarpJob& job = jobs[n];
        ThreadTeam team(std::max(1, cores_for(a) / workers));
        const auto input = inputs.get(job.result);
        frames[n] = warp_frame(*input, job, a, team);
        inputs.end_job(job.result);
        const std::lock_guard lock(telling);
        ++written;
        if (progress)
            progress(static_cast<double>(written) / static_cast<double>(jobs.size()),
                     name_of(a, job));
    });
    if (end.first_error) rethrow(end, a, jobs);
    return frames;
}

}  // namespace livetet
