#include "apps/commands/man_pages.hpp"

#include <gtest/gtest.h>

#include <set>

#include "support/program.hpp"

namespace livetet {
namespace {

TEST(ManPages, TextHoldsNothingThatRoffTakesForARequest) {
    EXPECT_EQ(roff_text(".msh or \\n"), "\\&.msh or \\en");
    EXPECT_EQ(roff_text("'a' ^ ~"), "\\(aqa\\(aq \\(ha \\(ti");
    EXPECT_EQ(roff_text("one\ntwo"), "one two");
}

TEST(ManPages, OptionsKeepTheirDashesAndWordsTheirHyphens) {
    EXPECT_EQ(roff_text("--for -5 (-o) re-read"), "\\-\\-for \\-5 (\\-o) re-read");
    EXPECT_EQ(roff_text("run `livetet track -o`"), "run \\fBlivetet track \\-o\\fP");
    EXPECT_EQ(roff_text("a ` alone-some"), "a \\(ga alone\\-some");
}

TEST(ManPages, StateOptionsValuesAndDefaults) {
    CLI::App app{"Livetet: a test. More of it"};
    CLI::App* command = app.add_subcommand("mesh", "Meshes an image");
    int levels = 3;
    std::string input;
    command->add_option("-l,--levels", levels, "number of levels")
        ->check(CLI::Range(0, 12))
        ->capture_default_str();
    command->add_option("input", input, "the image")->required();
    command->add_subcommand("inner", "Does more");
    const auto pages = man_pages(app);
    ASSERT_EQ(pages.size(), 2u);
    const std::string& page = pages.at("livetet-mesh.1");
    for (const char* part :
         {".TP\n\\fB\\-l\\fP, \\fB\\-\\-levels\\fP  \\fIwhole number, 0 to 12\\fP\n"
          "number of levels; default: \\fB3\\fP\n",
          ".TP\n\\fIinput\\fP  \\fItext\\fP\nthe image; required\n",
          "\\fBlivetet mesh\\fP [\\fIoptions\\fP] \\fIinput\\fP \\fIcommand\\fP ...\n",
          ".SS livetet mesh inner\nDoes more.\n"})
        EXPECT_NE(page.find(part), page.npos) << part << "\nnot in\n" << page;
    EXPECT_NE(pages.at("livetet.1").find(".SH NAME\nlivetet \\- a test\n"), std::string::npos);
}

TEST(ManPages, OfTheProgramPassGroffWithoutAWarning) {
    const test::Folder folder;
    const test::Outcome written = test::livetet(folder, "reference --man man");
    ASSERT_EQ(written.status, 0) << written.err;
    if (test::run(folder, "groff --version").status != 0)
        GTEST_SKIP() << "groff is not installed: the manual pages are not formatted";
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "man")) {
        const std::string name = entry.path().filename().string();
        names.insert(name);
        const test::Outcome formatted =
            test::run(folder, "groff -ww -man -Tascii -P-c 'man/" + name + "'");
        EXPECT_EQ(formatted.status, 0) << name;
        EXPECT_EQ(formatted.err, "") << name;
        EXPECT_GT(formatted.out.size(), 500u) << name;
    }
    EXPECT_TRUE(names.contains("livetet.1"));
    const std::string help = test::livetet(folder, "--help").out;
    for (const char* command : {"solve", "track", "bench", "reference"}) {
        EXPECT_NE(help.find(command), help.npos);
        EXPECT_TRUE(names.contains(std::string("livetet-") + command + ".1")) << command;
    }
}

}  // namespace
}  // namespace livetet
