// No file includes against the arrows of the house, and none includes itself by way of others.
#include "house/includes.hpp"

#include <gtest/gtest.h>

namespace livetet::house {
namespace {

const std::vector<std::string> libraries{"src", "solvers", "io", "meshing", "apps"};

const std::string made_up_cmake = R"(
livetet_apps_library(scene IMAGES mesh_input)
livetet_apps_library(live LINKS scene)
livetet_apps_library(report LINKS live)
)";

TEST(Includes, ThoseOfTheTreeFollowTheArrows) {
    const auto files = read_sources(tree_root(), libraries);
    ASSERT_GT(files.size(), 200u);
    const auto wrong =
        wrong_includes(files, arrows(read_text(tree_root() / "apps" / "CMakeLists.txt")));
    EXPECT_TRUE(wrong.empty()) << lines(wrong);
}

TEST(Includes, NoFilesOfTheTreeIncludeEachOther) {
    const auto circles = include_circles(read_sources(tree_root(), libraries));
    EXPECT_TRUE(circles.empty()) << lines(circles);
}

TEST(Includes, ThoseOfTestsExamplesAndBenchmarksFollowTheirArrows) {
    const auto files = read_sources(tree_root(), {"tests", "examples", "benchmarks"});
    ASSERT_GT(files.size(), 200u);
    const auto wrong = wrong_includes_of_users(files);
    EXPECT_TRUE(wrong.empty()) << lines(wrong);
}

TEST(Includes, ATestThatReachesBeyondWhatItTestsIsFound) {
    const SourceFiles files{
        {"tests/src/mesh/a_test.cpp", "#include \"solvers/linear/transfer.hpp\"\n"},
        {"tests/io/b_test.cpp", "#include \"meshing/quality.hpp\"\n"},
        {"examples/c.cpp", "#include \"mesh/tet_mesh.hpp\"\n"},
        {"benchmarks/d.cpp", "#include \"io/text.hpp\"\n"},
        {"tests/new/e.cpp", ""},
    };
    EXPECT_EQ(wrong_includes_of_users(files).size(), files.size());
    EXPECT_TRUE(
        wrong_includes_of_users({{"tests/solvers/f_test.cpp",
                                  "#include \"files.hpp\"\n#include \"mesh/shapes.hpp\"\n"}})
            .empty());
}

TEST(Includes, AnArrowAgainstTheHouseIsFound) {
    const SourceFiles files{
        {"src/mesh/a.cpp", "#include \"image/image.hpp\"\n"},
        {"src/mesh/b.cpp", "#include <petscvec.h>\n"},
        {"src/config/c.hpp", "#include \"io/text.hpp\"\n"},
        {"solvers/parallel/d.cpp", "#include \"solvers/linear/transfer.hpp\"\n"},
        {"io/e.cpp", "#include \"meshing/quality.hpp\"\n"},
        {"io/openigtlink/f.cpp", "#include \"io/text.hpp\"\n"},
        {"apps/scene/g.cpp", "#include \"apps/live/frame_loop.hpp\"\n"},
        {"apps/new/h.cpp", ""},
    };
    EXPECT_EQ(wrong_includes(files, arrows(made_up_cmake)).size(), files.size());
}

TEST(Includes, ThoseAlongTheArrowsAreAllowed) {
    const SourceFiles files{
        {"src/image/a.cpp",
         "#include <vector>\n#include \"image/b.hpp\"\n#include \"mesh/c.hpp\"\n"},
        {"src/mechanics/materials/b.cpp", "#include \"mechanics/material.hpp\"\n"},
        {"src/base/petsc.hpp", "#include <petscksp.h>\n"},
        {"solvers/nonlinear/d.cpp", "#include <petscsnes.h>\n#include \"solvers/linear/e.hpp\"\n"},
        {"io/e.cpp", "#include \"io/openigtlink/codec.hpp\"\n"},
        {"apps/report/f.cpp", "#include \"apps/scene/scene.hpp\"\n#include \"io/text.hpp\"\n"},
    };
    const auto wrong = wrong_includes(files, arrows(made_up_cmake));
    EXPECT_TRUE(wrong.empty()) << lines(wrong);
}

TEST(Includes, AFolderLinksOnlyThoseBeforeIt) {
    EXPECT_THROW(arrows("livetet_apps_library(scene LINKS live)\nlivetet_apps_library(live)\n"),
                 std::runtime_error);
}

TEST(Includes, ACircleIsFoundOnce) {
    const SourceFiles files{{"src/mesh/a.hpp", "#include \"mesh/b.hpp\"\n"},
                            {"src/mesh/b.hpp", "#include \"mesh/c.hpp\"\n"},
                            {"src/mesh/c.hpp", "#include \"mesh/a.hpp\"\n"}};
    EXPECT_EQ(include_circles(files),
              std::vector<std::string>{
                  "src/mesh/a.hpp -> src/mesh/b.hpp -> src/mesh/c.hpp -> src/mesh/a.hpp"});
}

}  // namespace
}  // namespace livetet::house
