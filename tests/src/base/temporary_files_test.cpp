#include "base/temporary_files.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>

namespace livetet {
namespace {

class TemporaryFiles : public testing::TestWithParam<int> {
  protected:
    void SetUp() override {
        std::string name = (std::filesystem::temp_directory_path() / "livetet_XXXXXX").string();
        ASSERT_NE(::mkdtemp(name.data()), nullptr);
        folder = name;
    }
    void TearDown() override { std::filesystem::remove_all(folder); }
    std::filesystem::path file(const std::string& name) const {
        std::ofstream(folder / name) << "text";
        return folder / name;
    }
    bool exists(const std::string& name) const { return std::filesystem::exists(folder / name); }

    /// A program that does `work` and then gets the signal; what it ended by, as waitpid says it.
    int end_of(const std::function<void()>& work) const {
        const pid_t child = ::fork();
        if (child == 0) {
            std::signal(GetParam(), SIG_DFL);
            remove_temporary_files_at_signals();
            work();
            std::raise(GetParam());
            ::_exit(0);
        }
        int status = 0;
        EXPECT_EQ(::waitpid(child, &status, 0), child);
        return status;
    }
    std::filesystem::path folder;
};

INSTANTIATE_TEST_SUITE_P(Signals, TemporaryFiles,
                         testing::Values(SIGINT, SIGTERM, SIGHUP, SIGPIPE));

TEST_P(TemporaryFiles, AreRemovedByTheSignalThatEndsTheProgram) {
    std::filesystem::create_directories(folder / "tree/of/folders");
    (void)file("tree/of/file");
    (void)file("other");
    const int status = end_of([&] {
        const auto* one = new TemporaryPath(file("one"));
        const auto* tree = new TemporaryPath(folder / "tree");
        (void)one, (void)tree;
    });
    ASSERT_TRUE(WIFSIGNALED(status));
    EXPECT_EQ(WTERMSIG(status), GetParam());
    EXPECT_FALSE(exists("one"));
    EXPECT_FALSE(exists("tree"));
    EXPECT_TRUE(exists("other"));
}

TEST_P(TemporaryFiles, StayOnceTheyAreTemporaryNoMore) {
    const int status = end_of([&] {
        const std::filesystem::path path = file("kept");
        for (int k = 0; k < 100; ++k) const TemporaryPath kept(path);  // more than there are places
        const auto* removed = new TemporaryPath(file("removed"));
        (void)removed;
    });
    EXPECT_TRUE(WIFSIGNALED(status));
    EXPECT_TRUE(exists("kept"));
    EXPECT_FALSE(exists("removed"));
}

TEST_P(TemporaryFiles, AreLeftToTheProgramByItsForkedChildren) {
    const int status = end_of([&] {
        const TemporaryPath mine(file("mine"));
        int of_child = 0;
        const pid_t child = ::fork();
        if (child == 0) {
            std::raise(GetParam());
            ::_exit(0);
        }
        ::waitpid(child, &of_child, 0);
        ::_exit(WIFSIGNALED(of_child) && exists("mine") ? 42 : 1);
    });
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 42);
}

}  // namespace
}  // namespace livetet
