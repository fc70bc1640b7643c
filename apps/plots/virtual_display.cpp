// In a file of its own: Xlib.h defines macros (Success, None) that clash with other names.
#include "apps/plots/virtual_display.hpp"

#include <X11/Xauth.h>
#include <X11/Xlib.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/random.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "base/error.hpp"

namespace livetet {

namespace {

constexpr const char* does_not_start = "Xvfb does not start";

/// The connection, kept open to the end: a server resets when its last client leaves, and refuses
/// the next one meanwhile.
Display*& display() {
    static Display* display = XOpenDisplay(nullptr);
    return display;
}

/// A file descriptor, closed by its destructor.
struct Descriptor {
    int number;
    explicit Descriptor(int of) : number(of) {
        if (number < 0) fail("none can be started: {}", std::generic_category().message(errno));
    }
    ~Descriptor() { ::close(number); }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
};

/// Path of an open file for this process and its children: Open MPI looks for graphics cards
/// through X from a process of its own.
std::string name_of(int descriptor) {
    return fmt::format("/proc/{}/fd/{}", ::getpid(), descriptor);
}

/// Writes the key by which the server admits a client: nobody else may draw there, or look.
void write_cookie(int descriptor) {
    std::array<char, 18> name{'M', 'I', 'T', '-', 'M', 'A', 'G', 'I', 'C',
                              '-', 'C', 'O', 'O', 'K', 'I', 'E', '-', '1'};
    std::array<char, 16> value{};
    bool written = ::getrandom(value.data(), value.size(), 0) == static_cast<ssize_t>(value.size());
    Xauth entry{FamilyWild,  0,           nullptr,      0,           nullptr,
                name.size(), name.data(), value.size(), value.data()};
    std::FILE* file = std::fopen(name_of(descriptor).c_str(), "wb");
    written = file && written && XauWriteAuth(file, &entry) != 0;
    if (!file || std::fclose(file) != 0 || !written)
        fail("none can be started, for the key to it cannot be written");
}

/// In the child: becomes the server, which writes its number to `output`. It has a process group of
/// its own, so that Ctrl-C, after which a command may finish its work, does not end it. The system
/// ends it with this program's main thread.
[[noreturn]] void become_server(pid_t parent, const std::string& name, int output, int cookie) {
    ::setpgid(0, 0);
    ::signal(SIGTERM, SIG_DFL);
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(1);  // the parent ended before prctl took effect
    const int nothing = ::open("/dev/null", O_RDWR);
    const int kept[] = {nothing, nothing, nothing, output,
                        cookie};  // descriptors 0 to 4; none of them is open yet
    constexpr int count = 5;
    int moved[count];
    for (int k = 0; k < count; ++k) moved[k] = ::fcntl(kept[k], F_DUPFD, count);
    for (int k = 0; k < count; ++k) ::dup2(moved[k], k);
    ::closefrom(count);
    ::execlp("Xvfb", "Xvfb", name.c_str(), "-displayfd", "3", "-screen", "0", "1600x1200x24",
             "-nolisten", "tcp", "-noreset", "-auth", "/proc/self/fd/4",
             static_cast<char*>(nullptr));
    ::_exit(127);
}

/// The server's first output, its number and a newline; empty if it ends or stays silent.
std::string first_words(int output) {
    constexpr int patience_ms = 20000;
    std::string words;
    pollfd more{output, POLLIN, 0};
    for (;;) {
        const int ready = ::poll(&more, 1, patience_ms);
        if (ready < 0 && errno == EINTR) continue;  // a signal handled elsewhere
        char c = 0;
        if (ready <= 0 || ::read(output, &c, 1) != 1) return {};
        if (c == '\n') return words;
        words += c;
    }
}

/// Starts a server of this name (":99"). Returns why it cannot be used, or nothing.
std::optional<std::string> start_server(const std::string& name) {
    static const Descriptor cookie(
        ::memfd_create("livetet display", MFD_CLOEXEC));  // a file would be left behind by Ctrl-C
    write_cookie(cookie.number);
    int ends[2] = {-1, -1};
    if (::pipe2(ends, O_CLOEXEC) != 0)
        fail("none can be started: {}", std::generic_category().message(errno));
    const Descriptor output(ends[0]);
    const pid_t self = ::getpid(), server = ::fork();
    if (server == 0) become_server(self, name, ends[1], cookie.number);
    ::close(ends[1]);
    if (server < 0) fail("none can be started: {}", std::generic_category().message(errno));
    std::string problem = does_not_start;
    if (const std::string number = first_words(output.number); !number.empty()) {
        ::setenv("XAUTHORITY", name_of(cookie.number).c_str(), 1);
        ::setenv("DISPLAY", (":" + number).c_str(), 1);
        display() = XOpenDisplay(nullptr);
        if (have_display()) return std::nullopt;
        ::unsetenv("XAUTHORITY");
        ::unsetenv("DISPLAY");
        problem = "the one that was started, Xvfb, does not answer";
    }
    int status = 0;
    ::kill(server, SIGKILL);
    ::waitpid(server, &status, 0);
    return WIFEXITED(status) && WEXITSTATUS(status) == 127 ? "Xvfb is not installed" : problem;
}

/// Numbers below 10 are those that Open MPI's search for graphics cards tries; a server without a
/// key for it would make it print a line each time.
std::optional<std::string> start_some_server() {
    constexpr int first = 99, tries = 5;
    std::optional<std::string> problem;
    for (int number = first, tried = 0; tried < tries; ++number) {
        std::error_code ignored;
        if (std::filesystem::exists(fmt::format("/tmp/.X{}-lock", number), ignored) ||
            std::filesystem::exists(fmt::format("/tmp/.X11-unix/X{}", number), ignored))
            continue;  // in use
        ++tried;
        problem = start_server(fmt::format(":{}", number));
        if (problem != does_not_start) break;  // otherwise another process took the number
    }
    return problem;
}

}  // namespace

bool have_display() { return display() != nullptr; }

std::optional<std::string> find_display() {
    static const std::optional<std::string> problem = []() -> std::optional<std::string> {
        try {
            return have_display() ? std::nullopt : start_some_server();
        } catch (const Error& error) {
            return error.what();
        }
    }();
    return problem;
}

void need_display(const std::string& what) {
    if (const auto problem = find_display())
        fail("{}: there is no X server, and {}", what, *problem);
}

}  // namespace livetet
