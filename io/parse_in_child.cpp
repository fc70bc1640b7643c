#include "io/parse_in_child.hpp"

#include <algorithm>
#include <csignal>
#include <stdexcept>

#include "base/child_process.hpp"
#include "base/error.hpp"

namespace livetet {

namespace {

/// First byte of the result: says what follows.
constexpr char whole = 'w', refused = 'r';

double processor_limit_s(std::uintmax_t bytes) { return 5 + 2e-6 * static_cast<double>(bytes); }

/// Runs in the child process.
int answer(int descriptor, const std::function<std::vector<char>()>& parse) {
    const auto write = [descriptor](char kind, const char* data, std::size_t bytes) {
        if (!write_all(descriptor, &kind, 1) || !write_all(descriptor, data, bytes))
            throw std::runtime_error("the temporary folder is full");
        return 0;
    };
    try {
        const std::vector<char> result = parse();
        return write(whole, result.data(), result.size());
    } catch (const Error& error) {
        const std::string text = error.what();
        return write(refused, text.data(), text.size());
    }
}

/// True for SIGKILL: another program killed the child, or the system, for want of memory, or at a
/// hard limit of processor time that this process has itself.
bool killed_by_others(const ChildResult& child) {
    return child.end == ChildResult::End::crashed && child.detail == SIGKILL;
}

}  // namespace

std::vector<char> parse_in_child(const std::filesystem::path& path, const std::string& who,
                                 const std::function<std::vector<char>()>& parse) {
    std::error_code ignored;
    const std::uintmax_t size = std::filesystem::file_size(path, ignored);
    if (ignored) fail("{}: no such file", path.string());
    return parse_in_child(path, size, who, parse);
}

std::vector<char> parse_in_child(const std::filesystem::path& path, std::uintmax_t bytes,
                                 const std::string& who,
                                 const std::function<std::vector<char>()>& parse) {
    const double time_limit_s = 20 * processor_limit_s(bytes);  // generous, for a busy machine
    const auto work = [&](int descriptor) {
        limit_parser(bytes);
        return answer(descriptor, parse);
    };
    ChildResult child = run_in_child(work, time_limit_s);
    if (killed_by_others(child)) child = run_in_child(work, time_limit_s);
    if (killed_by_others(child))
        fail("{}: cannot be read: {} was killed twice (signal 9), for want of memory?",
             path.string(), who);
    if (child.end != ChildResult::End::returned || child.result.empty())
        fail("{}: cannot be read, is it damaged? {} {}", path.string(), who,
             describe_end(child, time_limit_s));
    const char kind = child.result.front();
    child.result.erase(child.result.begin());
    if (kind == whole) return std::move(child.result);
    std::string text(child.result.begin(), child.result.end());
    std::replace_if(
        text.begin(), text.end(), [](unsigned char c) { return c < ' '; }, ' ');
    throw Error(text);
}

void limit_parser(std::uintmax_t bytes) {
    limit_processor_time(processor_limit_s(bytes));
    limit_memory((std::uint64_t(2) << 30) + 100 * bytes);
}

}  // namespace livetet
