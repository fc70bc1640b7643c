#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>

#include "base/error.hpp"

namespace livetet::testing_files {

/// A folder for this test, emptied when it starts.
inline std::filesystem::path fresh_folder() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    const auto folder = std::filesystem::path(testing::TempDir()) / "livetet_io" /
                        test->test_suite_name() / test->name();
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    return folder;
}

inline std::filesystem::path write_bytes(const std::filesystem::path& path,
                                         const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
}

inline void truncate_to(const std::filesystem::path& path, double part) {
    std::filesystem::resize_file(
        path, static_cast<std::uintmax_t>(part * std::filesystem::file_size(path)));
}

/// The folder of real inputs, if it exists on this machine.
inline std::optional<std::filesystem::path> data_folder() {
    const char* folder = std::getenv("LIVETET_DATA");
    if (!folder || !std::filesystem::is_directory(folder)) return std::nullopt;
    return std::filesystem::path(folder);
}

/// The message of the Error that `action` throws; empty if it throws none.
inline std::string error_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& error) {
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos)
            << "an error is one line: " << error.what();
        return error.what();
    }
    return {};
}

/// Whether an error message contains all of `words`.
inline testing::AssertionResult says(const std::string& message,
                                     std::initializer_list<const char*> words) {
    if (message.empty()) return testing::AssertionFailure() << "no error was thrown";
    for (const char* word : words)
        if (message.find(word) == std::string::npos)
            return testing::AssertionFailure() << "'" << word << "' is not in: " << message;
    return testing::AssertionSuccess();
}

}  // namespace livetet::testing_files

#define LIVETET_DATA_OR_SKIP(name)                                                         \
    const auto name##_or_nothing = livetet::testing_files::data_folder();                  \
    if (!name##_or_nothing) GTEST_SKIP() << "LIVETET_DATA names no folder of real inputs"; \
    const std::filesystem::path& name = *name##_or_nothing
