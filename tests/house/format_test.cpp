// Every source file is as clang-format leaves it: one version, the one that apps/packages.txt
// names. It does not wrap comments, so long lines are looked for here.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string_view>

#include "house/source_tree.hpp"

namespace livetet::house {
namespace {

namespace fs = std::filesystem;

/// What clang-format would change in `files`; "" where they are as it leaves them.
std::string format_findings(const std::vector<fs::path>& files, const fs::path& folder) {
    const auto list = folder / "files.txt", output = folder / "output.txt";
    {
        std::ofstream stream(list);
        for (const auto& file : files) {
            stream << '"' << file.string() << "\"\n";
        }
    }
    const auto command = "xargs -P 2 -n 40 " LIVETET_CLANG_FORMAT " --dry-run --Werror <'" +
                         list.string() + "' >'" + output.string() + "' 2>&1";
    const int status = std::system(command.c_str());
    const auto text = read_text(output);
    return status == 0 ? text : "clang-format failed:\n" + text.substr(0, 4000);
}

/// Bytes of `text` that belong to raw strings.
std::vector<bool> in_raw_strings(std::string_view text) {
    std::vector<bool> raw(text.size(), false);
    for (auto at = text.find("R\""); at != text.npos; at = text.find("R\"", at)) {
        const auto open = text.find('(', at);
        const auto delimiter = text.substr(at + 2, open == text.npos ? 0 : open - at - 2);
        if (open == text.npos || delimiter.find_first_of(" )\\\"\n") != delimiter.npos) {
            at += 2;  // no raw string
            continue;
        }
        const auto closing = ")" + std::string(delimiter) + "\"";
        const auto close = std::min(text.find(closing, open), text.size() - closing.size());
        const auto end = close + closing.size();
        std::fill(raw.begin() + at, raw.begin() + end, true);
        at = end;
    }
    return raw;
}

/// "file:line" of each line over 100 columns that has no part in a raw string.
std::vector<std::string> long_lines(const std::string& file, std::string_view text) {
    std::vector<std::string> found;
    const auto raw = in_raw_strings(text);
    int line = 1;
    for (std::size_t begin = 0; begin < text.size(); ++line) {
        const auto end = std::min(text.find('\n', begin), text.size());
        const auto columns = std::count_if(text.begin() + begin, text.begin() + end, [](char c) {
            return (static_cast<unsigned char>(c) & 0xC0) != 0x80;  // starts a character of UTF-8
        });
        const bool is_raw =
            std::find(raw.begin() + begin, raw.begin() + end, true) != raw.begin() + end;
        if (columns > 100 && !is_raw) {
            found.push_back(file + ":" + std::to_string(line));
        }
        begin = end + 1;
    }
    return found;
}

class Format : public testing::Test {
  protected:
    Format() : folder_(fs::path(testing::TempDir()) / "livetet_house_format") {
        fs::remove_all(folder_);
        fs::create_directories(folder_);
    }
    ~Format() override { fs::remove_all(folder_); }

    fs::path folder_;
};

TEST_F(Format, EveryFileOfTheTreeIsFormatted) {
    std::vector<fs::path> files;
    for (const auto& [file, _] : read_sources(tree_root())) {
        files.push_back(tree_root() / file);
    }
    ASSERT_GT(files.size(), 400u);
    EXPECT_EQ(format_findings(files, folder_), "");
}

TEST_F(Format, AFileInAnotherStyleIsFound) {
    fs::copy_file(tree_root() / ".clang-format", folder_ / ".clang-format");
    std::ofstream(folder_ / "good.cpp") << "int main() { return 0; }\n";
    EXPECT_EQ(format_findings({folder_ / "good.cpp"}, folder_), "");
    std::ofstream(folder_ / "bad.cpp") << "int main()\n{\n  return 0;\n}\n";
    EXPECT_NE(format_findings({folder_ / "good.cpp", folder_ / "bad.cpp"}, folder_), "");
}

TEST(Columns, NoLineOutsideRawStringsHasMoreThan100) {
    std::vector<std::string> found;
    for (const auto& [file, text] : read_sources(tree_root())) {
        const auto of_file = long_lines(file, text);
        found.insert(found.end(), of_file.begin(), of_file.end());
    }
    EXPECT_TRUE(found.empty()) << lines(found);
}

TEST(Columns, ALongLineIsFound) {
    const std::string long_comment = "// " + std::string(98, 'x');
    EXPECT_EQ(long_lines("a.cpp", "int a;\n" + long_comment + "\nint b;\n"),
              std::vector<std::string>{"a.cpp:2"});
    EXPECT_TRUE(long_lines("a.cpp", long_comment.substr(1) + "\n").empty());
    EXPECT_TRUE(long_lines("a.cpp", "auto a = R\"x(\n" + long_comment + "\n)x\";\n").empty());
    std::string umlauts = "// ";
    for (int i = 0; i < 97; ++i) umlauts += "\u00e4";
    EXPECT_TRUE(long_lines("a.cpp", umlauts).empty());
}

}  // namespace
}  // namespace livetet::house
