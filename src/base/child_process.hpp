#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace livetet {

/// Result of a child process that has ended. It left no process and no temporary file behind.
struct ChildResult {
    enum class End { returned, failed, crashed, timed_out };
    End end = End::returned;
    int detail = 0;            ///< exit status if `failed`, signal if `crashed`
    std::vector<char> result;  ///< bytes written to the result descriptor
    std::string log;           ///< the last 64 KiB of its output
    double seconds = 0;        ///< wall time
};

/// Runs `work` in a forked child process and waits for it; SIGKILL ends the child after
/// `time_limit_s` seconds. `work` receives a file descriptor for its result; its output is
/// captured; its return value is the exit status (0: success).
///
/// The child leaves through _exit, so no destructor and no exit handler of this process runs in it.
/// It has default signal handlers (none of MPI's or PETSc's) and dies with its parent. `work` must
/// not use MPI, PETSc or threads of the parent. Throws std::system_error if the system refuses a
/// process or a temporary file.
ChildResult run_in_child(const std::function<int(int result_descriptor)>& work,
                         double time_limit_s);

/// For use in `work`: limits the address space to `bytes` more than now, and the size of written
/// files to `bytes`. An existing lower limit stays.
void limit_memory(std::uint64_t bytes);

/// For use in `work`: SIGXCPU after this many seconds of processor time.
void limit_processor_time(double seconds);

/// Says, for a message, why a child gave no result: how it ended, or its last error lines.
/// `time_limit_s`: the limit it was run with.
std::string describe_end(const ChildResult& child, double time_limit_s);

/// The last three error lines of a log, or its last three lines if there are none, joined into one
/// line.
std::string last_error_lines(const std::string& log);

/// Writes all bytes, with as many calls as needed. Returns false if the system refuses.
bool write_all(int descriptor, const void* data, std::size_t bytes);

}  // namespace livetet
