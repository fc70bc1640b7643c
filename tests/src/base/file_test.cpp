#include "base/file.hpp"

#include <gtest/gtest.h>

#include "base/error.hpp"

namespace livetet {
namespace {

std::string file_refusal(const std::filesystem::path& path) {
    try {
        check_is_file(path);
    } catch (const Error& e) {
        return e.what();
    }
    return "accepted";
}

TEST(File, AFolderIsNoFile) {
    const auto folder = std::filesystem::path(testing::TempDir()) / "check_is_file";
    std::filesystem::create_directories(folder);
    write_text_file(folder / "a.txt", "text");
    EXPECT_EQ(file_refusal(folder / "a.txt"), "accepted");
    EXPECT_EQ(file_refusal(folder), folder.string() + ": is a folder, expected a file");
    EXPECT_EQ(file_refusal(folder / "b.txt"), (folder / "b.txt").string() + ": no such file");
    std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace livetet
