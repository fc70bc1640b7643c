// The trials of `livetet bench stability`, and what judges them. Time is not: no frame here has a
// deadline to miss.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "apps/bench/stability_cases.hpp"
#include "meshing/quality.hpp"
#include "support/program.hpp"

namespace livetet {
namespace {

using nlohmann::json;
using test::expect_refused;
using test::Folder;
using test::livetet;
using test::text_of;

json cells_of(const Folder& folder, const std::string& options, int cells = 2) {
    const auto outcome = livetet(
        folder, fmt::format("bench stability --cells {} --noise-frames 1000 --budget 1e6 --json "
                            "s.json --csv s.csv {}",
                            cells, options));
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    return json::parse(text_of(folder / "s.json"));
}

/// Whether a cell has a known limit, which only fibres on moving grids have here.
bool is_excused(const json& c) {
    if (c.at("known_limit").get<std::string>().empty()) return false;
    EXPECT_EQ(c.at("strain"), "holzapfel_gasser_ogden") << c.dump();
    EXPECT_TRUE(c.at("stepped_as").get<std::string>().find("hexahedra") != std::string::npos)
        << c.dump();
    return true;
}

TEST(Stability, WhatAnythingShouldStandPassesInEveryModelAndScheme) {
    const Folder folder;
    const json cells = cells_of(folder, "--only \"ratio 0.3\"");
    ASSERT_EQ(cells.size(), 7u * 6 * 4);
    for (const json& c : cells) {
        if (is_excused(c)) continue;
        EXPECT_EQ(c.at("verdict"), "pass") << c.dump();
        EXPECT_GT(c.at("steps"), 10);
        EXPECT_LT(c.at("left"), 0.02);
    }
    const std::string csv = text_of(folder / "s.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 168);
}

/// In frames of one Newton iteration, 62 % of the press kept swinging in the first of these bodies,
/// and the second gained energy.
TEST(Stability, NearlyIncompressibleBodiesComeToRestInNewmarksFrames) {
    const Folder folder;
    for (const char* way : {"track P2", "track hexahedra Q1-P0"}) {
        const json cells = cells_of(
            folder, fmt::format("--only 0.4999 --column \"{}, mooney_rivlin, newmark\"", way));
        ASSERT_EQ(cells.size(), 1u);
        EXPECT_EQ(cells[0].at("verdict"), "pass") << cells[0].dump();
    }
}

TEST(Stability, ABodyThatNothingHoldsInARotationIsRefusedWhereItIsStatic) {
    const Folder folder;
    for (const json& c : cells_of(folder, "--only \"a line\"")) {
        if (is_excused(c)) continue;
        const bool is_static = c.at("scheme") == "static";
        EXPECT_EQ(c.at("verdict"), is_static ? "refused" : "pass") << c.dump();
        EXPECT_EQ(c.at("reason").get<std::string>().find("rotation about") != std::string::npos,
                  is_static);
    }
}

/// The rules can be broken: Green's strain does not bring inverted tets back, and the cell says
/// which rule, and why.
TEST(Stability, WhatDoesNotComeHomeFailsWithItsRuleAndReason) {
    const Folder folder;
    int failed = 0;
    for (const json& c : cells_of(folder, "--only everted")) {
        if (c.at("strain") == "linear") {
            EXPECT_EQ(c.at("verdict"), "pass") << c.dump();
        }
        const bool is_of_hexahedra =
            c.at("stepped_as").get<std::string>().find("hexahedra") != std::string::npos;
        if (c.at("strain") != "green" || is_of_hexahedra) continue;
        EXPECT_EQ(c.at("verdict"), "fail") << c.dump();
        const std::string reason = c.at("reason");
        EXPECT_TRUE(reason.starts_with("rest:") || reason.starts_with("energy:") ||
                    reason.starts_with("solved:"))
            << reason;
        EXPECT_NE(c.at("known_limit").get<std::string>().find("Green's"), std::string::npos);
        ++failed;
    }
    EXPECT_EQ(failed, 12);
}

TEST(Stability, DeepPressesOfFineBodiesAreTriedAsStaticSolvesAlone) {
    const Folder folder;
    const json cells = cells_of(folder, "--only deep --column track");
    ASSERT_EQ(cells.size(), 4u * 6 * 4);
    for (const json& c : cells) EXPECT_EQ(c.at("verdict"), "left out") << c.dump();
}

/// On fewer tets than the benchmark takes.
TEST(Stability, ADeepPressOfTenNodeTetsIsSolvedInOneStepAndComesHome) {
    const Folder folder;
    const json cells =
        cells_of(folder, "--fine-cells 7 --only deep --column \"solve, neohookean, static\"");
    ASSERT_EQ(cells.size(), 1u);
    EXPECT_EQ(cells[0].at("verdict"), "pass") << cells[0].dump();
    EXPECT_EQ(cells[0].at("steps"), 1 + 5 + 2);  // pressed, held, let go
    EXPECT_GT(cells[0].at("linearisations"), 4);
    EXPECT_LE(cells[0].at("linearisations"), 60);
}

/// `stability_mesh` itself refuses an inverted tet.
TEST(Stability, TheMeshesAreAsExtremeAsTheySay) {
    for (const StabilityCase& c : stability_cases()) {
        if (c.min_dihedral_deg == 0 && c.edge_ratio == 1) continue;
        const MeshQuality q = measure_quality(stability_mesh(c, 4).levels.front());
        if (c.min_dihedral_deg > 0) {
            EXPECT_NEAR(q.min_dihedral_deg, c.min_dihedral_deg, 0.011 * c.min_dihedral_deg)
                << c.value;
        } else {
            EXPECT_NEAR(q.min_edge_m, 0.025 / c.edge_ratio, 1e-6 * q.min_edge_m) << c.value;
        }
        EXPECT_NEAR(q.volume_m3, 0.002, 1e-9);
    }
}

TEST(Stability, ACaseThatThereIsNotIsRefused) {
    const Folder folder;
    expect_refused(livetet(folder, "bench stability --only nothing"),
                   {"--only nothing", "no case has this in its name"});
    expect_refused(livetet(folder, "bench stability --column nothing"),
                   {"--column nothing", "no column has this in its name", "generalized_alpha"});
}

TEST(Stability, FramesOfEveryModelAndElementAreTheLiveSolvers) {
    const Folder folder;
    const json cells = cells_of(folder, "--only \"ratio 0.45\" --column static");
    ASSERT_EQ(cells.size(), 7u * 6);
    for (const json& c : cells) {
        const bool is_live =
            c.at("solver").get<std::string>().find("single precision") != std::string::npos;
        EXPECT_EQ(is_live, c.at("stepped_as").get<std::string>().starts_with("track")) << c.dump();
        EXPECT_EQ(c.at("verdict"), "pass") << c.dump();
    }
}

/// A slit from below under the pressed patch, in tets and in a grid: what is left of the section
/// carries the press, and comes home.
TEST(Stability, CutBodiesStandThePress) {
    const Folder folder;
    const json cells = cells_of(folder, "--only \"cut, share\" --column hookean", 4);
    ASSERT_EQ(cells.size(), 2u * 7 * 4);
    for (const json& c : cells) EXPECT_EQ(c.at("verdict"), "pass") << c.dump();
}

TEST(Stability, LiveFramesAreNoWorseThanPlainOnes) {
    const Folder folder;
    const auto outcome = livetet(folder,
                                 "bench stability --cells 2 --noise-frames 1000 --budget 1e6 "
                                 "--plain --only \"time step\" --column \"P2, neohookean\"");
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    EXPECT_NE(outcome.out.find("0 of 20 live cells fail where their plain counterparts pass"),
              std::string::npos)
        << outcome.out;
}

TEST(Stability, ColumnsCanBeChosen) {
    const Folder folder;
    const json cells = cells_of(folder, "--only \"ratio 0.3\" --column \"track, neohookean, e\"");
    ASSERT_EQ(cells.size(), 1u);
    EXPECT_EQ(cells[0].at("stepped_as"), "track");
    EXPECT_EQ(cells[0].at("strain"), "neohookean");
    EXPECT_EQ(cells[0].at("scheme"), "euler");
}

}  // namespace
}  // namespace livetet
