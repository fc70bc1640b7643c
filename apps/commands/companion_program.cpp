#include "apps/commands/companion_program.hpp"

#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>
#include <vector>

#include "base/error.hpp"

namespace livetet {

std::filesystem::path program_folder() {
    return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

void run_instead(const std::filesystem::path& program, char* const* arguments) {
    ::execv(program.c_str(), arguments);
    fail("{}: cannot be started ({}), expected it where it was installed with this program",
         program.string(), std::generic_category().message(errno));
}

void run_instead(const std::filesystem::path& program) {
    std::ifstream in("/proc/self/cmdline", std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(in), {}};  // each argument ends in a NUL
    std::vector<char*> arguments;
    for (std::size_t at = 0; at < text.size(); at = text.find('\0', at) + 1)
        arguments.push_back(&text[at]);
    arguments.push_back(nullptr);
    run_instead(program, arguments.data());
}

}  // namespace livetet
