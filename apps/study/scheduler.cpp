#include "apps/study/scheduler.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <optional>
#include <thread>

#include "apps/scene/cuts.hpp"
#include "base/error.hpp"

namespace livetet {

namespace {

using std::chrono::duration;
using std::chrono::steady_clock;

/// The ranks that solve together; the first of them leads.
struct Group {
    MPI_Comm comm = MPI_COMM_NULL;
    bool leader = true;

    Group(int rank, int ranks_per_solve) : leader(rank % ranks_per_solve == 0) {
        MPI_Comm_split(PETSC_COMM_WORLD, rank / ranks_per_solve, rank, &comm);
    }
    ~Group() {
        if (std::uncaught_exceptions() == 0)
            MPI_Comm_free(&comm);  // otherwise the other ranks do not take part
    }
    Group(const Group&) = delete;
    Group& operator=(const Group&) = delete;

    /// The leader's value, on every rank. Collective.
    int of_leader(int value) const {
        MPI_Bcast(&value, 1, MPI_INT, 0, comm);
        return value;
    }
    bool agree(bool value) const { return of_leader(value) != 0; }
};

/// "about 4 min left".
std::string time_text(double seconds) {
    if (seconds < 90) return fmt::format("{:.0f} s", seconds);
    if (seconds < 5400) return fmt::format("{:.0f} min", seconds / 60);
    return fmt::format("{:.1f} h", seconds / 3600);
}

/// Progress of all groups, from the files in the folder; read once a second.
class StudyProgress {
  public:
    StudyProgress(const StudyStore& store, std::size_t total, ProgressCallback show)
        : store_(store), total_(total), before_(store.count_done()), show_(std::move(show)) {}

    void update(std::string_view what) {
        const auto now = steady_clock::now();
        if (now - looked_ >= std::chrono::seconds(1) || looked_ == steady_clock::time_point{}) {
            looked_ = now;
            done_ = store_.count_done();
        }
        std::string text = fmt::format("{} of {} solves", done_, total_);
        if (done_ > before_)
            text +=
                fmt::format(", about {} left", time_text(duration<double>(now - began_).count() /
                                                         static_cast<double>(done_ - before_) *
                                                         static_cast<double>(total_ - done_)));
        if (!what.empty()) text += fmt::format(" | {}", what);
        show_(static_cast<double>(done_) / static_cast<double>(total_), text);
    }

  private:
    const StudyStore& store_;
    std::size_t total_, before_, done_ = 0;
    steady_clock::time_point began_ = steady_clock::now(), looked_{};
    ProgressCallback show_;
};

/// Waits for the other groups without occupying a core.
void wait_for_all(StudyProgress* progress) {
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Ibarrier(PETSC_COMM_WORLD, &request);
    for (int there = 0;;) {
        MPI_Test(&request, &there, MPI_STATUS_IGNORE);
        if (there) return;
        if (progress) progress->update("waiting for the other groups");
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
}

/// Solves what is not done: each group takes the next solve that no group has claimed.
void solve_all(const Study& study, const StudyStore& store, const Group& group,
               StudyProgress* progress) {
    StudySolver solver(group.comm);
    const std::vector<bool> done = store.done();
    for (std::size_t k = 0; k < study.samples.size(); ++k) {
        // Only the leader decides: another group may finish between two ranks' looks at the folder.
        if (!group.agree(group.leader && !done[k] && store.claim(k))) continue;
        ProgressCallback callback;
        if (progress)
            callback = [&](double, std::string_view what) {
                progress->update(fmt::format("solve {}, {}", k, what));
            };
        const StudyStore::Failures failures =
            group.leader ? store.failures(k) : StudyStore::Failures{};
        const int ended_runs = group.of_leader(failures.count);
        StudyRow row;
        if (group.agree(failures.given_up.has_value())) {
            row.converged = false;
            row.failure = failures.given_up.value_or("");
        } else {
            try {
                row = solver.solve(study.scene(k), callback);
            } catch (const std::exception& e) {
                store.note_failure(k, ended_runs + 1, e.what());
                throw;
            }
        }
        if (group.leader) store.keep(k, row);
        if (progress) progress->update("");
    }
}

}  // namespace

void check_ranks(const Study& study, int ranks) {
    const int each = study.options.ranks_per_solve;
    if (ranks % each != 0)
        fail("{}: ranks_per_solve = {} does not divide the {} ranks started", study.file, each,
             ranks);
    if (static_cast<std::size_t>(ranks / each) > study.samples.size())
        fail("{}: more ranks than can be used: {} for {} solves of {} each, expected at most {}",
             study.file, ranks, study.samples.size(), each,
             study.samples.size() * static_cast<std::size_t>(each));
}

void check_meshes(const Study& study) {
    std::vector<std::string> seen;
    for (std::size_t k = 0; k < study.samples.size(); ++k) {
        const Scene scene = study.scene(k);
        const std::string name = scene.mesh.file.string();
        check_can_be_cut(scene);
        if (!is_tet_mesh_name(scene.mesh.file) && scene.mesh.cells != MeshCells::hexahedra)
            fail(
                "mesh.file = {}: found what each solve of a study would mesh, expected a mesh "
                "(.h5, .msh, .vtu), which `livetet mesh` makes, or cells: hexahedra",
                name);
        if (std::find(seen.begin(), seen.end(), name) != seen.end()) continue;
        seen.push_back(name);
        load_mesh(scene.mesh, {}, {});  // cuts may vary: those of a solve are its own
    }
}

void solve_remaining(const Study& study, const StudyStore& store,
                     const ProgressCallback& progress) {
    int rank = 0;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    const Group group(rank, study.options.ranks_per_solve);
    std::optional<StudyProgress> shown;
    if (rank == 0 && progress) shown.emplace(store, study.samples.size(), progress);
    solve_all(study, store, group, shown ? &*shown : nullptr);
    wait_for_all(shown ? &*shown : nullptr);
}

}  // namespace livetet
