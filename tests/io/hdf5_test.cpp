#include "io/hdf5.hpp"

#include "base/file.hpp"
#include "files.hpp"

namespace livetet::hdf5 {
namespace {

using namespace testing_files;

/// `bytes` with each 4-byte little-endian `from` that `number`s among them (from 0) made `to`.
std::string with_number(std::string bytes, std::uint32_t from, std::uint32_t to, int number) {
    const auto text = [](std::uint32_t x) { return std::string(reinterpret_cast<const char*>(&x), sizeof x); };
    std::size_t at = bytes.find(text(from));
    for (; number > 0 && at != std::string::npos; --number) at = bytes.find(text(from), at + 1);
    return at == std::string::npos ? std::string() : bytes.replace(at, 4, text(to));
}

TEST(Hdf5, ATextThatIsLongerThanWhatIsStoredOfItIsRefused) {
    const auto path = fresh_folder() / "t.h5";
    constexpr std::uint32_t size = 54321;  // once as the type's size, once as the storage's
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
            refused += !error_of([&] { (void)File::open(write_bytes(path, bad)).read_text("text"); }).empty();
        }
    EXPECT_GE(refused, 4);
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
