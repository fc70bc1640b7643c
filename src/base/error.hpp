#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace livetet {

/// Bad input: a scene, a file, a message from the network. The message is one line that says what
/// was wrong, where (file, line or key), what was found and what was expected. The program prints
/// it and exits with status 2.
class Error : public std::runtime_error {
  public:
    explicit Error(const std::string& message) : std::runtime_error(printable(message)) {}

  private:
    /// A file's control characters as \xNN: a NUL would cut the message.
    static std::string printable(const std::string& message) {
        std::string text;
        for (const char c : message)
            if (const auto code = static_cast<unsigned char>(c); code < ' ' && c != '\n')
                text += fmt::format("\\x{:02x}", code);
            else
                text += c;
        return text;
    }
};

/// Throws `Error` with a message formatted by fmt.
template <class... Args>
[[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) {
    throw Error(fmt::format(format, std::forward<Args>(args)...));
}

/// Returns f(). An Error thrown by it gets the prefix `where` (for example a file name).
template <class F>
decltype(auto) with_context(std::string_view where, F&& f) {
    try {
        return f();
    } catch (const Error& e) {
        fail("{}: {}", where, e.what());
    }
}

}  // namespace livetet
