#include <gtest/gtest.h>

#include "support/program.hpp"

namespace livetet {
namespace {

#ifdef LIVETET_IMAGES
constexpr const char* reference_pages[] = {
    "commands.md",       "scene.md",          "study.md",          "script.md",
    "scene.schema.json", "study.schema.json", "script.schema.json"};

TEST(Reference, ThePagesInDocsAreWhatTheProgramWrites) {
    const test::Folder folder;
    const test::Outcome outcome = test::livetet(folder, "reference -o pages");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const std::filesystem::path docs =
        std::filesystem::path(LIVETET_TESTS).parent_path() / "docs/reference";
    for (const char* page : reference_pages) {
        const std::string written = test::text_of(folder / "pages" / page);
        EXPECT_GT(written.size(), 1000u) << page;
        EXPECT_TRUE(written == test::text_of(docs / page))
            << "docs/reference/" << page
            << " is not current; renew it by: livetet reference -o docs/reference";
    }
}

TEST(Reference, DoesNotDependOnTheTerminal) {
    const test::Folder folder;
    ASSERT_EQ(test::livetet(folder, "reference -o wide", "COLUMNS=300 LC_ALL=C.UTF-8").status, 0);
    ASSERT_EQ(test::livetet(folder, "reference -o narrow", "COLUMNS=20 LC_ALL=C").status, 0);
    for (const char* page : reference_pages)
        EXPECT_EQ(test::text_of(folder / "wide" / page), test::text_of(folder / "narrow" / page));
}
#endif

TEST(Reference, NeedsAFolderToWriteTo) {
    const test::Folder folder;
    test::expect_refused(test::livetet(folder, "reference"),
                         {"reference: nothing to write, expected a folder"});
}

}  // namespace
}  // namespace livetet
