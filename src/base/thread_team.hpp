#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <thread>
#include <type_traits>
#include <vector>

namespace livetet {

/// Fork-join team of threads for loops of microseconds that run many times a frame. The calling
/// thread is the first member. Threads wait by spinning; a worker that is idle for some
/// milliseconds sleeps until it is called again. `run` allocates nothing, takes no lock and makes
/// no blocking call.
class ThreadTeam {
  public:
    /// `threads` >= 1. With 1 no thread is started and `run` is a plain call.
    explicit ThreadTeam(int threads = 1);
    ~ThreadTeam();
    ThreadTeam(const ThreadTeam&) = delete;
    ThreadTeam& operator=(const ThreadTeam&) = delete;

    /// A team of the calling thread only: the default argument where no team is given.
    static ThreadTeam& alone() {
        static ThreadTeam team(1);
        return team;
    }

    int size() const { return static_cast<int>(workers_.size()) + 1; }

    /// Calls work(thread) on each thread, 0 to size() - 1, and returns when all have returned.
    /// `work` must not throw and must not call `run`.
    template <class Work>
    void run(Work&& work) {
        if (workers_.empty()) {
            work(0);
            return;
        }
        start(
            [](void* w, int thread) { (*static_cast<std::remove_reference_t<Work>*>(w))(thread); },
            const_cast<void*>(static_cast<const void*>(std::addressof(work))));
        work(0);
        finish();
    }

    /// Splits [0, count) into one piece a thread and calls work(begin, end) on each. Runs on the
    /// calling thread alone if a piece would be smaller than `grain`.
    template <class Work>
    void run_pieces(std::size_t count, std::size_t grain, Work&& work) {
        const auto pieces = static_cast<std::size_t>(size());
        if (count < grain * pieces)
            work(std::size_t{0}, count);
        else
            run([&](int thread) { work(count * thread / pieces, count * (thread + 1) / pieces); });
    }

    static constexpr std::size_t max_tasks = 64;

    /// Calls work(task) once for each task of [0, count), count <= max_tasks. A thread begins with
    /// its own piece of them, the same at each call, whose data its cache may hold; then it takes
    /// what others have not begun. A thread that loses its core delays no task but its present one.
    template <class Work>
    void run_tasks(std::size_t count, Work&& work) {
        if (workers_.empty() || count < 2) {
            for (std::size_t task = 0; task < count; ++task) work(task);
            return;
        }
        begun_.store(0, std::memory_order_relaxed);  // `run` shows it to the workers
        run([&](int thread) {
            const std::size_t first = count * thread / size();
            for (std::size_t k = 0; k < count; ++k)
                if (const std::size_t task = (first + k) % count; begins(task)) work(task);
        });
    }

  private:
    bool begins(std::size_t task) {
        const std::uint64_t bit = std::uint64_t{1} << task;
        return !(begun_.load(std::memory_order_relaxed) & bit) &&
               !(begun_.fetch_or(bit, std::memory_order_relaxed) & bit);
    }

    using Call = void (*)(void*, int);
    void start(Call call, void* work);
    void finish();
    void serve(int thread);

    std::vector<std::thread> workers_;
    Call call_ = nullptr;  ///< null: the workers end
    void* work_ = nullptr;
    alignas(64) std::atomic<std::uint32_t> round_{0};  ///< counts the calls of `run`
    alignas(64) std::atomic<int> at_work_{0};
    alignas(64) std::atomic<int> asleep_{0};
    alignas(64) std::atomic<std::uint64_t> begun_{0};  ///< of run_tasks, a bit a task
};

}  // namespace livetet
