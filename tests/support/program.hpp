#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace livetet::test {

/// A folder of a test's own, empty at first, gone with the guard.
class Folder {
  public:
    explicit Folder(const std::string& which = "")
        : path_(std::filesystem::path(testing::TempDir()) /
                ("livetet_" + std::to_string(::getpid()) + "_" +
                 testing::UnitTest::GetInstance()->current_test_info()->name() + which)) {
        std::filesystem::remove_all(path_);
        std::filesystem::create_directories(path_);
    }
    ~Folder() { std::filesystem::remove_all(path_); }
    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

inline std::string text_of(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
}

inline void write_text(const std::filesystem::path& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
}

struct Outcome {
    int status = -1;
    std::string out, err;
};

/// Runs a command from within `folder`.
inline Outcome run(const Folder& folder, const std::string& command) {
    const int raw = std::system(("cd '" + folder.path().string() + "' && " + command +
                                 " >stdout.txt 2>stderr.txt </dev/null")
                                    .c_str());
    return {WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw), text_of(folder / "stdout.txt"),
            text_of(folder / "stderr.txt")};
}

/// Runs the shipped program; `before`: what stands in front of it ("mpirun -n 2").
inline Outcome livetet(const Folder& folder, const std::string& arguments,
                       const std::string& before = "") {
    return run(folder, before + " '" LIVETET_PROGRAM "' " + arguments);
}

/// The processes of the shipped program that work in `folder`, by rising number.
inline std::vector<pid_t> programs_in(const Folder& folder) {
    namespace fs = std::filesystem;
    const fs::path programs = fs::canonical(LIVETET_PROGRAMS), place = fs::canonical(folder.path());
    std::vector<pid_t> found;
    for (const fs::directory_entry& entry : fs::directory_iterator("/proc")) {
        const std::string name = entry.path().filename().string();
        if (name.find_first_not_of("0123456789") != std::string::npos) continue;
        std::error_code error;  // a process may end while it is looked at
        if (fs::read_symlink(entry.path() / "exe", error).parent_path() == programs &&
            fs::read_symlink(entry.path() / "cwd", error) == place)
            found.push_back(static_cast<pid_t>(std::stol(name)));
    }
    std::sort(found.begin(), found.end());
    return found;
}

/// Bad input: exit status 2 and one line on stderr that begins with the program's name and holds
/// each of `parts`.
inline void expect_refused(const Outcome& outcome, std::initializer_list<std::string> parts) {
    EXPECT_EQ(outcome.status, 2) << outcome.out << outcome.err;
    std::istringstream lines(outcome.err);
    std::string line, last;
    while (std::getline(lines, line))
        if (line.find('%') == std::string::npos) {  // not progress
            EXPECT_TRUE(last.empty()) << "more than one line: " << outcome.err;
            last = line;
        }
    EXPECT_EQ(last.rfind("livetet: ", 0), 0u) << outcome.err;
    for (const std::string& part : parts)
        EXPECT_NE(last.find(part), std::string::npos) << "no \"" << part << "\" in: " << last;
}

}  // namespace livetet::test
