#include "base/file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

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

TEST(File, WhetherItCanBeWrittenIsSeenWithoutATrace) {
    const auto folder = std::filesystem::path(testing::TempDir()) / "expect_writable";
    std::filesystem::create_directories(folder);
    write_text_file(folder / "kept.txt", "kept");
    EXPECT_NO_THROW(expect_writable(folder / "kept.txt"));
    EXPECT_NO_THROW(expect_writable(folder / "new.txt"));
    EXPECT_EQ(std::filesystem::file_size(folder / "kept.txt"), 4U);
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
    EXPECT_THROW(expect_writable(folder / "missing/new.txt"), Error);
    EXPECT_THROW(expect_writable(folder), Error);
    std::filesystem::remove_all(folder);
}

TEST(File, PartsThatAKilledRunLeftAreFound) {
    const auto folder = std::filesystem::path(testing::TempDir()) / "left_parts";
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    const auto part = folder / ".result.part4194305.h5";  // beyond the largest process number
    for (const char* other : {".result.part4194305.xdmf", ".other.part4194305.h5", "result.h5",
                              ".result.part.h5", ".result.partly.h5"})
        write_text_file(folder / other, "");
    write_text_file(folder / fmt::format(".result.part{}.h5", ::getpid()), "");
    EXPECT_TRUE(left_parts(folder / "result.h5").empty());
    write_text_file(part, "");
    EXPECT_EQ(left_parts(folder / "result.h5"), std::vector{part});
    EXPECT_TRUE(left_parts(folder / "nowhere/result.h5").empty());
    remove_left_parts(folder / "result.h5");
    EXPECT_TRUE(left_parts(folder / "result.h5").empty());
    EXPECT_TRUE(std::filesystem::exists(folder / fmt::format(".result.part{}.h5", ::getpid())));
    std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace livetet
