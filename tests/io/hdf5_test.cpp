#include "io/hdf5.hpp"

#include "base/error.hpp"
#include "base/file.hpp"
#include "files.hpp"

namespace livetet::hdf5 {
namespace {

using namespace testing_files;

/// `bytes` with the occurrences `number`s (from 0) of the 4-byte little-endian value `from` changed
/// to `to`.
std::string with_number(std::string bytes, std::uint32_t from, std::uint32_t to, int number) {
    const auto text = [](std::uint32_t x) {
        return std::string(reinterpret_cast<const char*>(&x), sizeof x);
    };
    std::size_t at = bytes.find(text(from));
    for (; number > 0 && at != std::string::npos; --number) at = bytes.find(text(from), at + 1);
    return at == std::string::npos ? std::string() : bytes.replace(at, 4, text(to));
}

TEST(Hdf5, ATextThatIsLongerThanWhatIsStoredOfItIsRefused) {
    const auto path = fresh_folder() / "t.h5";
    constexpr std::uint32_t size = 54321;  // occurs as the type's size and as the storage's
    {
        File file = File::create(path, "t.h5");
        file.write_text("text", std::string(size - 1, 'x'));
    }
    const std::string good = read_text_file(path);
    EXPECT_EQ(File::open(path).read_text("text").size(), size - 1);
    int refused = 0;
    for (const std::uint32_t wrong : {size + 1, 10 * size, 1u << 27, 0xffffffffu})
        for (int number = 0; number < 2; ++number) {
            const std::string bad = with_number(good, size, wrong, number);
            ASSERT_FALSE(bad.empty());
            refused += !error_of([&] {
                            (void)File::open(write_bytes(path, bad)).read_text("text");
                        }).empty();
        }
    EXPECT_GE(refused, 4);
}

/// Found by fuzzing: HDF5 1.10 reads an invalid address if a group's name heap has no address, but
/// only when a name is looked up.
TEST(Hdf5, AGroupWhoseNamesAreNowhereEndsNobody) {
    const auto path = fresh_folder() / "t.h5";
    {
        File file = File::create(path, "t.h5");
        file.write_text("a/b/text", "x");
    }
    const std::string good = read_text_file(path);
    // A group's record; four bytes later the addresses of its tree and its heap, 8 bytes each.
    const std::string message("\x11\0\x10\0", 4);
    const std::string nowhere(8, '\xff'), far_away("\0\0\2\0\xff\xff\xff\xff", 8);
    int groups = 0;
    for (std::size_t at = good.find(message); at != std::string::npos;
         at = good.find(message, at + 1), ++groups)
        for (const std::string& tree : {good.substr(at + 8, 8), nowhere, far_away}) {
            std::string bad = good;
            bad.replace(at + 8, 8, tree).replace(at + 16, 8, nowhere);
            EXPECT_FALSE(error_of([&] {
                             const File file = File::open(write_bytes(path, bad));
                             for (const char* name : {"x", "a/x", "a/b/x"}) (void)file.has(name);
                             if (!file.has("a/b/text")) fail("no text");
                         }).empty())
                << groups;
        }
    EXPECT_EQ(groups, 3);  // the root group, a and b
}

TEST(Hdf5, WhatIsReservedIsTakenAndGivenBack) {
    const auto path = fresh_folder() / "t.h5";
    File file = File::create(path, "t.h5");
    ASSERT_TRUE(file.reserve(1 << 20));
    EXPECT_GE(std::filesystem::file_size(path), 1u << 20);
    file.write_text("text", "abc");
    file.flush();
    file.give_back();
    EXPECT_LT(std::filesystem::file_size(path), 1u << 16);
    EXPECT_EQ(file.read_text("text"), "abc");
    EXPECT_FALSE(file.reserve(std::size_t(1) << 60)) << "no disk has that";
}

}  // namespace
}  // namespace livetet::hdf5
