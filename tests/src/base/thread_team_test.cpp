#include "base/thread_team.hpp"

#include <gtest/gtest.h>
#include <sched.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <future>
#include <iostream>
#include <thread>
#include <vector>

namespace livetet {
namespace {

using namespace std::chrono_literals;
using std::this_thread::sleep_for;

/// Ends the program if `body` hangs, so that a lost wake-up is a failure.
template <class Body>
void in_time(Body&& body) {
    auto done = std::async(std::launch::async, body);
    if (done.wait_for(120s) == std::future_status::timeout) {
        std::cerr << "a team hangs\n";
        std::abort();
    }
    done.get();
}

/// Counts calls by thread without a lock: the team must make the counts visible to the caller.
struct Calls {
    std::array<std::size_t, 4> by_thread{};
    void run(ThreadTeam& team) {
        team.run([this](int thread) { ++by_thread.at(thread); });
    }
    /// Expects `rounds` calls on each of the team's threads and none on others.
    bool are(const ThreadTeam& team, std::size_t rounds) const {
        for (int t = 0; t < 4; ++t)
            if (by_thread[t] != (t < team.size() ? rounds : 0)) return false;
        return true;
    }
};

class ThreadTeamOf : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Sizes, ThreadTeamOf, testing::Values(1, 2, 3, 4));

TEST_P(ThreadTeamOf, DoesEachThreadsWorkOnceACall) {
    in_time([&] {
        ThreadTeam team(GetParam());
        ASSERT_EQ(team.size(), GetParam());
        Calls calls;
        // Fewer rounds if the threads share cores, as a round then takes a time slice of the
        // system.
        const auto late = std::chrono::steady_clock::now() + 4s;
        for (std::size_t round = 1; round <= 100000 && std::chrono::steady_clock::now() < late;
             ++round) {
            calls.run(team);
            ASSERT_TRUE(calls.are(team, round)) << round;
        }
    });
}

/// Each round reads what the other threads wrote in the round before.
TEST_P(ThreadTeamOf, BringsResultsToTheCallerAndToTheOtherThreads) {
    in_time([&] {
        ThreadTeam team(GetParam());
        const int size = team.size();
        std::array<std::vector<std::uint64_t>, 4> mine;
        for (auto& m : mine) m.assign(100, 1);
        std::uint64_t expected = 1;
        for (int round = 0; round < 300; ++round) {
            std::array<std::vector<std::uint64_t>, 4>
                next;  // the workers allocate, the caller frees
            team.run([&](int thread) {
                next[thread] = mine[(thread + 1) % size];
                for (std::uint64_t& x : next[thread]) x = 5 * x + 1;
            });
            expected = 5 * expected + 1;
            for (int t = 0; t < size; ++t)
                ASSERT_EQ(next[t], std::vector<std::uint64_t>(100, expected)) << round;
            mine = std::move(next);
        }
    });
}

TEST_P(ThreadTeamOf, CoversEveryCountOnceInPiecesOfAtLeastTheGrain) {
    in_time([&] {
        ThreadTeam team(GetParam());
        const auto size = static_cast<std::size_t>(team.size());
        for (const std::size_t count : {0, 1, 7, 1000})
            for (const std::size_t grain :
                 {std::size_t{0}, std::size_t{1}, count / size, count / size + 1, count + 1}) {
                std::vector<int> visits(count);
                std::atomic<std::size_t> pieces{0};
                std::atomic<bool> elsewhere{false}, too_small{false};
                team.run_pieces(
                    count, grain,
                    [&, caller = std::this_thread::get_id()](std::size_t begin, std::size_t end) {
                        ++pieces;
                        if (std::this_thread::get_id() != caller) elsewhere = true;
                        if (end - begin < grain && end - begin < count) too_small = true;
                        for (std::size_t k = begin; k < end; ++k) ++visits.at(k);
                    });
                EXPECT_EQ(visits, std::vector<int>(count, 1)) << grain;
                EXPECT_FALSE(too_small) << count << ' ' << grain;
                const bool whole = count < grain * size || size == 1;
                EXPECT_EQ(pieces, whole ? 1 : size) << count << ' ' << grain;
                EXPECT_FALSE(elsewhere && whole) << count << ' ' << grain;
            }
    });
}

TEST_P(ThreadTeamOf, DoesEachTaskOnce) {
    in_time([&] {
        ThreadTeam team(GetParam());
        for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{2},
                                        std::size_t{7}, ThreadTeam::max_tasks})
            for (int round = 1; round <= 50; ++round) {
                std::array<int, ThreadTeam::max_tasks> times{};  // no lock: one thread a task
                team.run_tasks(count, [&](std::size_t task) { ++times.at(task); });
                for (std::size_t task = 0; task < times.size(); ++task)
                    ASSERT_EQ(times[task], task < count) << task << " of " << count;
            }
    });
}

TEST(ThreadTeam, HasNoMoreThreadsThanTasksCanBeTold) {
    in_time([] {
        ThreadTeam team(70);
        EXPECT_EQ(team.size(), static_cast<int>(ThreadTeam::max_tasks));
        std::vector<int> visits(1000);
        team.run_pieces(visits.size(), 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t k = begin; k < end; ++k) ++visits[k];
        });
        EXPECT_EQ(visits, std::vector<int>(1000, 1));
    });
}

TEST(ThreadTeam, TakesTheTasksOfAThreadThatIsHeldUp) {
    in_time([] {
        ThreadTeam team(2);
        constexpr std::size_t count = 8;
        std::atomic<std::size_t> done{0};
        // Whoever has the first task waits until all others are done, half of which were its own.
        team.run_tasks(count, [&](std::size_t task) {
            if (task == 0)
                while (done < count - 1) std::this_thread::yield();
            ++done;
        });
        EXPECT_EQ(done, count);
    });
}

/// Workers are just late, in time or asleep, as it comes: each piece is done once, and what it
/// wrote is there.
TEST_P(ThreadTeamOf, DoesEachPieceOnceHoweverLateWorkersAre) {
    in_time([&] {
        ThreadTeam team(GetParam());
        std::array<std::size_t, 64> values{};  // no lock
        std::size_t round = 0;
        const auto late = std::chrono::steady_clock::now() + 2s;
        while (std::chrono::steady_clock::now() < late) {
            ++round;
            team.run_pieces(values.size(), 1, [&](std::size_t begin, std::size_t end) {
                for (std::size_t k = begin; k < end; ++k) ++values[k];
            });
            for (const std::size_t v : values) ASSERT_EQ(v, round);
            if (round % 500 == 0) sleep_for(round % 1000 == 0 ? 3ms : 100us);
        }
    });
}

TEST(ThreadTeam, OfOneRunsOnTheCallersThread) {
    ThreadTeam one(1), none_said;
    for (ThreadTeam* team : {&one, &none_said, &ThreadTeam::alone()}) {
        EXPECT_EQ(team->size(), 1);
        std::vector<std::thread::id> ran_on;
        team->run([&](int thread) {
            EXPECT_EQ(thread, 0);
            ran_on.push_back(std::this_thread::get_id());
        });
        EXPECT_EQ(ran_on, std::vector{std::this_thread::get_id()});
    }
}

TEST(ThreadTeam, RunsTheCallersPartOnTheCallersThreadAndTheOthersElsewhere) {
    in_time([] {
        ThreadTeam team(3);
        std::array<std::thread::id, 3> ran_on;
        team.run([&](int thread) { ran_on.at(thread) = std::this_thread::get_id(); });
        EXPECT_EQ(ran_on[0], std::this_thread::get_id());
        EXPECT_NE(ran_on[1], ran_on[0]);
        EXPECT_NE(ran_on[2], ran_on[0]);
        EXPECT_NE(ran_on[1], ran_on[2]);
    });
}

TEST(ThreadTeam, WakesWorkersThatSleep) {
    in_time([] {
        ThreadTeam team(3);
        Calls calls;
        for (std::size_t round = 1; round <= 20; ++round) {
            sleep_for(20ms);
            calls.run(team);
            ASSERT_TRUE(calls.are(team, round)) << round;
        }
    });
}

/// Teams crowd on one core, so that a worker that is woken comes to look only when another one may
/// sleep again.
TEST(ThreadTeam, WakesWorkersOnACrowdedCore) {
    in_time([] {
        cpu_set_t allowed, one;
        CPU_ZERO(&one);
        ASSERT_EQ(sched_getaffinity(0, sizeof(allowed), &allowed), 0);
        for (int core = 0; CPU_COUNT(&one) == 0; ++core)
            if (CPU_ISSET(core, &allowed)) CPU_SET(core, &one);
        ASSERT_EQ(sched_setaffinity(0, sizeof(one), &one), 0);  // this thread and those it makes
        std::vector<std::thread> callers;
        for (std::size_t c = 0; c < 16; ++c)
            callers.emplace_back([c] {
                ThreadTeam team(4);
                Calls calls;
                for (std::size_t round = 1; round <= 300; ++round) {
                    sleep_for(3ms + (round * 37 + c * 101) % 30 * 200us);
                    calls.run(team);
                    EXPECT_TRUE(calls.are(team, round)) << round;
                }
            });
        for (std::thread& caller : callers) caller.join();
    });
}

/// Workers sleep after about 2 ms: calls just before, at and after that time.
TEST(ThreadTeam, LosesNoCallToWorkersAboutToSleep) {
    in_time([] {
        ThreadTeam team(2);
        Calls calls;
        for (std::size_t round = 1; round <= 500; ++round) {
            const auto until = std::chrono::steady_clock::now() + 1900us + round * 1us;
            while (std::chrono::steady_clock::now() < until) {
            }
            calls.run(team);
            ASSERT_TRUE(calls.are(team, round)) << round;
        }
    });
}

TEST(ThreadTeam, TakesNoTimeOfTheProcessorWhileItHasNothingToDo) {
    in_time([] {
        ThreadTeam team(3);
        Calls calls;
        for (std::size_t round = 1; round <= 2; ++round) {  // before the first call and after it
            sleep_for(100ms);
            const std::clock_t begin = std::clock();
            sleep_for(100ms);
            EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 0.02);
            calls.run(team);
        }
    });
}

TEST(ThreadTeam, EndsWhateverItsWorkersAreAt) {
    in_time([] {
        for (int k = 0; k < 300; ++k) ThreadTeam just_made(3);
        for (int k = 0; k < 300; ++k) {
            ThreadTeam just_at_work(3);
            Calls calls;
            calls.run(just_at_work);
            ASSERT_TRUE(calls.are(just_at_work, 1));
        }
        for (int k = 0; k < 20; ++k) {
            ThreadTeam asleep(3);
            if (k % 2) Calls().run(asleep);
            sleep_for(10ms);
        }
        for (int k = 0; k < 200; ++k) {
            ThreadTeam about_to_sleep(2);
            Calls().run(about_to_sleep);
            sleep_for(1800us + k * 2us);
        }
    });
}

}  // namespace
}  // namespace livetet
