// Every relative link of the documentation leads to a file, and to a heading where it names one.
#include "house/links.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "house/source_tree.hpp"

namespace livetet::house {
namespace {

namespace fs = std::filesystem;

TEST(Links, ThoseOfTheDocumentationResolve) {
    const auto root = tree_root();
    std::vector<fs::path> pages;
    for (const auto* folder : {"docs", "examples", "apps", "benchmarks"}) {
        if (!fs::is_directory(root / folder)) {
            continue;
        }
        for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
            if (entry.path().extension() == ".md") {
                pages.push_back(entry.path().lexically_relative(root));
            }
        }
    }
    for (const auto* page : {"README.md", "CONTRIBUTING.md", "CHANGELOG.md"}) {
        ASSERT_TRUE(fs::exists(root / page)) << page;
        pages.emplace_back(page);
    }
    const auto broken = broken_links(root, pages);
    EXPECT_TRUE(broken.empty()) << lines(broken);
}

TEST(Links, HeadingsAreNamedAsGitHubNamesThem) {
    EXPECT_EQ(
        anchors("# A first: `live` *heading*\n## Twice\n## Twice\n"
                "```\n# not one\n```\n<a id=\"own\"></a>\n### See [this](page.md), 2 x\n"),
        (std::set<std::string>{"a-first-live-heading", "twice", "twice-1", "own", "see-this-2-x"}));
}

TEST(Links, EveryKindOfLinkIsFoundAndNoneInCode) {
    EXPECT_EQ(link_targets("[a](one.md) ![b](two.png \"title\") `[c](code.md)`\n[d]: three.md\n"
                           "<img src=\"four.png\">\n```\n[e](code.md)\n```\n"),
              (std::vector<std::string>{"one.md", "two.png", "three.md", "four.png"}));
}

TEST(Links, BrokenOnesAreFound) {
    const auto folder = fs::path(testing::TempDir()) / "livetet_house_links";
    fs::remove_all(folder);
    fs::create_directories(folder / "docs");
    std::ofstream(folder / "docs" / "there.md") << "# Heading\n";
    std::ofstream(folder / "page.md")
        << "[a](docs/there.md) [b](docs/there.md#heading) [c](https://example.org/none) [d](#top)\n"
           "[e](docs/none.md) [f](docs/there.md#none) [g](#none)\n\n# Top\n";
    EXPECT_EQ(broken_links(folder, {"page.md"}),
              (std::vector<std::string>{"page.md: docs/none.md", "page.md: docs/there.md#none",
                                        "page.md: #none"}));
    fs::remove_all(folder);
}

}  // namespace
}  // namespace livetet::house
