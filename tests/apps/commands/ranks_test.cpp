#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/commands/last_displacement.hpp"
#include "apps/commands/tracked_block.hpp"
#include "io/hierarchy_file.hpp"
#include "io/points_csv.hpp"
#include "io/result_file.hpp"
#include "support/mpirun.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

using test::Folder;
using test::livetet;
using test::mpirun;
using test::text_of;
using test::write_text;

/// A beam of 1,500 tets, which have work for seven ranks: of eight, one has none.
void write_beam(const Folder& folder) {
    write_hierarchy(folder / "beam.h5", make_hierarchy({test::block({10, 5, 5}, {0.2, 0.1, 0.1}),
                                                        test::block({5, 2, 2}, {0.2, 0.1, 0.1})},
                                                       "a beam"));
}

const std::string held_beam =
    "mesh: {file: beam.h5}\nfix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]\n"
    "solver: {newton_tolerance: 1e-11, relative_tolerance: 1e-7}\n";
const std::string pressed =
    "drive: [{sphere_mm: [100, 50, 100, 25], where: surface, displacement_mm: [0, 2, -12]}]\n"
    "materials: [{young_Pa: 5000, poisson: 0.45}]\n";
const std::string swinging =
    "gravity_m_per_s2: [0, 0, -9.81]\nmaterials: [{young_Pa: 50000, poisson: 0.495}]\n";

/// The largest distance between two fields, by the largest vector of the first.
double apart(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
    EXPECT_EQ(a.size(), b.size());
    double distance = 0, largest = 0;
    for (std::size_t n = 0; n < a.size(); ++n) {
        distance = std::max(distance, (a[n] - b[n]).norm());
        largest = std::max(largest, a[n].norm());
    }
    EXPECT_GT(largest, 1e-3);
    return distance / largest;
}

TEST(Ranks, OneThreeAndEightAgreeTo1em8InEveryForm) {
    const Folder folder;
    write_beam(folder);
    const std::string dynamic = swinging + "time: {step_s: 0.01, duration_s: 0.03, scheme: ";
    const std::pair<const char*, std::string> forms[] = {
        {"P2, static", pressed + "elements: P2\n"},
        {"mixed, static", pressed + "formulation: mixed\n"},
        {"finite strain, static", pressed + "strain: neohookean\nformulation: displacement\n"},
        {"P1, dynamic", dynamic + "newmark}\nformulation: displacement\n"},
        {"P2, mixed, dynamic", dynamic + "generalized_alpha}\nelements: P2\n"},
    };
    for (const auto& [name, form] : forms) {
        write_text(folder / "scene.yaml", held_beam + form);
        std::vector<Vector3> of_one;
        for (const int ranks : {1, 3, 8}) {
            const auto outcome =
                livetet(folder, "solve scene.yaml --json told.json", mpirun(ranks));
            ASSERT_EQ(outcome.status, 0) << name << outcome.err;
            EXPECT_EQ(nlohmann::json::parse(text_of(folder / "told.json"))["ranks"], ranks);
            const std::vector<Vector3> u = test::last_displacement(folder / "result.h5");
            if (ranks == 1)
                of_one = u;
            else
                EXPECT_LT(apart(of_one, u), 1e-8) << name << " on " << ranks << " ranks";
        }
    }
}

/// The last three numbers of each line but the first.
std::vector<double> last_columns(const std::string& csv) {
    std::vector<double> numbers;
    std::istringstream lines(csv);
    std::string line;
    std::getline(lines, line);
    while (std::getline(lines, line)) {
        std::vector<std::string> columns;
        std::istringstream row(line);
        for (std::string column; std::getline(row, column, ',');) columns.push_back(column);
        for (auto c = columns.end() - 3; c != columns.end(); ++c) numbers.push_back(std::stod(*c));
    }
    EXPECT_EQ(numbers.size(), 9u) << csv;
    return numbers;
}

/// Loads, soft supports, their forces, fields and probes, each from the rank that has the nodes.
TEST(Ranks, OneThreeAndEightWriteTheSame) {
    const Folder folder;
    write_beam(folder);
    write_points_csv(folder / "points.csv",
                     std::vector<NamedPoint>{{"Inside", {0.111, 0.052, 0.043}},
                                             {"Corner", {0.2, 0.1, 0.1}},
                                             {"Outside", {0.1, 0.05, 0.1005}}});
    const std::string scene =
        "mesh: {file: beam.h5}\nmaterials: [{young_Pa: 5000, poisson: 0.45}]\n"
        "fix: [{half_space_mm: [1, 0, 0, 1, 0, 0], stiffness_N_per_m: 2000}]\n"
        "drive: [{sphere_mm: [100, 50, 100, 25], where: surface, displacement_mm: [0, 2, -8]}]\n"
        "loads: [{half_space_mm: [199, 0, 0, -1, 0, 0], pressure_Pa: 20}, "
        "{sphere_mm: [150, 50, 0, 30], force_N: [0.02, 0, 0.01]}]\n"
        "gravity_m_per_s2: [0, 0, -2]\noutput: {fields: [reactions, von_mises]}\n"
        "probes: {points: points.csv, displacements: moved.csv}\n"
        "solver: {newton_tolerance: 1e-11, relative_tolerance: 1e-7}\n";
    for (const char* elements : {"P1", "P2"}) {
        write_text(folder / "scene.yaml", scene + "elements: " + elements + "\n");
        std::vector<double> of_one;
        for (const int ranks : {1, 3, 8}) {
            const auto outcome =
                livetet(folder, "solve scene.yaml --json told.json", mpirun(ranks));
            ASSERT_EQ(outcome.status, 0) << outcome.err;
            std::vector<double> written;
            const auto told = nlohmann::json::parse(text_of(folder / "told.json"));
            for (const char* set : {"fix[0]", "drive[0]"})
                for (const auto& number : told["reactions_N"][set])
                    written.push_back(number.get<double>());
            const ResultReader result(folder / "result.h5");
            for (const auto& [field, components] :
                 {std::pair{"reactions", 3}, std::pair{"von_mises", 1}})
                for (const double number : result.field(field, 0, components))
                    written.push_back(number);
            for (const double u : last_columns(text_of(folder / "moved.csv"))) written.push_back(u);
            EXPECT_EQ(told["nodes"], elements == std::string("P1") ? 396 : 2541);
            if (ranks == 1) {
                of_one = written;
                continue;
            }
            ASSERT_EQ(written.size(), of_one.size());
            for (std::size_t i = 0; i < written.size(); ++i)
                EXPECT_NEAR(written[i], of_one[i], 1e-6 * (1 + std::abs(of_one[i])))
                    << i << " on " << ranks << " ranks, " << elements;
        }
    }
}

/// Peak memory of the largest rank, less what the program takes for nothing, over its part of what
/// one rank takes. On a mesh of this size a layer of tets that two ranks have is much of a rank's;
/// `bench scaling` judges larger ones.
TEST(Ranks, TheirMemoryFallsAsTheirNumberRises) {
    const Folder folder;
    write_beam(folder);
    const auto peak_of = [&](int ranks, int refine) {
        std::string scene = held_beam + pressed + "strain: linear\noutput: {file: none}\n";
        scene.replace(scene.find("beam.h5"), 7, fmt::format("beam.h5, refine: {}", refine));
        write_text(folder / "scene.yaml", scene);
        EXPECT_EQ(livetet(folder, "solve scene.yaml --json told.json", mpirun(ranks)).status, 0);
        const auto told = nlohmann::json::parse(text_of(folder / "told.json"));
        return told["peak_bytes_most"].get<double>();
    };
    const double of_one = peak_of(1, 2) - peak_of(1, 0);
    for (const int ranks : {2, 4, 8}) {
        const double share = (peak_of(ranks, 2) - peak_of(ranks, 0)) * ranks / of_one;
        std::printf("%d ranks: %.2f\n", ranks, share);
        EXPECT_LT(share, 1.75) << ranks;
    }
}

/// A mesh as it is in the file, of which no rank holds more than a part.
TEST(Ranks, TheirMemoryFallsWithAFilesMesh) {
    const Folder folder;
    const Vector3 size(0.2, 0.1, 0.1);
    write_beam(folder);
    write_hierarchy(folder / "large.h5",
                    make_hierarchy({test::block({52, 26, 26}, size),
                                    test::block({26, 13, 13}, size), test::block({10, 5, 5}, size)},
                                   "a beam"));
    const auto peak_of = [&](int ranks, const std::string& mesh) {
        std::string scene = held_beam + pressed + "strain: linear\noutput: {file: none}\n";
        scene.replace(scene.find("beam.h5"), 7, mesh);
        write_text(folder / "scene.yaml", scene);
        EXPECT_EQ(livetet(folder, "solve scene.yaml --json told.json", mpirun(ranks)).status, 0);
        const auto told = nlohmann::json::parse(text_of(folder / "told.json"));
        return told["peak_bytes_most"].get<double>();
    };
    const double of_one = peak_of(1, "large.h5") - peak_of(1, "beam.h5");
    for (const int ranks : {2, 8}) {
        const double share = (peak_of(ranks, "large.h5") - peak_of(ranks, "beam.h5")) * ranks;
        std::printf("%d ranks: %.2f\n", ranks, share / of_one);
        EXPECT_LT(share, 2 * of_one) << ranks;
    }
}

/// What each rank finds in its rows, and what they find together, ends all of them with one line.
TEST(Ranks, WhatIsWrongWithAMeshIsOneLine) {
    const Folder folder;
    const auto refused = [&](auto&& damage, const std::string& text) {
        MeshHierarchy beam = make_hierarchy(
            {test::block({10, 5, 5}, {0.2, 0.1, 0.1}), test::block({5, 2, 2}, {0.2, 0.1, 0.1})},
            "a beam");
        damage(beam);
        write_hierarchy(folder / "beam.h5", beam);
        write_text(folder / "scene.yaml", held_beam + pressed);
        for (const int ranks : {1, 3}) {
            const auto outcome = livetet(folder, "solve scene.yaml", mpirun(ranks));
            EXPECT_EQ(outcome.status, 2) << outcome.err;
            std::istringstream lines(outcome.err);
            std::string line, found;
            int of_livetet = 0;
            while (std::getline(lines, line))
                if (line.starts_with("livetet: ")) {
                    ++of_livetet;
                    found = line;
                }
            EXPECT_EQ(of_livetet, 1) << outcome.err;
            EXPECT_NE(found.find(text), std::string::npos) << ranks << " ranks: " << outcome.err;
            EXPECT_FALSE(std::filesystem::exists(folder / "result.h5"));
        }
    };
    const auto last_tet = [](MeshHierarchy& h) -> Tet& { return h.levels[0].tets.back(); };
    refused([&](MeshHierarchy& h) { std::swap(last_tet(h)[0], last_tet(h)[1]); },
            ": tet 1499 at (");
    refused([&](MeshHierarchy& h) { last_tet(h)[2] = 396; },
            "beam.h5: levels/0: tet 1499 names node 396, expected 0 to 395");
    refused([&](MeshHierarchy& h) { h.levels[1].nodes.back().x() = std::nan(""); },
            "beam.h5: levels/1: node 53 has a coordinate that is not finite");
    refused(
        [&](MeshHierarchy& h) {
            h.levels[0].nodes.emplace_back(1, 1, 1);
            BarycentricMap& t = h.transfers[0];
            t.nodes.push_back(t.nodes.back());
            t.weights.push_back(t.weights.back());
            t.distance.push_back(0);
        },
        ": node 396 belongs to no tet");
    refused(
        [&](MeshHierarchy& h) {
            h.levels[0].regions = {1, 2};
        },
        "beam.h5: levels/0: 2 region labels for 1500 tets");
    refused(
        [&](MeshHierarchy& h) {
            h.levels[0].node_sets["end"] = {3, 396};
        },
        "beam.h5: levels/0/node_sets/end: names node 396");
    refused([&](MeshHierarchy& h) { h.transfers[0].weights.back()[0] = 7; },
            "beam.h5: transfers/0/weights: row 395 is 7");
    refused([&](MeshHierarchy& h) { h.transfers[0].nodes.pop_back(); },
            "beam.h5: transfers/0: has 395 nodes, 396 weights");
    refused([&](MeshHierarchy& h) { std::swap(h.levels[0], h.levels[1]); }, "transfers/0");
}

/// A row of what `explain --ranks` estimates.
struct ForetoldRow {
    int ranks = 0;
    double tets = 0, megabytes = 0;
};

std::vector<ForetoldRow> foretold(const std::string& out) {
    std::istringstream table(out.substr(out.find("tets each")));
    std::vector<ForetoldRow> rows;
    std::string line;
    std::getline(table, line);
    for (ForetoldRow row; std::getline(table, line) &&
                          std::istringstream(line) >> row.ranks >> row.tets >> row.megabytes;)
        rows.push_back(row);
    return rows;
}

/// What `explain --ranks` estimates against what a solve takes.
TEST(Ranks, TheirMemoryIsForetold) {
    const Folder folder;
    write_beam(folder);
    std::string scene = held_beam + pressed + "strain: linear\noutput: {file: none}\n";
    scene.replace(scene.find("beam.h5"), 7, "beam.h5, refine: 2");
    write_text(folder / "scene.yaml", scene);
    const auto told = livetet(folder, "explain scene.yaml --ranks 1,4,64");
    ASSERT_EQ(told.status, 0) << told.err;
    EXPECT_NE(told.out.find("more ranks than pay"), std::string::npos) << told.out;
    const std::vector<ForetoldRow> rows = foretold(told.out);
    ASSERT_GE(rows.size(), 2U);
    for (std::size_t k = 0; k < 2; ++k) {
        const int ranks = k == 0 ? 1 : 4;
        EXPECT_EQ(rows[k].ranks, ranks);
        EXPECT_EQ(rows[k].tets, 64 * 1500 / ranks);
        ASSERT_EQ(livetet(folder, "solve scene.yaml --json told.json", mpirun(ranks)).status, 0);
        const auto run = nlohmann::json::parse(text_of(folder / "told.json"));
        const double taken = run["peak_bytes_most"].get<double>() / 1e6;
        EXPECT_NEAR(rows[k].megabytes, taken, 0.25 * taken) << ranks;
    }
}

/// A solver without levels, of a mesh that ranks refine: only the finest is listed.
TEST(Ranks, TheirMemoryIsForetoldWithoutMultigrid) {
    const Folder folder;
    write_beam(folder);
    std::string scene = held_beam + pressed + "elements: P2\n";
    scene.replace(scene.find("beam.h5"), 7, "beam.h5, refine: 1");
    scene.replace(scene.find("solver: {"), 9, "solver: {kind: gamg, ");
    write_text(folder / "scene.yaml", scene);
    const auto told = livetet(folder, "explain scene.yaml --ranks 1,4");
    ASSERT_EQ(told.status, 0) << told.err;
    const std::vector<ForetoldRow> rows = foretold(told.out);
    ASSERT_GE(rows.size(), 2U);
    for (std::size_t k = 0; k < 2; ++k) {
        EXPECT_EQ(rows[k].ranks, k == 0 ? 1 : 4);
        EXPECT_GT(rows[k].megabytes, 57);
        EXPECT_LT(rows[k].megabytes, 400);
    }
}

/// A tracked blade cuts no ten-node tetrahedra in the mixed form, on any number of ranks.
TEST(Ranks, ASceneWithABladeIsRefusedAsOnOne) {
    test::Tracked block;
    block.set_track("tools: [{tool: Scalpel, blade_mm: [0, -70, 0, 0, 70, 0]}]");
    write_text(block.folder / "scene.yaml",
               read_text_file(block.folder / "scene.yaml") + "elements: P2\nformulation: mixed\n");
    const auto one = livetet(block.folder, "solve scene.yaml"),
               three = livetet(block.folder, "solve scene.yaml", mpirun(3));
    EXPECT_EQ(one.status, 2) << one.err;
    EXPECT_EQ(three.status, 2) << three.err;
    const std::string line = one.err.substr(0, one.err.find('\n'));
    EXPECT_NE(line.find("expected P1"), std::string::npos) << line;
    EXPECT_NE(three.err.find(line), std::string::npos) << line << "\n" << three.err;
}

/// Faces of a rank's part towards other ranks are not the surface.
TEST(Ranks, APressureInsideTheBodyIsRefused) {
    const Folder folder;
    write_beam(folder);
    write_text(folder / "scene.yaml",
               held_beam +
                   "materials: [{young_Pa: 5000, poisson: 0.45}]\n"
                   "loads: [{box_mm: [30, 30, 30, 170, 70, 70], pressure_Pa: 20}]\n");
    for (const int ranks : {1, 4}) {
        const auto outcome = livetet(folder, "solve scene.yaml", mpirun(ranks));
        EXPECT_NE(outcome.status, 0) << ranks;
        EXPECT_NE(outcome.err.find("loads[0] selects no whole triangle of the surface"),
                  std::string::npos)
            << outcome.err;
    }
}

/// Two ranks of a build with PETSc's 64-bit indices.
TEST(Ranks, WithWideIndicesFindTheSame) {
    const char* wide = std::getenv("LIVETET_WIDE");
    if (!wide) GTEST_SKIP() << "LIVETET_WIDE names no program with 64-bit indices";
    const Folder folder;
    write_beam(folder);
    const std::string refined =
        "mesh: {file: beam.h5, refine: 1}" + held_beam.substr(held_beam.find('\n'));
    for (const std::string& scene :
         {refined + pressed + "output: {fields: [von_mises]}\n",
          held_beam + pressed + "elements: P2\nformulation: mixed\n",
          held_beam + swinging + "time: {step_s: 0.01, duration_s: 0.02, scheme: newmark}\n"}) {
        write_text(folder / "scene.yaml", scene);
        ASSERT_EQ(livetet(folder, "solve scene.yaml", mpirun(2)).status, 0) << scene;
        const std::vector<Vector3> expected = test::last_displacement(folder / "result.h5");
        const auto outcome = test::run(folder, mpirun(2) + " '" + wide + "' solve scene.yaml");
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_LT(apart(expected, test::last_displacement(folder / "result.h5")), 1e-8) << scene;
    }
}

TEST(Ranks, MoreOfThemThanTetsAreNoFault) {
    const Folder folder;
    write_hierarchy(folder / "beam.h5",
                    make_hierarchy({test::block({1, 1, 1}, {0.2, 0.1, 0.1})}, "a box"));
    for (const char* form : {"", "elements: P2\n", "formulation: mixed\n"}) {
        write_text(folder / "scene.yaml",
                   held_beam + swinging + "strain: linear\noutput: {fields: [stress]}\n" + form);
        ASSERT_EQ(livetet(folder, "solve scene.yaml").status, 0);
        const std::vector<Vector3> of_one = test::last_displacement(folder / "result.h5");
        const auto outcome = livetet(folder, "solve scene.yaml", mpirun(8));
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_LT(apart(of_one, test::last_displacement(folder / "result.h5")), 1e-8) << form;
    }
}

TEST(Ranks, OneThatIsKilledEndsAllAndLeavesTheOlderResult) {
    const Folder folder;
    write_beam(folder);
    const std::string scene = held_beam + swinging + "time: {step_s: 0.01, scheme: newmark, ";
    write_text(folder / "scene.yaml", scene + "duration_s: 0.01}\n");
    ASSERT_EQ(livetet(folder, "solve scene.yaml").status, 0);
    const std::string older = text_of(folder / "result.h5");
    write_text(folder / "scene.yaml", scene + "duration_s: 1000}\n");
    auto run = std::async(std::launch::async,
                          [&] { return livetet(folder, "solve scene.yaml", mpirun(4)); });
    // Until all ranks run and the result was begun beside the older one.
    const auto is_begun = [&] {
        for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
            if (entry.path().filename().string().find(".part") != std::string::npos) return true;
        return false;
    };
    const auto waits = [&] {
        return run.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready;
    };
    while (waits() && !(is_begun() && test::programs_in(folder).size() == 4)) {
    }
    const std::vector<pid_t> ranks = test::programs_in(folder);
    ASSERT_EQ(ranks.size(), 4u);
    ::kill(ranks[2], SIGKILL);
    const auto outcome = run.get();
    EXPECT_NE(outcome.status, 0);
    EXPECT_NE(outcome.status, 124) << "the others waited until `timeout` ended them";
    EXPECT_TRUE(test::programs_in(folder).empty());
    EXPECT_TRUE(text_of(folder / "result.h5") == older);
}

}  // namespace
}  // namespace livetet
