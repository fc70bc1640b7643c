#pragma once

#include <algorithm>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace livetet {

/// What happens to jobs that have not begun when one has failed.
enum class AfterError { stop, go_on };

/// How jobs have ended.
struct JobsEnd {
    std::size_t done = 0, failed = 0;
    std::size_t first_failed = 0;      ///< the lowest number of those that failed
    std::exception_ptr first_error{};  ///< what it threw; null if none failed
};

/// Calls job(n) for n from 0 to count - 1, in this order, on up to `threads` threads, one of which
/// is the caller's. After a job has thrown, those that run are ended, and the others begin or not.
template <class Job>
JobsEnd run_jobs(std::size_t count, int threads, AfterError after_error, const Job& job) {
    std::mutex mutex;
    std::size_t next = 0;
    JobsEnd end;
    const auto work = [&] {
        for (;;) {
            std::size_t n = 0;
            {
                const std::lock_guard lock(mutex);
                if (next == count || (after_error == AfterError::stop && end.failed > 0)) return;
                n = next++;
            }
            std::exception_ptr error;
            try {
                job(n);
            } catch (...) {
                error = std::current_exception();
            }
            const std::lock_guard lock(mutex);
            if (!error) {
                ++end.done;
                continue;
            }
            if (end.failed++ == 0 || n < end.first_failed) {
                end.first_failed = n;
                end.first_error = error;
            }
        }
    };
    std::vector<std::thread> others;
    for (std::size_t n = 1; n < std::min(count, static_cast<std::size_t>(threads)); ++n)
        others.emplace_back(work);
    work();
    for (std::thread& other : others) other.join();
    return end;
}

}  // namespace livetet
