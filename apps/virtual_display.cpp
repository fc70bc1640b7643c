#include "apps/virtual_display.hpp"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string_view>

#include "base/error.hpp"
#include "base/file.hpp"

extern char** environ;

namespace livetet {

namespace {

namespace fs = std::filesystem;

/// Set for what runs under a virtual display, so that it does not start another.
constexpr const char* within = "LIVETET_VIRTUAL_DISPLAY";

bool on_path(const std::string& program) {
    const char* path = std::getenv("PATH");
    std::string_view rest = path ? path : "";
    while (!rest.empty()) {
        const std::size_t colon = rest.find(':');
        const fs::path candidate = fs::path(rest.substr(0, colon)) / program;
        if (::access(candidate.c_str(), X_OK) == 0) return true;
        rest = colon == std::string_view::npos ? "" : rest.substr(colon + 1);
    }
    return false;
}

/// Runs a program to its end. Its exit status, or 127 where it could not be run or was killed.
int run_program(std::vector<std::string> words) {
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    pid_t child = 0;
    int status = 0;
    std::string mark = std::string(within) + "=1";
    std::vector<char*> environment;
    for (char** entry = environ; *entry; ++entry) environment.push_back(*entry);
    environment.insert(environment.end(), {mark.data(), nullptr});
    if (posix_spawnp(&child, argv[0], nullptr, nullptr, argv.data(), environment.data()) != 0) return 127;
    while (waitpid(child, &status, 0) < 0)
        if (errno != EINTR) return 127;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 127;
}

}  // namespace

VirtualRun run_under_virtual_display(const std::vector<std::string>& arguments) {
    if (!on_path("xvfb-run")) return {0, "xvfb-run is not installed"};
    if (std::getenv(within)) return {0, "the one that xvfb-run started cannot be used"};
    std::vector<std::string> words{"xvfb-run", "-a", "-s", "-screen 0 1600x1200x24", fs::read_symlink("/proc/self/exe").string()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return {run_program(std::move(words)), {}};
}

int rerun_under_virtual_display(const std::string& what) {
    std::istringstream words(read_text_file("/proc/self/cmdline"));
    std::vector<std::string> own;
    for (std::string word; std::getline(words, word, '\0');) own.push_back(word);
    const VirtualRun run = run_under_virtual_display({own.begin() + 1, own.end()});
    if (run.why_not) fail("{}: there is no X server, and {}", what, *run.why_not);
    return run.status;
}

}  // namespace livetet
