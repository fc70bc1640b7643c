#include "base/child_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <memory>
#include <system_error>

#include <fmt/format.h>

#include "base/stopwatch.hpp"

namespace livetet {

namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;
using Clock = std::chrono::steady_clock;

constexpr int failed_by_exception = 125;
constexpr off_t max_log_bytes = 1 << 16;

/// An unnamed temporary file: removed when closed, even if this process is killed.
File temporary_file() {
    std::FILE* file = std::tmpfile();
    if (!file)
        throw std::system_error(errno, std::generic_category(),
                                "no temporary file for a child process");
    return {file, &std::fclose};
}

/// The last `max_bytes` bytes of a file, or all of it.
std::vector<char> contents(std::FILE* file, off_t max_bytes = std::numeric_limits<off_t>::max()) {
    const int descriptor = fileno(file);
    const off_t size = std::max<off_t>(::lseek(descriptor, 0, SEEK_END), 0),
                from = size - std::min(size, max_bytes);
    std::vector<char> bytes(static_cast<std::size_t>(size - from));
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t n = ::pread(descriptor, bytes.data() + done, bytes.size() - done,
                                  from + static_cast<off_t>(done));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0)
            throw std::system_error(errno, std::generic_category(),
                                    "reading a child process's result");
        done += static_cast<std::size_t>(n);
    }
    return bytes;
}

void restore_default_signals() {
    // Exceeding the file size limit must stay a write error.
    for (int s = 1; s < NSIG; ++s)
        if (s != SIGXFSZ) ::signal(s, SIG_DFL);
    sigset_t none;
    sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    const rlimit no_core{0, 0};
    ::setrlimit(RLIMIT_CORE, &no_core);
}

[[noreturn]] void be_child(const std::function<int(int)>& work, pid_t parent, int result, int log) {
    restore_default_signals();
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent)
        ::_exit(failed_by_exception);  // the parent died before prctl took effect
    ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
    ::dup2(log, STDOUT_FILENO);
    ::dup2(log, STDERR_FILENO);
    int status = failed_by_exception;
    try {
        status = work(result);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "\nError   : %s\n", error.what());
    } catch (...) {
        std::fprintf(stderr, "\nError   : an exception without a text\n");
    }
    std::fflush(stdout);
    std::fflush(stderr);
    ::_exit(status);
}

/// Waits for the child and kills it at the deadline. Returns true if it had to be killed.
bool wait_or_kill(pid_t child, Clock::time_point deadline, int& status) {
    const int handle = static_cast<int>(
        ::syscall(SYS_pidfd_open, child, 0));  // fails before Linux 5.3; then polls every ms
    pollfd end{handle, POLLIN, 0};
    bool ended = false;
    while (!ended) {
        const pid_t answer = ::waitpid(child, &status, WNOHANG);
        if (answer < 0 && errno != EINTR)
            throw std::system_error(errno, std::generic_category(), "waitpid");
        ended = answer == child;
        if (ended || Clock::now() >= deadline) break;
        ::poll(&end, 1, handle < 0 ? 1 : 100);
    }
    if (handle >= 0) ::close(handle);
    if (ended) return false;
    ::kill(child, SIGKILL);
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return true;
}

void lower_limit(int resource, rlim_t value) {
    rlimit limit{};
    ::getrlimit(resource, &limit);
    limit.rlim_cur = std::min({value, limit.rlim_cur, limit.rlim_max});
    if (::setrlimit(resource, &limit) != 0)
        throw std::system_error(errno, std::generic_category(), "a child process's limit");
}

}  // namespace

void limit_memory(std::uint64_t bytes) {
    std::uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    lower_limit(RLIMIT_AS, pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) + bytes);
    lower_limit(RLIMIT_FSIZE, bytes);
}

void limit_processor_time(double seconds) {
    lower_limit(RLIMIT_CPU, static_cast<rlim_t>(std::ceil(seconds)));
}

bool write_all(int descriptor, const void* data, std::size_t bytes) {
    const char* at = static_cast<const char*>(data);
    while (bytes > 0) {
        const ssize_t n = ::write(descriptor, at, bytes);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        at += n;
        bytes -= static_cast<std::size_t>(n);
    }
    return true;
}

ChildResult run_in_child(const std::function<int(int)>& work, double time_limit_s) {
    const File result = temporary_file(), log = temporary_file();
    std::fflush(nullptr);  // the child must not print this process's buffered output again
    const pid_t parent = ::getpid();
    const auto start = Clock::now();
    const pid_t child = ::fork();
    if (child < 0) throw std::system_error(errno, std::generic_category(), "fork");
    if (child == 0) be_child(work, parent, fileno(result.get()), fileno(log.get()));

    constexpr double for_ever_s = 1e9;  // larger values overflow the clock
    const auto limit = std::chrono::duration_cast<Clock::duration>(
        std::chrono::duration<double>(std::min(time_limit_s, for_ever_s)));
    int status = 0;
    ChildResult out;
    const bool killed = wait_or_kill(child, start + limit, status);
    out.seconds = seconds_since(start);
    const std::vector<char> text = contents(log.get(), max_log_bytes);
    out.log.assign(text.begin(), text.end());
    if (killed) {
        out.end = ChildResult::End::timed_out;
    } else if (WIFSIGNALED(status)) {
        out.end = ChildResult::End::crashed;
        out.detail = WTERMSIG(status);
    } else if (WEXITSTATUS(status) != 0) {
        out.end = ChildResult::End::failed;
        out.detail = WEXITSTATUS(status);
    } else {
        out.result = contents(result.get());
    }
    return out;
}

std::string last_error_lines(const std::string& log) {
    std::vector<std::string> lines, errors;
    for (std::size_t from = 0; from < log.size();) {
        const std::size_t to = std::min(log.find('\n', from), log.size());
        const std::string line = log.substr(from, to - from);
        if (!line.empty()) lines.push_back(line);
        if (line.find("Error") != std::string::npos)
            errors.push_back(line.substr(line.find("Error")));
        from = to + 1;
    }
    const std::vector<std::string>& from = errors.empty() ? lines : errors;
    std::string words;
    for (std::size_t i = from.size() > 3 ? from.size() - 3 : 0; i < from.size(); ++i)
        words += (words.empty() ? "" : "; ") + from[i];
    return words.empty() ? "it printed nothing" : words;
}

std::string describe_end(const ChildResult& child, double time_limit_s) {
    switch (child.end) {
        case ChildResult::End::timed_out:
            return fmt::format("did not end within {:.1f} s and was killed", time_limit_s);
        case ChildResult::End::crashed:
            if (child.detail == SIGXCPU) return "took more processor time than it may";
            return fmt::format("crashed (signal {})", child.detail);
        case ChildResult::End::failed:
        case ChildResult::End::returned:
            break;
    }
    return "failed: " + last_error_lines(child.log);
}

}  // namespace livetet
