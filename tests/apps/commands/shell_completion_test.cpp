#include "apps/commands/shell_completion.hpp"

#include <gtest/gtest.h>

#include "support/program.hpp"

namespace livetet {
namespace {

/// The program's completions in `folder`.
class ShellCompletion : public testing::Test {
  protected:
    ShellCompletion() {
        const test::Outcome written = test::livetet(folder_, "reference --completions .");
        EXPECT_EQ(written.status, 0) << written.err;
    }
    /// What bash offers for the last of the words, one a line, between blanks: " a b ".
    std::string offered(const std::string& words) {
        const test::Outcome outcome = test::run(
            folder_, "bash -c 'source ./livetet && complete -p livetet >/dev/null && COMP_WORDS=(" +
                         words +
                         ") && COMP_CWORD=$((${#COMP_WORDS[@]} - 1)) && _livetet; "
                         "printf \" %s\" \"${COMPREPLY[@]}\"'");
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_EQ(outcome.err, "");
        return outcome.out + " ";
    }
    test::Folder folder_;
};

TEST_F(ShellCompletion, BashCompletesSubCommands) {
    EXPECT_EQ(offered("livetet so"), " solve ");
    EXPECT_NE(offered("livetet \"\"").find(" track "), std::string::npos);
    EXPECT_EQ(offered("livetet calibrate pi"), " pivot ");
    EXPECT_EQ(offered("livetet bench scal"), " scaling ");
    EXPECT_EQ(offered("livetet bench track"), "  ");
}

TEST_F(ShellCompletion, BashCompletesOptionsOfTheirCommand) {
    EXPECT_EQ(offered("livetet --vers"), " --version ");
    EXPECT_EQ(offered("livetet solve --rest"), " --restart ");
    EXPECT_EQ(offered("livetet calibrate pivot --to"), " --tool ");
    EXPECT_EQ(offered("livetet calibrate --to"), "  ");
    EXPECT_EQ(offered("livetet mesh a.nii --all"), " --all-parts ");
}

TEST_F(ShellCompletion, BashCompletesChoicesAndLeavesFilesToItself) {
    EXPECT_EQ(offered("livetet fiducials image.nii --shade \"\""), " bright dark ");
    EXPECT_EQ(offered("livetet fiducials image.nii --shade = d"), " dark ");
    EXPECT_EQ(offered("livetet fiducials image.nii --shade ="), " bright dark ");
    EXPECT_EQ(offered("livetet mesh -o s"), "  ");
    EXPECT_EQ(offered("livetet solve s"), "  ");
}

TEST_F(ShellCompletion, OfZshHasNoSyntaxError) {
    if (test::run(folder_, "zsh --version").status != 0)
        GTEST_SKIP() << "zsh is not installed: its completion is not loaded";
    const test::Outcome outcome = test::run(folder_, "zsh -n _livetet");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
}

TEST(ShellCompletionOfZsh, EscapesWhatWouldEndADescription) {
    CLI::App app;
    CLI::App* command = app.add_subcommand("mesh", "It's a mesh: of [one] image; more");
    std::string space, file;
    command->add_option("-s,--space", space, "axes [of it]; more")->check(CLI::IsMember({"ras"}));
    command->add_option("file", file, "the file");
    const std::string text = zsh_completion(app);
    for (const char* part :
         {"'mesh:It'\\''s a mesh\\: of \\[one\\] image'",
          "'(-s --space)-s[axes \\[of it\\]]:space:(ras)'",
          "'(-s --space)--space=[axes \\[of it\\]]:space:(ras)'", "':file:_files'"})
        EXPECT_NE(text.find(part), text.npos) << part << "\nnot in\n" << text;
}

}  // namespace
}  // namespace livetet
