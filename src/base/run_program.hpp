#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace livetet {

/// Thrown if the user ended (Ctrl-C, SIGTERM, SIGHUP) a program that a command waited for: the
/// command ends as well. Not a std::exception, so that benchmarks do not report it as a failed row.
struct Interrupted {
    int signal;
};

/// Runs a shell's command until all that it started in its process group has ended; it reads
/// nothing, and what it prints goes to `log`. Returns its exit status, 128 or more if a signal
/// ended it. Forwards SIGINT, SIGTERM and SIGHUP to the group; a second signal at least 1 s later
/// kills it. Ctrl-\ and SIGKILL end this program alone. If `time_limit_s` is over first, kills all
/// of it and throws Error.
int run_program(const std::string& command, const std::filesystem::path& log,
                std::optional<double> time_limit_s = {});

}  // namespace livetet
