#pragma once

#include <filesystem>
#include <string>

namespace livetet {

/// Thrown where the user ended (Ctrl-C, SIGTERM, SIGHUP) what a command had started and waited for: the command ends as well.
/// No std::exception, for no row of a benchmark is to take it for a failure of its own.
struct Interrupted {
    int signal;
};

/// Runs a shell's command to its end, which reads nothing; what it prints goes to `log`. Its exit status, 128 and more where a signal
/// ended it. What asks this program to end is passed on, to all that the command started; a second later and once more, all of that is killed.
int run_program(const std::string& command, const std::filesystem::path& log);

}  // namespace livetet
