#pragma once

#include <filesystem>
#include <string>

namespace livetet {

/// Thrown where the user ended (Ctrl-C, SIGTERM, SIGHUP) what a command had started and waited for:
/// the command ends as well. No std::exception, for no row of a benchmark is to take it for a
/// failure of its own.
struct Interrupted {
    int signal;
};

/// Runs a shell's command until all that it started in its process group has ended; it reads
/// nothing, and what it prints goes to `log`. Its exit status, 128 and more where a signal ended
/// it. What asks this program to end is passed on to that group; a second later and once more, the
/// group is killed. Ctrl-\ and SIGKILL end this program alone.
int run_program(const std::string& command, const std::filesystem::path& log);

}  // namespace livetet
