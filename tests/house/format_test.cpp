// Every source file is as clang-format leaves it: one version, the one that apps/packages.txt
// names.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

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

}  // namespace
}  // namespace livetet::house
