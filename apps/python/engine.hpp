#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "base/progress.hpp"

struct _n_PetscOptions;
namespace livetet {
class PetscSession;
}

namespace livetet::python {

namespace py = pybind11;

// The engine (PETSc, MPI, HDF5) is used from one thread at a time. A call into it gives Python's
// global interpreter lock (GIL) back, then takes the engine's own lock; never the other way round,
// so that the two cannot wait for each other.

/// Starts MPI and PETSc unless they run already, whoever started them. They are ended as Python
/// exits, if they were started here: PETSc by `atexit`, MPI after all of Python's own functions.
/// Returns the session; null: somebody else's PETSc. Needs the GIL. Throws Error once it has ended.
PetscSession* start_engine();

/// Adds to PETSc's options, before or after the engine was started. Needs the GIL.
void add_petsc_options(const std::string& options);

/// What holds PETSc's objects for Python: closed before PETSc ends. Made and destroyed with the
/// GIL.
class Closable {
  public:
    Closable();
    virtual ~Closable();
    Closable(const Closable&) = delete;
    Closable& operator=(const Closable&) = delete;
    /// Destroys PETSc's objects; called with the engine's lock. Again: nothing.
    virtual void close() noexcept = 0;
};

/// The engine's lock. Throws Error if this thread holds it already.
class EngineLock {
  public:
    EngineLock();
    ~EngineLock();
    EngineLock(const EngineLock&) = delete;
    EngineLock& operator=(const EngineLock&) = delete;
    static bool is_mine() noexcept;
};

/// Passes the warnings that were logged on to Python's logger "livetet", with the GIL.
void pass_on_messages() noexcept;
/// Has warnings collected for pass_on_messages in place of being printed.
void collect_messages();

/// Returns work(), without the GIL and with the engine's lock. Needs the GIL.
template <class Work>
auto in_engine(Work&& work) {
    start_engine();
    struct Messages {
        ~Messages() { pass_on_messages(); }
    } const messages;  // last, with the GIL
    const py::gil_scoped_release release;
    const EngineLock lock;
    return work();
}

/// Runs work() where an exception cannot be passed on: in a destructor. Needs the GIL.
void destroy_in_engine(const std::function<void()>& work) noexcept;

/// Scene options of PETSc, while it lives: those of one scene do not reach another.
class SceneOptions {
  public:
    explicit SceneOptions(const std::string& options);
    ~SceneOptions();
    SceneOptions(const SceneOptions&) = delete;
    SceneOptions& operator=(const SceneOptions&) = delete;

  private:
    _n_PetscOptions* own_ = nullptr;  ///< PetscOptions
};

/// Lets Python's signal handlers run during a long call and shows its progress, at most every 50
/// ms.
class Watch {
  public:
    /// `progress`: called with a fraction and a text, or None.
    explicit Watch(py::object progress) : progress_(std::move(progress)) {}
    /// Throws py::error_already_set if a handler raised (KeyboardInterrupt), or `progress` did.
    /// Without the GIL.
    void update(double fraction, std::string_view what);
    /// The same, for signals only.
    void check_signals();
    ProgressCallback callback() {
        return [this](double fraction, std::string_view what) { update(fraction, what); };
    }

  private:
    py::object progress_;
    std::chrono::steady_clock::time_point last_{}, last_shown_{};
};

}  // namespace livetet::python
