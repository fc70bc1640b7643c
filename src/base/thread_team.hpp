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
/// milliseconds sleeps until it is called again. A call allocates nothing, takes no lock and makes
/// no blocking call.
///
/// Tasks and pieces are done by whoever is there: a worker that another program keeps off its core,
/// or that sleeps, is not waited for unless it has joined in. So on a busy machine a call takes
/// no more time than the caller would take alone, and what is left of a task that was begun.
class ThreadTeam {
  public:
    /// `threads` >= 1; at most max_tasks are made. With 1 none starts, and `run` is a plain call.
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
        start(work);
        work(0);
        finish(workers_.size());
    }

    /// Splits [0, count) into as many pieces as there are threads and calls work(begin, end) once
    /// for each, as a task. Calls work(0, count) if a piece would be smaller than `grain`.
    template <class Work>
    void run_pieces(std::size_t count, std::size_t grain, Work&& work) {
        const auto pieces = static_cast<std::size_t>(size());
        if (count < grain * pieces)
            work(std::size_t{0}, count);
        else
            run_tasks(pieces, [&](std::size_t piece) {
                work(count * piece / pieces, count * (piece + 1) / pieces);
            });
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
        begun_.store(0, std::memory_order_relaxed);  // start shows it to the workers
        const auto take = [&](int thread) {
            const std::size_t first = count * thread / size();
            for (std::size_t k = 0; k < count; ++k)
                if (const std::size_t task = (first + k) % count; begins(task)) work(task);
        };
        start(take);
        take(0);
        finish(0);
    }

  private:
    bool begins(std::size_t task) {
        const std::uint64_t bit = std::uint64_t{1} << task;
        return !(begun_.load(std::memory_order_relaxed) & bit) &&
               !(begun_.fetch_or(bit, std::memory_order_relaxed) & bit);
    }

    using Call = void (*)(void*, int);
    template <class Work>
    void start(Work& work) {
        start([](void* w, int thread) { (*static_cast<Work*>(w))(thread); },
              const_cast<void*>(static_cast<const void*>(std::addressof(work))));
    }
    /// Opens a round: workers may join it until it is closed.
    void start(Call call, void* work);
    /// Closes the round once `workers` have joined it; returns when all who did have returned.
    void finish(std::size_t workers);
    bool join(std::uint32_t round);
    void serve(int thread);

    /// State of the round: its number, whether it is open, how many workers have joined it and how
    /// many of them are at work, in 32, 1, 15 and 16 bits.
    static constexpr std::uint64_t one_at_work = 1, one_joined = std::uint64_t{1} << 16,
                                   is_open = std::uint64_t{1} << 31;
    static std::uint64_t at_work(std::uint64_t state) { return state & 0xffff; }
    static std::uint64_t joined(std::uint64_t state) { return state >> 16 & 0x7fff; }

    std::vector<std::thread> workers_;
    Call call_ = nullptr;  ///< null: the workers end
    void* work_ = nullptr;
    alignas(64) std::atomic<std::uint32_t> round_{0};  ///< counts the rounds; idle workers watch it
    alignas(64) std::atomic<std::uint64_t> state_{0};
    alignas(64) std::atomic<std::uint32_t> naps_{0};   ///< odd: someone sleeps or is about to
    alignas(64) std::atomic<std::uint64_t> begun_{0};  ///< of run_tasks, a bit a task
};

}  // namespace livetet
