#include "apps/study/study.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <functional>
#include <future>
#include <random>
#include <sstream>

#include "apps/scene/scene_files.hpp"
#include "apps/study/study_store.hpp"
#include "base/error.hpp"
#include "io/hierarchy_file.hpp"
#include "support/mpirun.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::Folder;
using test::livetet;
using test::mpirun;
using test::text_of;
using test::write_text;

const std::string studied_press = R"(
mesh: {file: block.h5}
materials: [{young_Pa: 5000, poisson: 0.45}]
fix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]
drive: [{sphere_mm: [100, 50, 100, 25], where: surface, displacement_mm: [0, 0, -8]}]
loads: [{half_space_mm: [199, 0, 0, -1, 0, 0], force_N: [0, 0, -0.5]}]
solver: {newton_tolerance: 1e-8, relative_tolerance: 1e-3}
probes: {points: points.csv, displacements: moved.csv}
)";

const std::string grid = R"(
scene: scene.yaml
vary:
  - {key: "materials[0].young_Pa", from: 2000, to: 8000, count: 3, spacing: log}
  - {key: "drive[0].displacement_mm[2]", values: [-4, -8]}
)";

void prepare_study(const Folder& folder, const std::string& study = grid) {
    write_hierarchy(folder / "block.h5", make_hierarchy({test::block({12, 6, 6}, {0.2, 0.1, 0.1}),
                                                         test::block({4, 2, 2}, {0.2, 0.1, 0.1})},
                                                        "a block"));
    write_text(folder / "points.csv", "name,x_mm,y_mm,z_mm\nmiddle,100,50,50\ntip,199,50,50\n");
    write_text(folder / "scene.yaml", studied_press);
    write_text(folder / "study.yaml", study);
}

std::size_t column_of(const StudyTable& table, const std::string& name) {
    const auto found = std::find(table.outputs.begin(), table.outputs.end(), name);
    EXPECT_NE(found, table.outputs.end()) << name;
    return static_cast<std::size_t>(found - table.outputs.begin());
}

/// All that does not depend on who computed it when.
void expect_same(const StudyTable& a, const StudyTable& b, double relative = 0) {
    EXPECT_EQ(a.inputs, b.inputs);
    EXPECT_EQ(a.outputs, b.outputs);
    EXPECT_EQ(a.values, b.values);
    EXPECT_EQ(a.failures, b.failures);
    ASSERT_EQ(a.results.size(), b.results.size());
    for (std::size_t k = 0; k < a.results.size(); ++k)
        for (std::size_t i = 0; i < a.results[k].size(); ++i) {
            if (std::isnan(a.results[k][i]) && std::isnan(b.results[k][i])) continue;
            EXPECT_NEAR(a.results[k][i], b.results[k][i],
                        relative * std::abs(a.results[k][i]) + (relative > 0 ? 1e-7 : 0))
                << "solve " << k << ", " << a.outputs[i];
        }
}

TEST(StudyDesign, AGridHasEveryValueWithEveryOther) {
    const Folder folder;
    prepare_study(folder);
    const Study study = load_study(folder / "study.yaml");
    ASSERT_EQ(study.samples.size(), 6u);
    EXPECT_EQ(study.samples[0], (std::vector<std::string>{"2000", "-4"}));
    EXPECT_EQ(study.samples[1], (std::vector<std::string>{"2000", "-8"}));
    EXPECT_NEAR(std::stod(study.samples[2][0]), 4000, 1e-9);
    EXPECT_EQ(study.samples[5], (std::vector<std::string>{"8000", "-8"}));
    const Scene scene = study.scene(4);
    EXPECT_EQ(scene.materials[0].young_Pa, 8000);
    EXPECT_EQ(scene.materials[0].poisson, 0.45);
    EXPECT_EQ(scene.drive[0].displacement_mm, Eigen::Vector3d(0, 0, -4));
    EXPECT_EQ(scene.mesh.file, folder / "block.h5");
}

TEST(StudyDesign, AListTakesThemTogetherAndAKeyThatTheSceneLeavesOutMayVary) {
    const Folder folder;
    prepare_study(
        folder,
        "scene: scene.yaml\ndesign: list\nvary:\n  - {key: strain, values: [linear, green]}\n"
        "  - {key: \"drive[0].stiffness_N_per_m\", values: [10, 20]}\n");
    const Study study = load_study(folder / "study.yaml");
    ASSERT_EQ(study.samples.size(), 2u);
    EXPECT_EQ(study.scene(1).strain, "green");
    EXPECT_EQ(study.scene(1).drive[0].stiffness_N_per_m, 20);
}

TEST(StudyDesign, ALatinHypercubeHasOnePointInEachStratumOfEachDimension) {
    const auto points = latin_hypercube(50, 3, 7);
    for (std::size_t d = 0; d < 3; ++d) {
        std::vector<int> strata(50, 0);
        for (const auto& p : points) ++strata[static_cast<std::size_t>(p[d] * 50)];
        EXPECT_EQ(strata, std::vector<int>(50, 1)) << d;
    }
    EXPECT_EQ(points, latin_hypercube(50, 3, 7));
    EXPECT_NE(points, latin_hypercube(50, 3, 8));
    EXPECT_NE(points[0][0], points[0][1]);
}

TEST(StudyDesign, WholeNumbersStayWhole) {
    const Folder folder;
    prepare_study(folder,
                  "scene: scene.yaml\nvary: [{key: \"drive[0].noise_seed\", from: 1, to: 100, "
                  "count: 100}]\n");
    const Study seeds = load_study(folder / "study.yaml");
    for (int k = 0; k < 100; ++k) EXPECT_EQ(seeds.samples[k][0], std::to_string(k + 1));
    prepare_study(folder,
                  "scene: scene.yaml\ndesign: latin-hypercube\nsamples: 7\nvary: [{key: "
                  "\"drive[0].noise_seed\", from: 1, to: 1000, whole: true}]\n");
    for (const auto& sample : load_study(folder / "study.yaml").samples)
        EXPECT_EQ(sample[0].find('.'), std::string::npos) << sample[0];
}

TEST(StudyDesign, WhatIsWrongIsOneLineThatNamesIt) {
    const Folder folder;
    const auto refused = [&](const std::string& vary, std::initializer_list<std::string> parts) {
        prepare_study(folder, "scene: scene.yaml\nvary:\n  - {" + vary + "}\n");
        expect_refused(livetet(folder, "study study.yaml"), parts);
    };
    refused("key: \"materials[0].yung_Pa\", values: [1]", {"materials[0].yung_Pa", "young_Pa"});
    refused("key: \"materials[3].young_Pa\", values: [1]", {"materials", "1 entries"});
    refused("key: \"matreials[0].young_Pa\", values: [1]",
            {"no matreials", "did you mean materials"});
    refused("key: materials, values: [1]", {"materials", "list", "single value"});
    refused("key: \"materials[0\", values: [1]", {"materials[0", "expected a key"});
    refused("key: \"materials[0].young_Pa\", values: [100, -3]",
            {"solve 1", "young_Pa = -3", "greater than 0"});
    refused("key: \"materials[0].young_Pa\"", {"vary[0]", "empty grid"});
    refused("key: \"materials[0].young_Pa\", values: []", {"vary[0]", "empty grid"});
    refused("key: \"materials[0].young_Pa\", from: 1, to: 2", {"count = 0", "empty grid"});
    refused("key: \"materials[0].young_Pa\", from: 1, to: 2, count: 2147483647",
            {"count = 2147483647", "more than 100000 solves"});
    refused("key: \"materials[0].young_Pa\", from: -1, to: 2, count: 3, spacing: log",
            {"log", "above 0"});
    refused("key: \"materials[0].young_Pa\", kount: 3", {"kount", "count"});
    refused("key: output.file, values: [a.h5]", {"output.file"});
    refused("key: mesh.file, values: [none.h5]", {"none.h5", "no such file"});
    prepare_study(folder, "scene: scene.yaml\n");
    expect_refused(livetet(folder, "study study.yaml"), {"vary", "empty grid"});
    prepare_study(folder,
                  "scene: scene.yaml\ndesign: latin-hypercube\nvary: [{key: "
                  "\"materials[0].poisson\", from: 0.3, to: 0.4}]\n");
    expect_refused(livetet(folder, "study study.yaml"), {"samples = 0"});
    EXPECT_FALSE(std::filesystem::exists(folder / "study.h5"));
    EXPECT_FALSE(std::filesystem::exists(folder / "study.h5.parts"));
}

TEST(Study, OneTwoAndFourRanksGiveTheSameTable) {
    const Folder folder;
    prepare_study(folder);
    const auto one = livetet(folder, "study study.yaml");
    ASSERT_EQ(one.status, 0) << one.err;
    const StudyTable table = StudyFile(folder / "study.h5").table();
    ASSERT_EQ(table.values.size(), 6u);
    EXPECT_EQ(table.failures, std::vector<std::string>(6, ""));
    const std::size_t tip = column_of(table, "tip_z_mm"),
                      pull = column_of(table, "drive[0]_force_z_N");
    // Twice as deep a press, and a load that moves a body of four times the stiffness by a quarter.
    EXPECT_LT(table.results[0][tip], table.results[4][tip]);
    EXPECT_LT(table.results[5][pull], table.results[4][pull]);
    EXPECT_FALSE(std::filesystem::exists(folder / "study.h5.parts"));
    const std::string xdmf = text_of(folder / "study.xdmf");
    for (const char* part : {"study.h5:/displacement/000005", "study.h5:/meshes/0/tets"})
        EXPECT_NE(xdmf.find(part), std::string::npos) << part;
    const std::string csv = text_of(folder / "study.csv");
    EXPECT_EQ(csv.find("solve,materials[0].young_Pa,drive[0].displacement_mm[2],converged,largest_"
                       "displacement_mm"),
              0u)
        << csv;
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 7);
#ifdef LIVETET_IMAGES
    const std::filesystem::path picture = folder / "study_largest_displacement_mm.png";
    EXPECT_TRUE(std::filesystem::remove(picture)) << one.err;
#endif

    for (const int ranks : {2, 4}) {
        std::filesystem::remove(folder / "study.h5");
        const auto more = livetet(folder, "study study.yaml", mpirun(ranks));
        ASSERT_EQ(more.status, 0) << more.err;
        expect_same(StudyFile(folder / "study.h5").table(), table);
#ifdef LIVETET_IMAGES
        EXPECT_TRUE(std::filesystem::remove(picture)) << more.err;
#endif
    }
    write_text(folder / "study.yaml", grid + "ranks_per_solve: 2\n");
    std::filesystem::remove(folder / "study.h5");
    const auto pairs = livetet(folder, "study study.yaml", mpirun(4));
    ASSERT_EQ(pairs.status, 0) << pairs.err;
    expect_same(StudyFile(folder / "study.h5").table(), table, 1e-5);
}

TEST(Study, ASensorsNoiseVariesByItsSeed) {
    const Folder folder;
    prepare_study(folder,
                  "scene: scene.yaml\ndesign: list\nvary:\n  - {key: \"drive[0].noise_seed\", "
                  "values: [1, 2, 1]}\n"
                  "  - {key: \"drive[0].noise_mm\", values: [1.4, 1.4, 1.4]}\n");
    ASSERT_EQ(livetet(folder, "study study.yaml").status, 0);
    const StudyTable table = StudyFile(folder / "study.h5").table();
    const std::size_t pull = column_of(table, "drive[0]_force_z_N");
    EXPECT_EQ(table.results[0], table.results[2]);
    EXPECT_GT(std::abs(table.results[0][pull] - table.results[1][pull]),
              1e-3 * std::abs(table.results[0][pull]));
    // About 8 mm of press, and 1.4 mm of noise.
    EXPECT_LT(std::abs(table.results[0][pull] - table.results[1][pull]),
              std::abs(table.results[0][pull]));
}

TEST(Study, InvertedTetsAndWhatLeavesItsModelAreOutputsAndSentences) {
    const Folder folder;
    prepare_study(
        folder,
        "scene: scene.yaml\nvary: [{key: \"drive[0].displacement_mm[2]\", values: [-4, -110]}]\n");
    std::string scene = studied_press;
    scene.replace(scene.find("[1, 0, 0, 1, 0, 0]"), 18, "[0, 0, 1, 0, 0, 1]");  // held below
    write_text(folder / "scene.yaml", scene);
    const auto outcome = livetet(folder, "study study.yaml");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const StudyTable table = StudyFile(folder / "study.h5").table();
    const std::size_t inverted = column_of(table, "inverted_tets");
    EXPECT_EQ(table.results[0][inverted], 0);
    EXPECT_GT(table.results[1][inverted], 0);
    const std::size_t beyond = column_of(table, "beyond_model");
    EXPECT_EQ(table.results[0][beyond], 0);
    EXPECT_GT(table.results[1][beyond], 0);
    for (const char* words : {"1 solve ended with inverted tets (inverted_tets)",
                              "1 solve went beyond what the model stands for (beyond_model)"})
        EXPECT_NE(outcome.out.find(words), std::string::npos) << outcome.out;
}

TEST(Study, AFailedSolveIsARowWithItsReason) {
    const Folder folder;
    prepare_study(folder,
                  "scene: scene.yaml\nkeep_displacements: false\nvary: [{key: "
                  "\"drive[0].sphere_mm[2]\", values: [100, 500]}]\n");
    const auto outcome = livetet(folder, "study study.yaml", mpirun(2));
    ASSERT_EQ(outcome.status, 4) << outcome.err;
    const StudyTable table = StudyFile(folder / "study.h5").table();
    EXPECT_EQ(table.failures[0], "");
    EXPECT_NE(table.failures[1].find("drive[0]"), std::string::npos) << table.failures[1];
    EXPECT_TRUE(std::isnan(table.results[1][0]));
    EXPECT_NE(outcome.out.find(table.failures[1]), std::string::npos) << outcome.out;
    EXPECT_NE(text_of(folder / "study.csv").find("drive[0]"), std::string::npos);
}

TEST(Study, TheSummaryIsOfTheSolvesThatConverged) {
    const Folder folder;
    prepare_study(folder,
                  "scene: scene.yaml\nkeep_displacements: false\nvary: [{key: solver.max_newton, "
                  "values: [1, 50]}]\n");
    const auto outcome = livetet(folder, "study study.yaml");
    ASSERT_EQ(outcome.status, 4) << outcome.err;
    const StudyTable table = StudyFile(folder / "study.h5").table();
    EXPECT_NE(table.failures[0], "");
    EXPECT_EQ(table.failures[1], "");
    const std::size_t share = column_of(table, "share_of_load");
    EXPECT_LT(table.results[0][share], 1);
    EXPECT_NE(outcome.out.find("of those that converged"), std::string::npos) << outcome.out;
    const std::size_t line = outcome.out.find("share_of_load");
    ASSERT_NE(line, std::string::npos) << outcome.out;
    std::istringstream words(outcome.out.substr(line + std::string("share_of_load").size()));
    double least = 0, median = 0, most = 0;
    words >> least >> median >> most;
    EXPECT_EQ(least, 1) << outcome.out;
    EXPECT_EQ(most, 1) << outcome.out;
}

/// A region that no material is for is found by every rank, not by the one whose tets are of it:
/// none waits for the others.
TEST(Study, AMissingMaterialIsARowOnSeveralRanksToo) {
    const Folder folder;
    prepare_study(folder,
                  "scene: scene.yaml\nranks_per_solve: 2\nvary: [{key: \"materials[0].region\", "
                  "values: [0, 1]}]\n");
    MeshHierarchy hierarchy = read_hierarchy(folder / "block.h5");
    for (TetMesh& level : hierarchy.levels)
        for (const Tet& t : level.tets)
            level.regions.push_back(level.nodes[t[0]].x() < 0.05 ? 2 : 1);
    write_hierarchy(folder / "block.h5", hierarchy);
    const auto outcome = livetet(folder, "study study.yaml", mpirun(2));
    ASSERT_EQ(outcome.status, 4) << outcome.err;
    const StudyTable table = StudyFile(folder / "study.h5").table();
    EXPECT_EQ(table.failures[0], "");
    EXPECT_NE(table.failures[1].find("region 2"), std::string::npos) << table.failures[1];
}

TEST(Study, ASolveThatEndedTheStudyTwiceIsNotTriedAgain) {
    const Folder folder;
    prepare_study(folder, grid + "ranks_per_solve: 2\n");
    const Study study = load_study(folder / "study.yaml");
    {
        StudyStore store(study);
        store.open();
        store.note_failure(2, 1, "PETSc: something failed");
        for (int rank = 0; rank < 2; ++rank) store.note_failure(3, 1, "PETSc: something failed");
        EXPECT_FALSE(store.failures(3).given_up) << "the ranks of a group count once";
        store.note_failure(3, store.failures(3).count + 1, "PETSc: it failed again");
    }
    const auto outcome = livetet(folder, "study study.yaml", mpirun(2));
    ASSERT_EQ(outcome.status, 4) << outcome.err;
    const StudyTable table = StudyFile(folder / "study.h5").table();
    EXPECT_EQ(table.failures[2], "");
    EXPECT_NE(table.failures[3].find("twice: PETSc: it failed again"), std::string::npos)
        << table.failures[3];
}

TEST(Study, AFileThatChangesWhileItRunsIsSaid) {
    const Folder folder;
    prepare_study(folder);
    const Study study = load_study(folder / "study.yaml");
    const StudyStore store(study);
    EXPECT_EQ(store.checked_fingerprint(), store.checked_fingerprint());
    write_text(folder / "points.csv", "name,x_mm,y_mm,z_mm\ntip,199,50,50\n");
    EXPECT_THROW(store.checked_fingerprint(), Error);
}

#ifdef LIVETET_IMAGES
TEST(Study, VoxelsThatLieBesideTheirHeaderAreLookedAt) {
    const Folder folder;
    write_text(folder / "mask.mhd",
               "ObjectType = Image\nNDims = 3\nDimSize = 4 4 4\nElementSpacing = 2 2 "
               "2\nElementType = MET_UCHAR\nElementDataFile = mask.raw\n");
    write_text(folder / "mask.raw", std::string(64, '\1'));
    const std::string was = stamps_of({folder / "mask.mhd"});
    write_text(folder / "mask.mhd", text_of(folder / "mask.mhd"));  // another time, the same
    EXPECT_EQ(stamps_of({folder / "mask.mhd"}), was);
    write_text(folder / "mask.raw", std::string(63, '\1') + '\2');
    EXPECT_NE(stamps_of({folder / "mask.mhd"}), was);
    write_text(folder / "mask.mhd",
               "ObjectType = Image\nNDims = 3\nDimSize = 4 4 2\nElementSpacing = 2 2 "
               "2\nElementType = MET_UCHAR\nElementDataFile = LIST\na.raw\nb.raw\n");
    EXPECT_THROW(stamps_of({folder / "mask.mhd"}), Error);
}
#endif

TEST(Study, WithoutASolveThatConvergedItsStatusIsThatOfOneThatDidNot) {
    const Folder folder;
    prepare_study(folder,
                  "scene: scene.yaml\nkeep_displacements: false\nvary: [{key: solver.max_newton, "
                  "values: [1]}]\n");
    const auto outcome = livetet(folder, "study study.yaml");
    EXPECT_EQ(outcome.status, 3) << outcome.out << outcome.err;
    EXPECT_EQ(StudyFile(folder / "study.h5").table().failures.size(), 1u);
}

TEST(Study, WhatIsCompleteIsNotSolvedAgainAndWhatChangedIsRefused) {
    const Folder folder;
    prepare_study(folder);
    ASSERT_EQ(livetet(folder, "study study.yaml").status, 0);
    const std::string bytes = text_of(folder / "study.h5");
    const auto again = livetet(folder, "study study.yaml", mpirun(5));  // more than solves
    EXPECT_EQ(again.status, 0) << again.err;
    EXPECT_NE(again.out.find("is complete"), std::string::npos) << again.out;
    EXPECT_TRUE(text_of(folder / "study.h5") == bytes);
    write_text(folder / "block.h5", text_of(folder / "block.h5"));  // another time, the same mesh
    EXPECT_EQ(livetet(folder, "study study.yaml").status, 0);

    EXPECT_EQ(livetet(folder, "study study.yaml -log_view :log.txt -ksp_converged_reason").status,
              0)
        << "these only print";
    expect_refused(livetet(folder, "study study.yaml -ksp_rtol 1e-3"),
                   {"study.yaml", "changed", "-ksp_rtol"});

    std::string other = grid;
    other.replace(other.find("[-4, -8]"), 8, "[-4, -9]");
    write_text(folder / "study.yaml", other);
    expect_refused(livetet(folder, "study study.yaml"), {"study.yaml", "changed", "-8", "-9"});
    write_text(folder / "study.yaml", grid);
    write_text(folder / "scene.yaml", studied_press + "gravity_m_per_s2: [0, 0, -1]\n");
    expect_refused(livetet(folder, "study study.yaml"), {"changed", "gravity"});
    write_text(folder / "scene.yaml", studied_press);
    write_text(folder / "points.csv", "name,x_mm,y_mm,z_mm\ntip,199,50,50\n");
    expect_refused(livetet(folder, "study study.yaml"), {"changed", "points.csv"});
    EXPECT_TRUE(text_of(folder / "study.h5") == bytes);
}

/// What `h5diff` says of two results, all but their times; empty: they are equal.
std::string h5diff(const Folder& folder, const std::string& options) {
    const auto outcome = test::run(folder, "h5diff -v " + options + " first.h5 study.h5");
    return outcome.status == 0 ? "" : outcome.out + outcome.err + "differ";
}

TEST(Study, EqualStudiesDifferInTheirTimesAlone) {
    const Folder folder;
    prepare_study(folder);
    ASSERT_EQ(livetet(folder, "study study.yaml").status, 0);
    std::filesystem::rename(folder / "study.h5", folder / "first.h5");
    ASSERT_EQ(livetet(folder, "study study.yaml").status, 0);
    EXPECT_EQ(h5diff(folder, "--exclude-path /times"), "");
    EXPECT_NE(h5diff(folder, ""), "") << "no two runs take the same time to the nanosecond";
}

/// Values are added in front and between; what is done is not solved again, wherever it now is.
TEST(Study, ValuesThatAreAddedAreSolvedAndTheOthersKept) {
    const Folder folder;
    prepare_study(folder);
    ASSERT_EQ(livetet(folder, "study study.yaml").status, 0);
    const StudyTable before = StudyFile(folder / "study.h5").table();
    std::string longer = grid;
    longer.replace(longer.find("[-4, -8]"), 8, "[-2, -4, -6, -8]");
    write_text(folder / "study.yaml", longer);
    const auto outcome = livetet(folder, "study study.yaml", mpirun(2));
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("6 of the 12 solves are taken from"), std::string::npos)
        << outcome.err;
    const StudyTable after = StudyFile(folder / "study.h5").table();
    ASSERT_EQ(after.values.size(), 12u);
    EXPECT_EQ(after.values[0], (Sample{"2000", "-2"}));
    for (std::size_t k = 0; k < before.values.size(); ++k) {
        const std::size_t now = k / 2 * 4 + (k % 2 == 0 ? 1 : 3);
        EXPECT_EQ(after.values[now], before.values[k]);
        EXPECT_EQ(after.results[now], before.results[k]);
        EXPECT_EQ(after.seconds[now], before.seconds[k]) << "solved again";
    }

    std::filesystem::rename(folder / "study.h5", folder / "first.h5");
    ASSERT_EQ(livetet(folder, "study study.yaml").status, 0);
    EXPECT_EQ(h5diff(folder, "--exclude-path /times"), "");
    write_text(folder / "study.yaml", grid);  // fewer than there are
    expect_refused(livetet(folder, "study study.yaml"), {"study.yaml", "changed", "-2"});
}

TEST(Study, AnInterruptedStudyMayBeExtended) {
    const Folder folder;
    prepare_study(folder);
    StudyRow row;
    row.converged = true;
    {
        const Study study = load_study(folder / "study.yaml");
        StudyStore store(study);
        store.open();
        for (const std::size_t k : {1, 2, 4}) {
            row.outputs = {{"number", static_cast<double>(k)}};
            store.keep(k, row);
        }
    }
    // Half on its way already: the run that moved the rows was killed.
    const std::filesystem::path parts = folder / "study.h5.parts";
    std::filesystem::rename(parts / "000002.h5", parts / "000002.moved");
    std::string longer = grid;
    longer.replace(longer.find("[-4, -8]"), 8, "[-8, -4, -6]");
    write_text(folder / "study.yaml", longer);
    const Study study = load_study(folder / "study.yaml");
    StudyStore store(study);
    store.open();
    EXPECT_EQ(store.done(),
              (std::vector<bool>{true, false, false, false, true, false, false, true, false}));
    EXPECT_EQ(store.row(0).outputs.front().second, 1);
    EXPECT_EQ(store.row(4).outputs.front().second, 2);
    EXPECT_EQ(store.row(7).outputs.front().second, 4);
}

TEST(Study, APetscOptionThatNoSolveCouldTakeIsRefusedAndTheCorrectedOneIsNot) {
    const Folder folder;
    prepare_study(folder,
                  "scene: scene.yaml\nvary: [{key: \"materials[0].poisson\", values: [0.3]}]\n");
    expect_refused(livetet(folder, "study study.yaml -ksp_rtol banana"), {"PETSc", "banana"});
    EXPECT_FALSE(std::filesystem::exists(folder / "study.h5"));
    const auto corrected = livetet(folder, "study study.yaml -ksp_rtol 1e-4");
    EXPECT_EQ(corrected.status, 0) << corrected.out << corrected.err;
}

TEST(Study, MoreRanksThanCanBeUsedAndMeshesOfAnotherVersionAreRefused) {
    const Folder folder;
    prepare_study(folder,
                  "scene: scene.yaml\nvary: [{key: \"materials[0].poisson\", values: [0.3]}]\n");
    const auto many = livetet(folder, "study study.yaml", mpirun(2));
    EXPECT_EQ(many.status, 2);
    EXPECT_NE(many.err.find("more ranks than can be used"), std::string::npos) << many.err;
    write_text(folder / "study.yaml", grid + "ranks_per_solve: 2\n");
    const auto odd = livetet(folder, "study study.yaml", mpirun(3));
    EXPECT_EQ(odd.status, 2);
    EXPECT_NE(odd.err.find("ranks_per_solve"), std::string::npos) << odd.err;

    prepare_study(folder);
    {
        hdf5::File file = hdf5::File::create(folder / "block.h5", "block.h5");
        hdf5::write_format(file, "livetet hierarchy", 99);
    }
    const auto old = livetet(folder, "study study.yaml", mpirun(2));
    EXPECT_EQ(old.status, 2);
    EXPECT_NE(old.err.find("block.h5"), std::string::npos) << old.err;
    EXPECT_EQ(old.err.find("livetet:"), old.err.rfind("livetet:"))
        << "more than one rank spoke: " << old.err;
}

/// A study's CSV less its last but one column.
std::string without_times(const std::string& csv) {
    std::istringstream lines(csv);
    std::string line, out;
    while (std::getline(lines, line)) {
        const std::size_t last = line.rfind(','), before = line.rfind(',', last - 1);
        out += line.substr(0, before) + line.substr(last) + "\n";
    }
    return out;
}

std::size_t rows_in(const Folder& folder) {
    std::error_code none;
    std::size_t rows = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "study.h5.parts", none)) {
        const std::string name = entry.path().filename().string();
        rows += name[0] != '.' && name.ends_with(".h5");
    }
    return rows;
}

/// A rank of `ranks` is killed so many times: every other time at any moment of the second after it
/// is there, else at one of the half second after it kept another row; a run that ends before is
/// not counted. Then the study is left to end. Its file is to be that of an uninterrupted run on
/// `whole_by`, to the bit.
void kill_and_go_on(const std::string& study, int ranks, int times, const std::string& whole_by) {
    const Folder folder;
    prepare_study(folder, study);
    ASSERT_EQ(livetet(folder, "study study.yaml", whole_by).status, 0);
    const StudyTable whole = StudyFile(folder / "study.h5").table();
    const std::string csv = without_times(text_of(folder / "study.csv"));
    std::filesystem::remove(folder / "study.h5");

    std::mt19937 random(std::random_device{}());
    int killed = 0;
    for (int attempt = 0; killed < times; ++attempt) {
        ASSERT_LT(attempt, 10 * times) << "too few kills met a running study";
        auto run = std::async(std::launch::async,
                              [&] { return livetet(folder, "study study.yaml", mpirun(ranks)); });
        const std::size_t before = rows_in(folder);
        const auto poll = std::chrono::milliseconds(5);
        while ((attempt % 2 == 1 ? rows_in(folder) <= before : test::programs_in(folder).empty()) &&
               run.wait_for(poll) != std::future_status::ready) {
        }
        const std::chrono::duration<double> moment(
            std::uniform_real_distribution(0.0, attempt % 2 == 1 ? 0.5 : 1.0)(random));
        if (run.wait_for(moment) != std::future_status::ready) {
            const std::vector<pid_t> programs = test::programs_in(folder);
            if (!programs.empty()) ::kill(programs[random() % programs.size()], SIGKILL);
        }
        killed += run.get().status == 128 + SIGKILL;  // as mpirun hands it on
        if (std::filesystem::exists(folder /
                                    "study.h5")) {  // it had been done before the moment came
            expect_same(StudyFile(folder / "study.h5").table(), whole);
            EXPECT_EQ(without_times(text_of(folder / "study.csv")), csv);
            std::filesystem::remove(folder / "study.h5");
        }
    }
    const auto last = livetet(folder, "study study.yaml", mpirun(ranks));
    ASSERT_EQ(last.status, 0) << last.err;
    expect_same(StudyFile(folder / "study.h5").table(), whole);
    EXPECT_EQ(without_times(text_of(folder / "study.csv")), csv);
    EXPECT_FALSE(std::filesystem::exists(folder / "study.h5.parts"));
}

TEST(Study, KilledAtRandomMomentsItGoesOnToTheSameFile) {
    kill_and_go_on(
        "scene: scene.yaml\nvary:\n  - {key: \"materials[0].young_Pa\", from: 2000, to: 8000, "
        "count: 6}\n"
        "  - {key: \"drive[0].displacement_mm[2]\", values: [-4, -8, -12]}\n",
        2, 10, "");
}

TEST(Study, ARankOfAPairIsKilledAndItGoesOnToTheSameFile) {
    kill_and_go_on(grid + "ranks_per_solve: 2\n", 4, 4, mpirun(2));
}

/// While this lives, no file may grow beyond so many bytes.
class SmallDisk {
  public:
    explicit SmallDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
        getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit small{bytes, before_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &small);
    }
    ~SmallDisk() {
        setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;

  private:
    rlimit before_{};
    void (*handler_)(int);
};

std::string words_of(const std::function<void()>& work) {
    try {
        work();
    } catch (const Error& e) {
        return e.what();
    }
    return "";
}

/// A study of two solves whose rows can be kept, and a row.
struct TwoSolves {
    Folder folder;
    Study study =
        (prepare_study(
             folder,
             "scene: scene.yaml\nvary: [{key: \"materials[0].poisson\", values: [0.3, 0.4]}]\n"),
         load_study(folder / "study.yaml"));
    StudyStore store{study};
    StudyRow row;
    TwoSolves() {
        store.open();
        row.converged = true;
        row.outputs = {{"x_mm", 1.5}};
    }
};

TEST(Study, AFullDiskIsALineAndLeavesNothingHalfWritten) {
    TwoSolves of;
    auto& [folder, study, store, row] = of;
    row.displacement.assign(50000, Vector3(1, 2, 3));
    {
        const SmallDisk disk(20000);
        const std::string words = words_of([&] { store.keep(0, row); });
        EXPECT_NE(words.find("is the disk full?"), std::string::npos) << words;
        EXPECT_NE(words.find("continue"), std::string::npos) << words;
    }
    EXPECT_EQ(store.count_done(), 0u);
    store.keep(0, row);
    store.keep(1, row);
    EXPECT_EQ(store.row(1).displacement, row.displacement);
    {
        const SmallDisk disk(3'000'000);  // room for the first solve's, not for both
        EXPECT_NE(words_of([&] { store.write_result({}); }).find("is the disk full?"),
                  std::string::npos);
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "study.h5"));
    store.write_result({});
    EXPECT_EQ(StudyFile(folder / "study.h5").table().results,
              (std::vector<std::vector<double>>{{1.5}, {1.5}}));
    for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
        EXPECT_NE(entry.path().filename().string()[0], '.') << entry.path();
}

TEST(Study, ADamagedRowIsNamedAndRemovedSolvedAgain) {
    TwoSolves of;
    auto& [folder, study, store, row] = of;
    for (std::size_t k = 0; k < 2; ++k) store.keep(k, row);
    const std::string good = text_of(folder / "study.h5.parts/000001.h5");
    write_text(folder / "study.h5.parts/000001.h5", good.substr(0, good.size() / 2));
    const std::string words = words_of([&] { store.write_result({}); });
    for (const char* part : {"000001.h5", "truncated", "remove it"})
        EXPECT_NE(words.find(part), std::string::npos) << words;
    EXPECT_FALSE(std::filesystem::exists(folder / "study.h5"));
    // HDF5 crashes on some of these, on that at 120 for one: found by changed files.
    int refused = 0;
    for (std::size_t at = 0; at + 8 < good.size(); at += 40) {
        std::string bad = good;
        bad.replace(at, 8, 8, '\xff');
        write_text(folder / "study.h5.parts/000001.h5", bad);
        const std::string why = words_of([&] {
            store.check_rows();
            (void)store.row(1);
        });
        refused += why.find("000001.h5") != std::string::npos;
    }
    EXPECT_GT(refused, 5);
    write_text(folder / "study.h5.parts/000001.h5", good);
    store.write_result({});
    EXPECT_EQ(StudyFile(folder / "study.h5").table().results.size(), 2u);
}

TEST(Study, RowsThatAreNotOfTheirSolveAreSolvedAgainAndThoseOfAnUnknownStudyRefused) {
    const Folder folder;
    prepare_study(folder);
    const Study study = load_study(folder / "study.yaml");
    StudyRow row;
    row.converged = true;
    const std::filesystem::path parts = folder / "study.h5.parts";
    {
        StudyStore store(study);
        store.open();
        for (std::size_t k = 0; k < 3; ++k) store.keep(k, row);
    }
    std::filesystem::copy_file(parts / "000001.h5", parts / "000002.h5",
                               std::filesystem::copy_options::overwrite_existing);
    {
        StudyStore store(study);
        store.open();
        EXPECT_EQ(store.done(), (std::vector<bool>{true, true, false, false, false, false}));
    }
    std::filesystem::remove(parts / "study.yaml");
    StudyStore store(study);
    const std::string words = words_of([&] { store.open(); });
    EXPECT_NE(words.find("study.yaml"), std::string::npos) << words;
}

TEST(Study, ARowThatDidNotReachTheDiskIsSolvedAgainAndASecondRunIsRefused) {
    const Folder folder;
    prepare_study(folder);
    const Study study = load_study(folder / "study.yaml");
    StudyRow row;
    row.converged = true;
    {
        StudyStore first(study);
        first.open();
        first.keep(0, row);
        write_text(folder / "study.h5.parts/000001.h5", "");
        StudyStore second(study);
        EXPECT_NE(words_of([&] { second.open(); }).find("another run"), std::string::npos);
    }
    StudyStore store(study);
    store.open();
    EXPECT_EQ(store.done(), (std::vector<bool>{true, false, false, false, false, false}));
    EXPECT_TRUE(store.claim(1));
    EXPECT_FALSE(store.claim(1));
}

}  // namespace
}  // namespace livetet
