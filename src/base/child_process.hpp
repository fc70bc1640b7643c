#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace livetet {

/// What became of a child process. Nothing of it is left running, and no file.
struct ChildResult {
    enum class End { returned, failed, crashed, timed_out };
    End end = End::returned;
    int detail = 0;            ///< failed: its exit status; crashed: its signal
    std::vector<char> result;  ///< what it wrote to the result's descriptor
    std::string log;           ///< the last 64 KiB of what it printed
    double seconds = 0;        ///< wall time
};

/// Runs `work` in a forked child and waits for it; after `time_limit_s` seconds the child gets
/// SIGKILL. `work` is given a file descriptor to write its result to; what it prints is captured,
/// its return value is the exit status (0: well). The child ends by _exit: no destructor and no
/// exit handler of this process runs in it, its signals are the system's own (no handler of MPI or
/// PETSc), and it dies with its parent. `work` must not touch MPI, PETSc or any thread of the
/// parent. Throws std::system_error where the system gives no process or no temporary file.
ChildResult run_in_child(const std::function<int(int result_descriptor)>& work,
                         double time_limit_s);

/// For `work`: this process may take `bytes` more of address space than it has now, and write no
/// larger file; a limit that it already has stays where it is lower.
void limit_memory(std::uint64_t bytes);

/// For `work`: SIGXCPU after so many seconds of processor time, however long they take.
void limit_processor_time(double seconds);

/// In a few words why a child gave no result: its end, or its last error lines. `time_limit_s`:
/// what it had.
std::string describe_end(const ChildResult& child, double time_limit_s);

/// The last of a log's error lines, else of its lines, for a message of one line.
std::string last_error_lines(const std::string& log);

/// Writes all of it, whatever the number of calls that takes; false if the system refuses.
bool write_all(int descriptor, const void* data, std::size_t bytes);

}  // namespace livetet
