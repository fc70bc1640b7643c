// The program `livetet`: answers --version, and runs the program that a command needs in its place,
// so that a command waits for no libraries that it does not use. Both are commands/main.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <system_error>

#include "apps/commands/companion_program.hpp"
#include "apps/commands/version_text.hpp"
#include "base/error.hpp"

namespace {

/// Needs neither images nor pictures. `solve` does for some scenes, and then runs the other program
/// itself (apps/commands/image_program.hpp).
constexpr std::string_view lean_commands[] = {"solve", "calibrate", "record", "serve", "scene"};

[[maybe_unused]] bool is_lean(std::string_view command) {
    return std::ranges::find(lean_commands, command) != std::end(lean_commands);
}

const char* program_for([[maybe_unused]] std::string_view command) {
#ifdef LIVETET_IMAGES
    if (!is_lean(command)) return "livetet-full";
#endif
    return "livetet-lean";
}

/// Has the C library take memory in pages of 2 MB where the system gives them on request. A mesh
/// of millions of tets touches its memory for the first time twice as fast, and its sweeps over
/// matrices miss fewer translations. The library reads this when a program starts, and only then.
void ask_for_large_pages() {
    constexpr std::string_view key = "glibc.malloc.hugetlb";
    const char* given = std::getenv("GLIBC_TUNABLES");
    const std::string others = given ? given : "";
    if (others.find(key) != std::string::npos) return;  // the user's word
    const std::string all = fmt::format("{}{}{}=1", others, others.empty() ? "" : ":", key);
    ::setenv("GLIBC_TUNABLES", all.c_str(), 1);
}

/// As the programs do: a full disk is an error.
void print_version() {
    if (std::puts(livetet::version_text().c_str()) < 0 || std::fflush(stdout) != 0)
        throw std::system_error(errno, std::generic_category(), "standard output");
}

}  // namespace

int main(int argc, char** argv) {
    try {
        if (argc == 2 && std::string_view(argv[1]) == "--version") {
            print_version();
            return 0;
        }
        ask_for_large_pages();
        const std::filesystem::path programs = livetet::program_folder() / LIVETET_PROGRAMS;
        const char* program = program_for(argc > 1 ? argv[1] : "");
        livetet::run_instead((programs / program).lexically_normal(), argv);
    } catch (const std::exception& e) {
        std::fputs(fmt::format("livetet: {}\n", e.what()).c_str(), stderr);
        return 2;
    }
}
