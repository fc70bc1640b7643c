#include <fmt/format.h>
#include <gtest/gtest.h>

#include <future>
#include <thread>

#include "io/hierarchy_file.hpp"
#include "io/result_file.hpp"
#include "mesh/hierarchy.hpp"
#include "support/mpirun.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::Folder;
using test::livetet;
using test::mpirun;
using test::write_text;

/// Generalized-alpha in the mixed form: all that a body's state can hold.
const std::string swing = R"(
mesh: {file: block.h5}
materials: [{young_Pa: 50000, poisson: 0.495}]
fix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]
gravity_m_per_s2: [0, 0, -9.81]
time: {scheme: generalized_alpha, step_s: 0.01, duration_s: 0.4}
solver: {newton_tolerance: 1e-9, relative_tolerance: 1e-4}
)";

void prepare_swing(const Folder& folder) {
    write_hierarchy(folder / "block.h5", make_hierarchy({test::block({8, 4, 4}, {0.2, 0.1, 0.1}),
                                                         test::block({4, 2, 2}, {0.2, 0.1, 0.1})},
                                                        "a block"));
    write_text(folder / "whole.yaml",
               swing + "output: {file: whole.h5, every: 2, fields: [von_mises, reactions]}\n");
    write_text(folder / "swing.yaml", swing +
                                          "output: {file: swing.h5, every: 2, fields: [von_mises, "
                                          "reactions], checkpoint_every: 5}\n");
}

/// Returns as soon as the run has left a checkpoint, or has ended.
void wait_for_checkpoint(const Folder& folder, const std::future<test::Outcome>& run) {
    while (!std::filesystem::exists(folder / "swing.h5.parts/checkpoint.h5") &&
           run.wait_for(std::chrono::milliseconds(10)) != std::future_status::ready) {
    }
}

/// Starts the run, and kills it as soon as it has left a checkpoint.
void kill_after_checkpoint(const Folder& folder, const std::string& before) {
    auto run =
        std::async(std::launch::async, [&] { return livetet(folder, "solve swing.yaml", before); });
    wait_for_checkpoint(folder, run);
    for (const pid_t p : test::programs_in(folder)) ::kill(p, SIGKILL);
    EXPECT_NE(run.get().status, 0);
}

/// Whether a process stands still: stopped, or gone.
bool stands_still(pid_t process) {
    const std::string stat = test::text_of(fmt::format("/proc/{}/stat", process));
    const auto name_end = stat.rfind(')');
    return name_end == std::string::npos || stat.substr(name_end).find_first_of("TZX") == 2;
}

/// Stops processes until it ends.
class Standstill {
  public:
    explicit Standstill(std::vector<pid_t> processes) : processes_(std::move(processes)) {
        for (const pid_t p : processes_) {
            ::kill(p, SIGSTOP);
            while (!stands_still(p)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    }
    ~Standstill() {
        for (const pid_t p : processes_) ::kill(p, SIGCONT);
    }
    Standstill(const Standstill&) = delete;
    Standstill& operator=(const Standstill&) = delete;

  private:
    std::vector<pid_t> processes_;
};

/// Removes the run's checkpoints while its ranks stand still between two files: Open MPI would hang
/// if the file went between the first rank's opening it and the others'.
void remove_checkpoints_between_files(const Folder& folder) {
    const auto parts = folder / "swing.h5.parts";
    const auto is_being_written = [&] {
        std::error_code gone;
        for (const auto& entry : std::filesystem::directory_iterator(parts, gone))
            if (entry.path().filename().string().front() == '.') return true;
        return false;
    };
    while (std::filesystem::exists(parts)) {
        const std::vector<pid_t> ranks = test::programs_in(folder);
        if (ranks.empty()) return;
        {
            const Standstill standstill(ranks);
            if (!is_being_written()) std::filesystem::remove_all(parts);
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(3));
    }
}

TEST(Restart, WhatTheFirstRankCannotKeepEndsTheRunOnAllOfThem) {
    const Folder folder;
    prepare_swing(folder);
    std::string longer = swing + "output: {file: swing.h5, every: 2, checkpoint_every: 5}\n";
    longer.replace(longer.find("duration_s: 0.4"), 15, "duration_s: 40");
    write_text(folder / "swing.yaml", longer);
    auto run = std::async(std::launch::async,
                          [&] { return livetet(folder, "solve swing.yaml", mpirun(2)); });
    wait_for_checkpoint(folder, run);
    remove_checkpoints_between_files(folder);
    const auto outcome = run.get();
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_NE(outcome.err.find("livetet: swing.h5.parts/"), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "swing.h5"));
}

TEST(Restart, ARankThatDoesNotSeeTheFolderOfTheResultsIsNamed) {
    const Folder folder;
    prepare_swing(folder);
    std::filesystem::create_directory(folder / "elsewhere");
    for (const std::string name : {"block.h5", "swing.yaml"})
        std::filesystem::copy(folder / name, folder / "elsewhere");
    const auto outcome =
        test::run(folder, "timeout 60 mpirun --oversubscribe -n 1 '" LIVETET_PROGRAM
                          "' solve swing.yaml : -n 1 --wdir elsewhere '" LIVETET_PROGRAM
                          "' solve swing.yaml");
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_NE(outcome.err.find("cannot be written by rank 1: No such file or directory, expected "
                               "a folder that all ranks share"),
              std::string::npos)
        << outcome.err;
}

TEST(Restart, AKilledRunGoesOnFromItsCheckpointOnAnotherNumberOfRanks) {
    const Folder folder;
    prepare_swing(folder);
    ASSERT_EQ(livetet(folder, "solve whole.yaml").status, 0);
    const ResultReader whole(folder / "whole.h5");
    ASSERT_EQ(whole.frame_count(), 20u);
    for (const auto& [before, after] : {std::pair{1, 3}, {4, 2}}) {
        kill_after_checkpoint(folder, mpirun(before));
        ASSERT_FALSE(std::filesystem::exists(folder / "swing.h5"));
        if (before > 1) {  // that checkpoints are rarer from now on makes no other run of it
            std::string rarer = test::text_of(folder / "swing.yaml");
            rarer.replace(rarer.find("checkpoint_every: 5"), 19, "checkpoint_every: 7");
            write_text(folder / "swing.yaml", rarer);
        }
        const auto outcome = livetet(folder, "solve swing.yaml --restart", mpirun(after));
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        {
            const ResultReader result(folder / "swing.h5");
            ASSERT_EQ(result.times_s(), whole.times_s());
            double largest = 0, apart = 0, stress = 0, stress_apart = 0;
            for (std::size_t k = 0; k < result.frame_count(); ++k) {
                const auto a = whole.displacement(k), b = result.displacement(k);
                for (std::size_t n = 0; n < a.size(); ++n) {
                    largest = std::max(largest, a[n].norm());
                    apart = std::max(apart, (a[n] - b[n]).norm());
                }
                const auto s = whole.field("von_mises", k, 1), t = result.field("von_mises", k, 1);
                for (std::size_t e = 0; e < s.size(); ++e) {
                    stress = std::max(stress, s[e]);
                    stress_apart = std::max(stress_apart, std::abs(s[e] - t[e]));
                }
            }
            EXPECT_GT(largest, 0.01);
            EXPECT_LT(apart, 1e-6 * largest);
            EXPECT_LT(stress_apart, 1e-4 * stress);
            const auto r = whole.field("reactions", 19, 3), q = result.field("reactions", 19, 3);
            ASSERT_EQ(r.size(), q.size());
            double force = 0, force_apart = 0;
            for (std::size_t i = 0; i < r.size(); ++i) {
                force = std::max(force, std::abs(r[i]));
                force_apart = std::max(force_apart, std::abs(r[i] - q[i]));
            }
            EXPECT_GT(force, 0.01);
            EXPECT_LT(force_apart, 1e-4 * force);
        }
        EXPECT_FALSE(std::filesystem::exists(folder / "swing.h5.parts"));
        std::filesystem::remove(folder / "swing.h5");
    }
}

TEST(Restart, WhatCannotGoOnIsRefusedAndNothingIsLost) {
    const Folder folder;
    prepare_swing(folder);
    expect_refused(livetet(folder, "solve swing.yaml --restart"),
                   {"swing.h5.parts", "no checkpoint"});
    kill_after_checkpoint(folder, "");
    const auto checkpoint = folder / "swing.h5.parts/checkpoint.h5";
    const std::string bytes = test::text_of(checkpoint);
    expect_refused(livetet(folder, "solve swing.yaml"), {"swing.h5.parts", "--restart"});
    std::string other = test::text_of(folder / "swing.yaml");
    other.replace(other.find("50000"), 5, "60000");
    write_text(folder / "swing.yaml", other);
    expect_refused(livetet(folder, "solve swing.yaml --restart"),
                   {"checkpoint.h5", "another scene", "50000", "60000"});
    other.replace(other.find("60000"), 5, "50000");
    write_text(folder / "swing.yaml", other);
    MeshHierarchy moved = read_hierarchy(folder / "block.h5");
    for (Vector3& x : moved.levels.front().nodes) x *= 1.001;
    write_hierarchy(folder / "block.h5", moved);
    expect_refused(livetet(folder, "solve swing.yaml --restart"), {"checkpoint.h5", "mesh"});
    const auto on_three = livetet(folder, "solve swing.yaml --restart", mpirun(3));
    EXPECT_EQ(on_three.status, 2) << on_three.err;  // Open MPI adds lines of its own
    EXPECT_NE(on_three.err.find("checkpoint.h5: belongs to another scene or mesh"),
              std::string::npos)
        << on_three.err;
    EXPECT_TRUE(test::text_of(checkpoint) == bytes);
    write_text(folder / "static.yaml",
               "mesh: {file: block.h5}\nfix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]\n");
    expect_refused(livetet(folder, "solve static.yaml --restart"), {"static"});
}

}  // namespace
}  // namespace livetet
