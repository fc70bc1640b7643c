// Apart from all else: Xlib.h defines macros (Success, None) that others use as names.
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

/// Kept open to the end: a server resets itself when its last client leaves, and refuses the next
/// meanwhile.
Display*& display() {
    static Display* display = XOpenDisplay(nullptr);
    return display;
}

/// The system's numbers of what is open, closed with the guard.
struct Descriptor {
    int number;
    explicit Descriptor(int of) : number(of) {
        if (number < 0) fail("none can be started: {}", std::generic_category().message(errno));
    }
    ~Descriptor() { ::close(number); }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
};

/// Where this process, and those that it starts, find what it has open: Open MPI looks for graphics
/// cards by X from a process of its own.
std::string name_of(int descriptor) {
    return fmt::format("/proc/{}/fd/{}", ::getpid(), descriptor);
}

/// Writes what a client shows so that the server lets it in: nobody else may draw there, or look.
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

/// In the child: becomes the server, which says its number on `told`. It has a group of its own, so
/// that Ctrl-C, which a command may answer by finishing its work, does not take the server away
/// from under it; and it is ended by the system when this program's main thread is.
[[noreturn]] void become_server(pid_t parent, const std::string& name, int told, int cookie) {
    ::setpgid(0, 0);
    ::signal(SIGTERM, SIG_DFL);
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(1);  // it ended before it could be asked to take us along
    const int nothing = ::open("/dev/null", O_RDWR);
    const int kept[] = {nothing, nothing, nothing, told,
                        cookie};  // 0 to 4; none of them is there yet
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

/// What the server says of itself, its number and a newline; nothing where it ends or says nothing
/// for a while.
std::string first_words(int told) {
    constexpr int patience_ms = 20000;
    std::string words;
    pollfd more{told, POLLIN, 0};
    for (;;) {
        const int ready = ::poll(&more, 1, patience_ms);
        if (ready < 0 && errno == EINTR) continue;  // a signal that somebody else here answers
        char c = 0;
        if (ready <= 0 || ::read(told, &c, 1) != 1) return {};
        if (c == '\n') return words;
        words += c;
    }
}

/// Starts a server of this name (":99"). Why it cannot be used; nothing where it can.
std::optional<std::string> start_server(const std::string& name) {
    static const Descriptor cookie(
        ::memfd_create("livetet display", MFD_CLOEXEC));  // a file would stay behind after Ctrl-C
    write_cookie(cookie.number);
    int ends[2] = {-1, -1};
    if (::pipe2(ends, O_CLOEXEC) != 0)
        fail("none can be started: {}", std::generic_category().message(errno));
    const Descriptor told(ends[0]);
    const pid_t self = ::getpid(), server = ::fork();
    if (server == 0) become_server(self, name, ends[1], cookie.number);
    ::close(ends[1]);
    if (server < 0) fail("none can be started: {}", std::generic_category().message(errno));
    std::string problem = does_not_start;
    if (const std::string number = first_words(told.number); !number.empty()) {
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

/// Numbers below 10 are those that Open MPI's search for graphics cards asks for whoever runs it; a
/// server that they have no key to has it print a line each time.
std::optional<std::string> start_some_server() {
    constexpr int first = 99, tries = 5;
    std::optional<std::string> problem;
    for (int number = first, tried = 0; tried < tries; ++number) {
        std::error_code ignored;
        if (std::filesystem::exists(fmt::format("/tmp/.X{}-lock", number), ignored) ||
            std::filesystem::exists(fmt::format("/tmp/.X11-unix/X{}", number), ignored))
            continue;  // somebody's
        ++tried;
        problem = start_server(fmt::format(":{}", number));
        if (problem != does_not_start) break;  // else another took the number meanwhile
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
