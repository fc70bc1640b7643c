//     fuzz_... [TARGET ...] [--seconds N] [--seed S] [--inputs FOLDER] [--replay FILE]
// Feeds changed inputs to each target (default: all targets of the program) for N seconds each. The
// same seed gives the same inputs; the files of FOLDER are added to the valid inputs. The program
// ends with status 1, and writes the input to fuzz_TARGET.bin, if a reader ends other than by
// returning or a livetet::Error, takes more than 30 s of processor time or 3 minutes, or takes too
// much memory.

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "base/error.hpp"
#include "fuzz/mutate.hpp"

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/common_interface_defs.h>
#endif

namespace livetet::fuzz {

Bytes bytes_of(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

namespace {

constexpr unsigned max_s = 180;  // generous, for a busy machine
constexpr ::itimerval longest_of_processor{{}, {30, 0}}, no_limit{};

struct Arguments {
    std::vector<std::string> names;
    double seconds = 5;
    std::uint64_t seed = 1;
    std::filesystem::path inputs, replay;
};

// For the signal handler: the current input and the file to write it to.
ByteView under_way;
char fault_path[256];

void leave_input(const char* what) {
    const int file = ::open(fault_path, O_CREAT | O_TRUNC | O_WRONLY, 0644);
    if (file < 0 || ::write(file, under_way.data(), under_way.size()) < 0) return;
    ::close(file);
    for (const char* text :
         std::initializer_list<const char*>{"\nfault: ", what, "; its input is ", fault_path, "\n"})
        if (::write(STDERR_FILENO, text, std::strlen(text)) < 0) return;
}

extern "C" void on_signal(int signal) {
    leave_input(signal == SIGALRM   ? "runs for more than 3 minutes"
                : signal == SIGPROF ? "takes more than 30 s of processor time"
                                    : ::strsignal(signal));
    ::_exit(1);
}

#if defined(__SANITIZE_ADDRESS__)
void on_sanitizer() { leave_input("the address sanitizer stopped it"); }
#endif

void watch_for_faults(const std::string& target) {
    *fmt::format_to_n(fault_path, sizeof fault_path - 1, "fuzz_{}.bin", target).out = '\0';
#if defined(__SANITIZE_ADDRESS__)
    __sanitizer_set_death_callback(on_sanitizer);
#else
    for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL}) ::signal(signal, on_signal);
#endif
    for (const int signal : {SIGABRT, SIGALRM, SIGPROF}) ::signal(signal, on_signal);
}

/// Whether the reader rejected the input; rethrows other exceptions than Error.
bool refused(const Target& target, ByteView input) {
    under_way = input;
    ::alarm(max_s);
    ::setitimer(ITIMER_PROF, &longest_of_processor, nullptr);
    bool is_error = false;
    try {
        target.run(input);
    } catch (const Error&) {
        is_error = true;
    } catch (const std::exception& e) {
        leave_input(e.what());
        throw;
    }
    ::alarm(0);
    ::setitimer(ITIMER_PROF, &no_limit, nullptr);
    return is_error;
}

void run(const Target& target, const Arguments& arguments) {
    watch_for_faults(target.name);
    if (!arguments.replay.empty()) {
        refused(target, bytes_of(arguments.replay));
        return;
    }
    std::vector<Bytes> seeds = target.seeds();
    if (!arguments.inputs.empty())
        for (const auto& entry : std::filesystem::directory_iterator(arguments.inputs))
            seeds.push_back(bytes_of(entry.path()));
    for (std::size_t i = 0; i < seeds.size(); ++i)
        if (refused(target, seeds[i]) && arguments.inputs.empty())
            throw std::runtime_error(
                fmt::format("{}: the good input {} is refused", target.name, i));
    std::mt19937_64 random(arguments.seed);
    std::uint64_t inputs = 0, errors = 0;
    const auto end =
        std::chrono::steady_clock::now() + std::chrono::duration<double>(arguments.seconds);
    for (; std::chrono::steady_clock::now() < end; ++inputs) {
        const Bytes input = mutated(seeds, random);
        errors += refused(target, input);
    }
    fmt::print("{}: {} inputs, {} refused\n", target.name, inputs, errors);
    std::fflush(stdout);
    if (inputs == 0 || errors == 0)
        throw std::runtime_error(target.name + ": nothing was refused: nothing was tried");
}

Arguments parse(int count, char** texts) {
    Arguments a;
    for (int i = 1; i < count; ++i) {
        const std::string text = texts[i];
        const std::string value = i + 1 < count ? texts[i + 1] : "";
        if (!text.starts_with("--")) {
            a.names.push_back(text);
            continue;
        }
        ++i;
        if (text == "--seconds")
            a.seconds = std::stod(value);
        else if (text == "--seed")
            a.seed = std::stoull(value);
        else if (text == "--inputs")
            a.inputs = value;
        else if (text == "--replay")
            a.replay = value;
        else
            throw std::runtime_error(text + ": expected --seconds, --seed, --inputs or --replay");
    }
    return a;
}

int main_of(int count, char** texts) {
    const Arguments arguments = parse(count, texts);
    std::size_t ran = 0;
    for (const Target& target : targets())
        if (arguments.names.empty() || std::ranges::count(arguments.names, target.name)) {
            run(target, arguments);
            ++ran;
        }
    if (ran < std::max<std::size_t>(arguments.names.size(), 1))
        throw std::runtime_error("no target of that name");
    return 0;
}

}  // namespace
}  // namespace livetet::fuzz

int main(int count, char** texts) {
    try {
        return livetet::fuzz::main_of(count, texts);
    } catch (const std::exception& e) {
        fmt::print(stderr, "{}\n", e.what());
        return 1;
    }
}
