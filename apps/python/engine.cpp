#include "apps/python/engine.hpp"

#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <cstdlib>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <vector>

#include "base/error.hpp"
#include "base/petsc.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace livetet::python {

namespace {

// Never destroyed: deallocations may come after the exit of main.
struct Engine {
    std::optional<PetscSession> session;
    bool is_running = false, has_ended = false, began_mpi = false;
    std::set<Closable*> open;  ///< guarded by the GIL
    std::mutex mutex;
    std::atomic<std::thread::id> owner{};
    std::vector<std::string> petsc_arguments;
};
Engine& engine() {
    static Engine& the = *new Engine;
    return the;
}

void end_mpi() {
    int ended = 0;
    MPI_Finalized(&ended);
    if (!ended && engine().began_mpi) MPI_Finalize();
}

void end_engine() {
    Engine& the = engine();
    if (!the.is_running || the.has_ended) return;
    the.has_ended = true;
    const std::set<Closable*> open = the.open;
    destroy_in_engine([&] {
        for (Closable* one : open) one->close();
        the.session.reset();
    });
}

/// Collects warnings from any thread.
class Collector : public spdlog::sinks::base_sink<std::mutex> {
  public:
    std::vector<std::string> take() {
        const std::lock_guard lock(mutex_);
        return std::exchange(texts_, {});
    }

  private:
    void sink_it_(const spdlog::details::log_msg& message) override {
        if (message.level >= spdlog::level::warn)
            texts_.emplace_back(message.payload.begin(), message.payload.end());
    }
    void flush_() override {}
    std::vector<std::string> texts_;
};
std::shared_ptr<Collector>& collector() {
    static std::shared_ptr<Collector>& the = *new std::shared_ptr<Collector>;
    return the;
}

}  // namespace

PetscSession* start_engine() {
    Engine& the = engine();
    if (the.has_ended) fail("livetet: Python is exiting, expected calls before its end");
    if (the.is_running) return the.session ? &*the.session : nullptr;
    int mpi_runs = 0;
    MPI_Initialized(&mpi_runs);
    if (!mpi_runs) {
        // Open MPI would ask each X server of the machine for graphics cards.
        ::setenv("HWLOC_COMPONENTS", "-gl", 0);
        int given = 0;
        MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &given);
        the.began_mpi = true;
        Py_AtExit(end_mpi);
    }
    PetscBool petsc_runs = PETSC_FALSE;
    LIVETET_PETSC(PetscInitialized(&petsc_runs));
    if (!petsc_runs) the.session.emplace("livetet", the.petsc_arguments);
    the.is_running = true;
    py::module_::import("atexit").attr("register")(py::cpp_function(end_engine));
    return the.session ? &*the.session : nullptr;
}

void add_petsc_options(const std::string& options) {
    const std::size_t first = options.find_first_not_of(" \t\n");
    if (first != options.npos && options[first] != '-')
        fail("options: found \"{}\", expected -name value ...", options);
    start_engine();
    if (PetscOptionsInsertString(nullptr, options.c_str()))
        fail("\"{}\" cannot be read by PETSc, expected -name value ...", options);
}

Closable::Closable() { engine().open.insert(this); }
Closable::~Closable() { engine().open.erase(this); }

bool EngineLock::is_mine() noexcept { return engine().owner == std::this_thread::get_id(); }
EngineLock::EngineLock() {
    if (is_mine())
        fail("livetet: called from within a call of livetet, expected it after that has returned");
    engine().mutex.lock();
    engine().owner = std::this_thread::get_id();
}
EngineLock::~EngineLock() {
    engine().owner = std::thread::id{};
    engine().mutex.unlock();
}

void destroy_in_engine(const std::function<void()>& work) noexcept {
    if (EngineLock::is_mine()) return work();
    const py::gil_scoped_release release;
    const EngineLock lock;
    work();
}

void collect_messages() {
    collector() = std::make_shared<Collector>();
    if (auto registered = spdlog::get("livetet"))
        registered->sinks() = {collector()};
    else
        spdlog::register_logger(std::make_shared<spdlog::logger>("livetet", collector()));
}

void pass_on_messages() noexcept {
    const std::vector<std::string> texts = collector()->take();
    if (texts.empty()) return;
    const py::error_scope kept;  // an exception on its way
    try {
        const py::object logger = py::module_::import("logging").attr("getLogger")("livetet");
        for (const std::string& text : texts) logger.attr("warning")("%s", text);
    } catch (py::error_already_set& error) {
        error.discard_as_unraisable("livetet");
    }
}

SceneOptions::SceneOptions(const std::string& options) {
    PetscSession* session = start_engine();
    if (options.empty()) return;
    if (!session) fail("solver.petsc_options: PETSc was started by others, expected livetet first");
    char* present = nullptr;
    LIVETET_PETSC(PetscOptionsGetAll(nullptr, &present));
    const std::string of_all = present;
    PetscFree(present);
    LIVETET_PETSC(PetscOptionsCreate(&own_));
    LIVETET_PETSC(PetscOptionsInsertString(own_, of_all.c_str()));
    PetscBool is_given = PETSC_FALSE;  // the session's own: asked for, it is no unused option
    LIVETET_PETSC(PetscOptionsHasName(own_, nullptr, "-no_signal_handler", &is_given));
    LIVETET_PETSC(PetscOptionsPush(own_));
    try {
        session->add_options(options);
    } catch (...) {
        PetscOptionsPop();
        PetscOptionsDestroy(&own_);
        throw;
    }
}
SceneOptions::~SceneOptions() {
    if (!own_) return;
    PetscOptionsPop();
    PetscOptionsDestroy(&own_);
}

void Watch::update(double fraction, std::string_view what) {
    check_signals();
    const auto now = std::chrono::steady_clock::now();
    if (now - last_shown_ < std::chrono::milliseconds(50) && fraction < 1) return;
    last_shown_ = now;
    const py::gil_scoped_acquire gil;
    if (!progress_.is_none()) progress_(fraction, std::string(what));
}

void Watch::check_signals() {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < std::chrono::milliseconds(50)) return;
    last_ = now;
    const py::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

}  // namespace livetet::python
