#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <semaphore>
#include <thread>

namespace livetet {

/// Long work that is done a slice at a time between other work of one thread. It has a thread of
/// its own, which runs only while `work` or `finish` waits for it: what the two threads share needs
/// no lock, and PETSc and MPI are called by one at a time.
class SlicedTask {
  public:
    explicit SlicedTask(std::function<void()> all) : all_(std::move(all)) {}
    /// Work that has begun is left at the pause_point where it waits, by an exception.
    ~SlicedTask();
    SlicedTask(const SlicedTask&) = delete;
    SlicedTask& operator=(const SlicedTask&) = delete;

    /// Works until a pause_point at which `is_over`, or to the end. Returns whether all is done.
    /// `is_over` is called by the task's thread, and must not throw.
    bool work(const std::function<bool()>& is_over);
    /// Works to the end. Throws what the work threw.
    void finish();
    bool is_done() const { return is_done_; }

  private:
    friend void pause_point();
    void run();
    void pause();

    std::function<void()> all_;
    const std::function<bool()>* is_over_ = nullptr;  ///< of the present slice; null: never
    std::binary_semaphore goes_on_{0}, waits_{0};
    std::thread thread_;  ///< none before the first slice
    bool is_done_ = false, is_left_ = false;
    std::exception_ptr failure_;
};

/// A place in long work where it may be interrupted for some time, or left by an exception that is
/// no std::exception. Outside a SlicedTask it does nothing. Not for places that hold a lock, are
/// called back by C, or are run by a ThreadTeam.
void pause_point();
/// The same in a loop over many small things, for one of 4,096.
inline void pause_point_at(std::size_t index) {
    if (index % 4096 == 0) pause_point();
}

}  // namespace livetet
