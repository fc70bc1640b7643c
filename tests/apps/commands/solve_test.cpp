#include <gtest/gtest.h>

#include <fmt/format.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "apps/commands/last_displacement.hpp"
#include "io/hierarchy_file.hpp"
#include "io/points_csv.hpp"
#include "io/result_file.hpp"
#include "mesh/hierarchy.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

using test::Folder;
using test::last_displacement;
using test::livetet;
using test::text_of;
using test::write_text;

const std::string press = R"(
mesh: {file: block.h5}
materials: [{young_Pa: 5000, poisson: 0.45}]
fix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]
drive: [{sphere_mm: [100, 50, 100, 25], where: surface, displacement_mm: [0, 2, -12]}]
solver: {newton_tolerance: 1e-10, relative_tolerance: 1e-6}
probes: {points: points.csv, displacements: moved.csv}
)";

void prepare_press(const Folder& folder) {
    write_hierarchy(folder / "block.h5", make_hierarchy({test::block({12, 6, 6}, {0.2, 0.1, 0.1}),
                                                         test::block({7, 4, 4}, {0.2, 0.1, 0.1}),
                                                         test::block({4, 2, 2}, {0.2, 0.1, 0.1})},
                                                        "a block"));
    write_text(folder / "points.csv", "name,x_mm,y_mm,z_mm\nmiddle,100,50,50\ntip,199,50,50\n");
    write_text(folder / "scene.yaml", press);
}

TEST(Solve, TakesNoPressuresForSensorsThatItDoesNotMove) {
    const Folder folder;
    prepare_press(folder);
    write_text(folder / "scene.yaml",
               press +
                   "strain: neohookean\ntrack: {source: none.mha, registration: none.json, "
                   "sensors: [{tool: Sensor, place_mm: [100, 50, 100]}]}\n");
    const auto outcome = livetet(folder, "solve scene.yaml");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("solver           cg + mg"), std::string::npos) << outcome.out;
}

/// On other numbers of ranks, by another partitioner, the same; and of a refined mesh, with as many
/// iterations.
TEST(Solve, OneTwoAndFourRanksAgreeTo1em8) {
    const Folder folder;
    prepare_press(folder);
    for (const int refine : {0, 1}) {
        std::vector<Vector3> first;
        std::string probes;
        int iterations = 0;
        for (const int ranks : {1, 2, 4}) {
            std::string scene = press;
            scene.replace(scene.find("block.h5"), 8, "block.h5, refine: " + std::to_string(refine));
            scene.replace(scene.find("solver: {"), 9,
                          ranks == 4 ? "solver: {partitioner: ptscotch, " : "solver: {");
            if (refine) scene.replace(scene.find("1e-6"), 4, "1e-7");
            write_text(folder / "scene.yaml", scene);
            const auto outcome =
                livetet(folder, "solve scene.yaml --json told.json",
                        ranks > 1 ? "mpirun --oversubscribe -n " + std::to_string(ranks) : "");
            ASSERT_EQ(outcome.status, 0) << outcome.err;
            const auto told = nlohmann::json::parse(text_of(folder / "told.json"));
            EXPECT_EQ(told["ranks"], ranks);
            EXPECT_EQ(told["levels"], 3 + refine);
            const auto u = last_displacement(folder / "result.h5");
            if (ranks == 1) {
                first = u;
                probes = text_of(folder / "moved.csv");
                iterations = told["iterations"].get<int>() / told["linearisations"].get<int>();
                continue;
            }
            double difference = 0, largest = 0;
            for (std::size_t i = 0; i < u.size(); ++i) {
                difference = std::max(difference, (u[i] - first[i]).norm());
                largest = std::max(largest, u[i].norm());
            }
            EXPECT_GE(largest, std::hypot(0.012, 0.002) - 1e-12);
            EXPECT_LT(largest, 0.02);
            EXPECT_LT(difference, 1e-8 * largest) << ranks << " ranks, refined " << refine;
            EXPECT_EQ(probes.substr(0, 40), text_of(folder / "moved.csv").substr(0, 40));
            EXPECT_NEAR(told["iterations"].get<int>() / told["linearisations"].get<int>(),
                        iterations, 2);
        }
    }
}

TEST(Solve, EverySolverAndThePetscOptionsOfTheSceneWork) {
    const Folder folder;
    prepare_press(folder);
    ASSERT_EQ(livetet(folder, "solve scene.yaml").status, 0);
    const auto reference = last_displacement(folder / "result.h5");
    for (const char* solver :
         {"{kind: multigrid, coarse: galerkin}", "{kind: boomeramg}", "{kind: gamg}",
          "{kind: direct}",
          "{kind: petsc, petsc_options: \"-ksp_type cg -pc_type jacobi\", max_iterations: 5000}"}) {
        std::string scene = press;
        scene.replace(scene.find("solver: {"), 9,
                      std::string("solver: ") +
                          std::string(solver).substr(0, std::string(solver).size() - 1) + ", ");
        write_text(folder / "scene.yaml", scene);
        const auto outcome = livetet(folder, "solve scene.yaml");
        ASSERT_EQ(outcome.status, 0) << solver << outcome.err;
        const auto u = last_displacement(folder / "result.h5");
        for (std::size_t i = 0; i < u.size(); ++i)
            ASSERT_LT((u[i] - reference[i]).norm(), 1e-7) << solver;
    }
    EXPECT_NE(livetet(folder, "solve scene.yaml -ksp_view").out.find("KSP Object"),
              std::string::npos);
}

/// Counted here from the displacements alone.
std::size_t inside_out(const std::filesystem::path& path) {
    const ResultReader result(path);
    const auto u = last_displacement(path);
    const TetMesh& mesh = result.mesh();
    const auto place = [&](std::int32_t n) -> Vector3 { return mesh.nodes[n] + u[n]; };
    return static_cast<std::size_t>(
        std::count_if(mesh.tets.begin(), mesh.tets.end(), [&](const Tet& t) {
            const Vector3 a = place(t[0]);
            return (place(t[1]) - a).cross(place(t[2]) - a).dot(place(t[3]) - a) <= 0;
        }));
}

TEST(Solve, TetsInsideOutAreCountedAndTold) {
    const Folder folder;
    prepare_press(folder);
    ASSERT_EQ(livetet(folder, "solve scene.yaml --json told.json").status, 0);
    EXPECT_EQ(nlohmann::json::parse(text_of(folder / "told.json"))["inverted_tets"], 0);
    std::string scene = press;
    scene.replace(scene.find("[1, 0, 0, 1, 0, 0]"), 18, "[0, 0, 1, 0, 0, 1]");  // held below,
    scene.replace(scene.find("-12]"), 4, "-110]");  // and pressed through that
    scene.replace(scene.find("1e-10"), 5, "1e-4");
    write_text(folder / "scene.yaml", scene);
    for (const char* before : {"", "mpirun --oversubscribe -n 2"}) {
        const auto outcome = livetet(folder, "solve scene.yaml --json told.json", before);
        ASSERT_TRUE(outcome.status == 0 || outcome.status == 3) << outcome.err;
        const std::size_t count = inside_out(folder / "result.h5");
        EXPECT_GT(count, 0u);
        EXPECT_EQ(nlohmann::json::parse(text_of(folder / "told.json"))["inverted_tets"], count);
        EXPECT_NE(outcome.out.find("inverted         " + std::to_string(count) + " tets"),
                  std::string::npos)
            << outcome.out;
        const auto report = livetet(folder, "report result.h5");
        EXPECT_NE(report.out.find(std::to_string(count) + " elements are inverted"),
                  std::string::npos)
            << report.out << report.err;
    }
}

/// A small strain's trace says nothing of it: turned by 120 degrees it is -3, pressed through
/// itself near nu = 1/2 about 0.
TEST(Solve, TetsInsideOutAreCountedByTheirVolumeInSmallStrainToo) {
    const Folder folder;
    prepare_press(folder);
    const auto counted = [&](const std::string& drive) {
        write_text(folder / "scene.yaml",
                   fmt::format("mesh: {{file: block.h5}}\nstrain: linear\nmaterials: [{{young_Pa: "
                               "3000, poisson: 0.48}}]\n"
                               "drive: [{}]\nsolver: {{newton_tolerance: 1.0e-4}}\n",
                               drive));
        const auto outcome = livetet(folder, "solve scene.yaml --json told.json");
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        const std::size_t count = inside_out(folder / "result.h5");
        EXPECT_EQ(nlohmann::json::parse(text_of(folder / "told.json"))["inverted_tets"], count);
        return count;
    };
    EXPECT_EQ(
        counted("{box_mm: [-1, -1, -1, 201, 101, 101], where: surface, rotation_deg: [0, 0, 120]}"),
        0u);
    EXPECT_GT(counted("{half_space_mm: [1, 0, 0, 1, 0, 0]}, {half_space_mm: [199, 0, 0, -1, 0, 0], "
                      "displacement_mm: [-220, 0, 0]}"),
              0u);
}

TEST(Solve, TolerancesOfTheCommandLineGoBeforeTheScenes) {
    const Folder folder;
    prepare_press(folder);
    const auto iterations = [&](const std::string& options) {
        const auto outcome = livetet(folder, "solve scene.yaml --json told.json " + options);
        EXPECT_TRUE(outcome.status == 0 || outcome.status == 3) << outcome.err;
        const auto told = nlohmann::json::parse(text_of(folder / "told.json"));
        return told["iterations"].get<double>() / told["linearisations"].get<double>();
    };
    const double of_scene = iterations("");
    EXPECT_LT(iterations("-ksp_rtol 1e-2"), 0.7 * of_scene);
    EXPECT_LE(iterations("-ksp_max_it 1"),
              2);  // where it is not met, once more with the positive tangent
    EXPECT_LT(iterations("-ksp_atol 1e3"), 1);
}

TEST(Solve, WarnsOfAResultThatCannotBeMeant) {
    const Folder folder;
    write_hierarchy(folder / "block.h5",
                    make_hierarchy({test::block({8, 4, 4}, {0.2, 0.1, 0.1})}, "a block"));
    const auto warnings = [&](double force_N) {
        write_text(folder / "scene.yaml",
                   fmt::format("mesh: {{file: block.h5}}\nstrain: linear\n"
                               "fix: [{{half_space_mm: [1, 0, 0, 1, 0, 0]}}]\n"
                               "loads: [{{half_space_mm: [199, 0, 0, -1, 0, 0], force_N: [0, 0, "
                               "{}]}}]\n",
                               force_N));
        const auto outcome = livetet(folder, "solve scene.yaml --json told.json");
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_EQ(livetet(folder, "report result.h5 --no-pictures").status, 0);
        const bool reported =
            text_of(folder / "result.report/report.txt").find("above the body's size") !=
            std::string::npos;
        EXPECT_EQ(
            outcome.out.find("warning          The largest displacement") != std::string::npos,
            reported);
        EXPECT_EQ(reported, force_N > 1);
        return nlohmann::json::parse(text_of(folder / "told.json"))["beyond_model"].size();
    };
    EXPECT_EQ(warnings(0.05), 0u);
    EXPECT_EQ(warnings(10), 3u) << "displacement, strain, rotation";
}

TEST(Solve, AnAttemptThatFailsIsNotShownAsASuccess) {
    const Folder folder;
    prepare_press(folder);
    std::string scene = press;
    scene.replace(scene.find("solver: {"), 9, "solver: {max_newton: 1, ");
    write_text(folder / "scene.yaml", scene);
    const auto outcome = livetet(folder, "solve scene.yaml");
    EXPECT_EQ(outcome.status, 3);
    EXPECT_EQ(outcome.err.find("solve 100 %"), std::string::npos) << outcome.err;
}

TEST(Solve, MultigridOnOneLevelIsRefused) {
    const Folder folder;
    prepare_press(folder);
    write_hierarchy(folder / "block.h5",
                    make_hierarchy({test::block({4, 2, 2}, {0.2, 0.1, 0.1})}, "a block"));
    write_text(folder / "scene.yaml", press + "\n");
    EXPECT_EQ(livetet(folder, "solve scene.yaml").status, 0);
    std::string scene = press;
    scene.replace(scene.find("solver: {"), 9, "solver: {kind: multigrid, ");
    write_text(folder / "scene.yaml", scene);
    test::expect_refused(livetet(folder, "solve scene.yaml"),
                         {"solver.kind", "multigrid", "one level"});
}

TEST(Solve, OfSeveralRanksOneSaysWhatIsWrong) {
    const Folder folder;
    prepare_press(folder);
    std::string wrong = press;
    write_text(folder / "scene.yaml", wrong.replace(wrong.find("young_Pa"), 8, "yung_Pa"));
    for (const std::string command : {"solve scene.yaml", "solve none.yaml", "solve --whatever"}) {
        const auto outcome = livetet(folder, command, "timeout 60 mpirun --oversubscribe -n 2");
        EXPECT_EQ(outcome.status, 2) << command << outcome.err;
        EXPECT_NE(outcome.err.find("livetet:"), std::string::npos) << command;
        EXPECT_EQ(outcome.err.find("livetet:"), outcome.err.rfind("livetet:")) << command << "\n"
                                                                               << outcome.err;
    }
}

TEST(Solve, OfSeveralRanksAllHearOfAFullDiskAndNoneWaits) {
    const Folder folder;
    prepare_press(folder);
    write_text(folder / "scene.yaml", press + "\n");
    ASSERT_EQ(livetet(folder, "solve scene.yaml").status, 0);
    const std::string before = text_of(folder / "result.h5");
    // No file of more than so many kB; what Open MPI shares between ranks would be one (therefore
    // TCP).
    write_text(folder / "small_disk", "ulimit -f $1; shift; exec \"$@\"\n");
    std::size_t mesh_kB = 0;
    {
        const ResultReader result(folder / "result.h5");
        mesh_kB = ((4 << 20) + bytes_written(result.mesh()) + result.scene_text().size()) / 1024;
    }
    for (const auto& [size_kB, what] : {std::pair<std::size_t, std::string>{16, "the mesh"},
                                        {2000, "the mesh"},
                                        {mesh_kB + 6, "frame 0"}}) {
        const auto outcome = livetet(
            folder, "solve scene.yaml",
            fmt::format(
                "timeout 100 mpirun --oversubscribe --mca btl self,tcp -n 2 bash small_disk {}",
                size_kB));
        EXPECT_EQ(outcome.status, 2) << size_kB << outcome.err;
        EXPECT_NE(outcome.err.find("livetet: result.h5: no room on the disk for " + what),
                  std::string::npos)
            << size_kB << outcome.err;
        EXPECT_TRUE(text_of(folder / "result.h5") == before) << "a good result is kept";
    }
    const auto outcome =
        livetet(folder, "solve scene.yaml",
                "timeout 100 mpirun --oversubscribe --mca btl self,tcp -n 2 bash small_disk 20000");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_LT(std::filesystem::file_size(folder / "result.h5"), 2 * before.size())
        << "what was reserved is given back";
}

TEST(Solve, WhoEndsItLeavesTheOlderResultAndNoPartOfANewOne) {
    const Folder folder;
    prepare_press(folder);
    ASSERT_EQ(livetet(folder, "solve scene.yaml").status, 0);
    const std::string before = text_of(folder / "result.h5");
    write_text(
        folder / "long.yaml",
        press + "time: {scheme: newmark, step_s: 0.001, duration_s: 100}\noutput: {every: 1000}\n");
    write_text(folder / "ended",
               "#!/bin/sh\nsignal=$1\nshift\n\"$@\" &\nuntil ls -A | grep -q part; do sleep 0.1; "
               "done\nkill -$signal $!\nwait $!\n");
    std::filesystem::permissions(folder / "ended", std::filesystem::perms::owner_all);
    for (const int signal : {SIGTERM, SIGHUP}) {
        const auto outcome = livetet(folder, "solve long.yaml",
                                     fmt::format("env --default-signal ./ended {}", signal));
        EXPECT_EQ(outcome.status, 128 + signal) << outcome.err;
        EXPECT_EQ(outcome.err.find("PETSC"), std::string::npos) << outcome.err;
        for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
            EXPECT_EQ(entry.path().filename().string().find("part"), std::string::npos)
                << entry.path();
    }
    EXPECT_TRUE(text_of(folder / "result.h5") == before);
}

/// A coarse mesh that nothing held would be a singular matrix.
TEST(Solve, WhatIsHeldByAPatchThatIsSmallOnTheCoarsestMeshIsSolved) {
    const Folder folder;
    write_hierarchy(folder / "block.h5", make_hierarchy({test::block({16, 8, 8}, {0.2, 0.1, 0.1}),
                                                         test::block({8, 4, 4}, {0.2, 0.1, 0.1}),
                                                         test::block({4, 2, 2}, {0.2, 0.1, 0.1}),
                                                         test::block({2, 1, 1}, {0.2, 0.1, 0.1})},
                                                        "a block"));
    for (const double radius_mm : {13., 20., 30., 60.})
        for (const char* solver :
             {"multigrid, coarse: rediscretised", "multigrid, coarse: galerkin", "live"}) {
            write_text(
                folder / "scene.yaml",
                fmt::format(
                    "mesh: {{file: block.h5}}\nstrain: linear\nmaterials: [{{young_Pa: 5000, "
                    "poisson: 0.45}}]\n"
                    "fix: [{{sphere_mm: [60, 40, 0, {}]}}]\ngravity_m_per_s2: [0, 0, -0.01]\n"
                    "solver: {{kind: {}, relative_tolerance: 1e-6}}\noutput: {{file: none}}\n",
                    radius_mm, solver));
            const auto outcome = livetet(folder, "solve scene.yaml --json told.json");
            ASSERT_EQ(outcome.status, 0) << radius_mm << solver << outcome.err;
            const nlohmann::json told = nlohmann::json::parse(text_of(folder / "told.json"));
            EXPECT_LE(told.at("iterations").get<int>(), solver == std::string("live") ? 400 : 30)
                << radius_mm << solver;
        }
}

TEST(Solve, NamesThePartFileThatAKilledRunLeft) {
    const Folder folder;
    write_hierarchy(folder / "block.h5",
                    make_hierarchy({test::block({4, 2, 2}, {0.2, 0.1, 0.1})}, "a block"));
    test::write_text(folder / "scene.yaml",
                     "mesh: {file: block.h5}\nfix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]\n");
    test::write_text(folder / ".result.part4194305.h5", "");
    const auto outcome = livetet(folder, "solve scene.yaml");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.err.find(".result.part4194305.h5: a run that was killed"), std::string::npos)
        << outcome.err;
    EXPECT_TRUE(std::filesystem::exists(folder / ".result.part4194305.h5")) << "it may be of use";
}

TEST(Solve, SaysThatASmallMeshHasTooManyRanks) {
    const Folder folder;
    write_hierarchy(folder / "block.h5",
                    make_hierarchy({test::block({4, 2, 2}, {0.2, 0.1, 0.1})}, "a block"));
    test::write_text(folder / "scene.yaml",
                     "mesh: {file: block.h5}\nfix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]\n");
    const std::string warning = "1 rank would be as fast";
    const auto two = livetet(folder, "solve scene.yaml", "mpirun --oversubscribe -n 2");
    EXPECT_EQ(two.status, 0) << two.err;
    EXPECT_NE(two.err.find(warning), std::string::npos) << two.err;
    const auto one = livetet(folder, "solve scene.yaml");
    EXPECT_EQ(one.err.find(warning), std::string::npos) << one.err;
}

TEST(Solve, ProbesThatCannotBeWrittenAreSaidBeforeTheSolve) {
    const Folder folder;
    prepare_press(folder);
    std::string scene = press;
    scene.replace(scene.find("moved.csv"), 9, "none/moved.csv");
    write_text(folder / "scene.yaml", scene);
    expect_refused(livetet(folder, "solve scene.yaml"), {"none/moved.csv", "there is no folder"});
    EXPECT_FALSE(std::filesystem::exists(folder / "result.h5"));
}

TEST(Solve, ALogHasTheStagesOfTheRunAndItsPhasesInThem) {
    const Folder folder;
    prepare_press(folder);
    ASSERT_EQ(livetet(folder, "solve scene.yaml -log_view :log.txt").status, 0);
    const std::string log = text_of(folder / "log.txt");
    for (const char* stage : {"mesh", "set-up", "steps", "results"})
        EXPECT_NE(log.find(fmt::format(" Livetet {}: ", stage)), std::string::npos) << stage;
    const std::size_t steps = log.find("Event Stage 4: Livetet steps");
    ASSERT_NE(steps, std::string::npos);
    EXPECT_NE(log.find("LivetetAssembly", steps), std::string::npos);
    EXPECT_EQ(log.substr(0, steps).find("LivetetAssembly "), std::string::npos);
}

TEST(Solve, PetscsOptionsThatNameNothingAreTold) {
    const Folder folder;
    prepare_press(folder);
    expect_refused(livetet(folder, "solve scene.yaml -pc_type nonsense"),
                   {"PETSc's options", "-pc_type nonsense"});
    for (const char* bad :
         {"-ksp_max_it -5", "-mg_levels_1_ksp_type nonsense", "-ksp_monitor ascii:/nonexist/f"})
        expect_refused(livetet(folder, std::string("solve scene.yaml ") + bad),
                       {"PETSc cannot do this"});
    write_text(folder / "pipe", "exec 3> >(true)\nsleep 0.5\n\"$@\" >&3\n");
    EXPECT_EQ(livetet(folder, "solve scene.yaml -ksp_monitor", "bash pipe").status, 128 + SIGPIPE);
    for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
        EXPECT_EQ(entry.path().filename().string().find("part"), std::string::npos) << entry.path();
    for (const char* bad : {"pc_type jacobi", "-pc_type jacobi 3"}) {
        std::string scene = press;
        scene.replace(scene.find("solver: {"), 9,
                      fmt::format("solver: {{petsc_options: \"{}\", ", bad));
        write_text(folder / "other.yaml", scene);
        expect_refused(livetet(folder, "solve other.yaml"),
                       {"solver.petsc_options", bad, "an option's name"});
    }
    const auto outcome = livetet(folder, "solve scene.yaml -ksp_rtoll 1e-4 -ksp_max_it 500");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("PETSc option -ksp_rtoll was not used"), std::string::npos)
        << outcome.err;
    EXPECT_EQ(outcome.err.find("option -ksp_max_it was not used"), std::string::npos)
        << outcome.err;
}

/// Before the run has done its work, and once.
TEST(Solve, PetscsOptionsThatChangeNothingAreToldAtTheBegin) {
    const Folder folder;
    prepare_press(folder);
    const auto outcome = livetet(
        folder, "solve scene.yaml -ts_type beuler -pc_mg_levels 2 -pc_mg_cycle_type v -ksp_view");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const std::size_t done = outcome.err.find("100 %");
    ASSERT_NE(done, std::string::npos) << outcome.err;
    for (const char* warning :
         {"PETSc option -ts_type was not used", "PETSc option -pc_mg_levels changes nothing",
          "PETSc option -pc_mg_cycle_type changes nothing"}) {
        EXPECT_LT(outcome.err.find(warning), done) << outcome.err;
        EXPECT_EQ(outcome.err.find(warning), outcome.err.rfind(warning)) << outcome.err;
    }
    EXPECT_EQ(outcome.err.find("-ksp_view"), std::string::npos) << outcome.err;
}

TEST(Solve, ATimeLimitEndsARunWithItsLastState) {
    const Folder folder;
    prepare_press(folder);
    const auto limited = [&](const std::string& limit_s, const std::string& scene,
                             const std::string& before = "") {
        std::string text = scene;
        text.replace(text.find("solver: {"), 9, "solver: {time_limit_s: " + limit_s + ", ");
        write_text(folder / "limited.yaml", text);
        return livetet(folder, "solve limited.yaml --json told.json", before);
    };
    for (const char* ranks : {"", "mpirun --oversubscribe -n 2"}) {
        const auto outcome = limited("1e-6", press, ranks);
        EXPECT_EQ(outcome.status, 3) << outcome.err;
        EXPECT_NE(outcome.err.find("the time limit of 1e-06 s passed on the way to 1 of the load"),
                  std::string::npos)
            << outcome.err;
        const auto told = nlohmann::json::parse(text_of(folder / "told.json"));
        EXPECT_FALSE(told["converged"]);
        EXPECT_EQ(told["steps"].size(), 1u) << "repeated in parts all the same";
        EXPECT_EQ(told["linearisations"], 1);
    }
    const std::string moving = press + "time: {scheme: newmark, step_s: 0.01, duration_s: 0.1}\n";
    for (const char* limit_s : {"1e-12", "1e-6"}) {  // before the first step, on the way to it
        const auto outcome = limited(limit_s, moving);
        EXPECT_EQ(outcome.status, 3) << outcome.err;
        EXPECT_NE(outcome.err.find("the run ends at 0 s, expected 0.1 s"), std::string::npos)
            << outcome.err;
    }
}

TEST(Solve, GravityOnASceneFromAGmshFileAndADynamicRun) {
    const Folder folder;
    prepare_press(folder);
    write_text(folder / "swing.yaml",
               "mesh: {file: block.h5}\nmaterials: [{young_Pa: 5e5, poisson: 0.3, "
               "density_kg_per_m3: 1000}]\nfix: "
               "[{half_space_mm: [1, 0, 0, 1, 0, 0]}]\n"
               "gravity_m_per_s2: [0, 0, -9.81]\ntime: {scheme: newmark, step_s: 0.005, "
               "duration_s: 0.1}\nsolver: "
               "{newton_tolerance: 1e-6}\noutput: {file: swing.h5}\n");
    const auto outcome = livetet(folder, "solve swing.yaml");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const ResultReader result(folder / "swing.h5");
    ASSERT_EQ(result.times_s().size(), 20u);
    EXPECT_NEAR(result.times_s().back(), 0.1, 1e-12);
    // It falls first, and swings about the static droop: never farther than twice it.
    double least = 0;
    for (std::size_t k = 0; k < 20; ++k)
        for (const Vector3& u : result.displacement(k)) least = std::min(least, u.z());
    write_text(folder / "droop.yaml",
               "mesh: {file: block.h5}\nmaterials: [{young_Pa: 5e5, poisson: 0.3, "
               "density_kg_per_m3: 1000}]\nfix: "
               "[{half_space_mm: [1, 0, 0, 1, 0, 0]}]\ngravity_m_per_s2: [0, 0, -9.81]\noutput: "
               "{file: droop.h5}\n");
    ASSERT_EQ(livetet(folder, "solve droop.yaml").status, 0);
    double droop = 0;
    for (const Vector3& u : last_displacement(folder / "droop.h5")) droop = std::min(droop, u.z());
    // Timoshenko: q L^4 / (8 E I) + q L^2 / (2 k G A) = 5.9 mm; linear tets on this mesh are
    // stiffer.
    EXPECT_NEAR(droop, -0.0059, 0.0012);
    EXPECT_LT(least, 1.3 * droop);
    EXPECT_GT(least, 2.3 * droop);
}

TEST(Solve, ARankThatFailsTakesTheOthersDownWithItsMessage) {
    const Folder folder;
    prepare_press(folder);
    write_text(folder / "scene.yaml", press + "output: {file: nofolder/x.h5}\n");
    const auto outcome =
        livetet(folder, "solve scene.yaml", "timeout 60 mpirun --oversubscribe -n 2");
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_NE(outcome.err.find("no folder"), std::string::npos) << outcome.err;
}

TEST(Solve, ALinearSceneConvergesAtTheDefaults) {
    const Folder folder;
    prepare_press(folder);
    write_text(
        folder / "linear.yaml",
        "mesh: {file: block.h5}\nstrain: linear\nfix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]\n"
        "gravity_m_per_s2: [0, 0, -9.81]\n");
    const auto outcome = livetet(folder, "solve linear.yaml");
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
}

TEST(Solve, NotConvergedIsSaidAndExitsWith3AndWithoutAnyStateAnOlderResultStays) {
    const Folder folder;
    prepare_press(folder);
    ASSERT_EQ(livetet(folder, "solve scene.yaml").status, 0);
    const std::string result = text_of(folder / "result.h5"), moved = text_of(folder / "moved.csv");
    std::string scene = press;
    scene.replace(scene.find("solver: {"), 9, "solver: {max_newton: 1, ");
    write_text(folder / "scene.yaml", scene);
    const auto outcome = livetet(folder, "solve scene.yaml --json failed.json");
    EXPECT_EQ(outcome.status, 3);
    EXPECT_NE(outcome.out.find("NOT converged"), std::string::npos);
    EXPECT_NE(outcome.out.find("nothing: no state was reached"), std::string::npos);
    EXPECT_FALSE(nlohmann::json::parse(text_of(folder / "failed.json"))["converged"].get<bool>());
    EXPECT_TRUE(text_of(folder / "result.h5") == result);
    EXPECT_EQ(text_of(folder / "moved.csv"), moved);
}

TEST(Explain, SaysWhatIsBuiltAndWhatIsLeftOut) {
    const Folder folder;
    prepare_press(folder);
    const auto outcome = livetet(folder, "explain scene.yaml");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    for (const char* part : {"leaves out  mass, velocities", "leaves out  tracker",
                             "builds      rotations", "builds      coarse levels"})
        EXPECT_NE(outcome.out.find(part), std::string::npos) << part << outcome.out;
}

/// `press` with a line of its own instead of one of its keys.
std::string press_with(const std::string& key, const std::string& line) {
    std::string scene = press;
    if (const auto at = scene.find("\n" + key + ":"); at != std::string::npos) {
        scene.replace(at + 1, scene.find('\n', at + 1) - at - 1, line);
        return scene;
    }
    return scene + line + "\n";
}

TEST(Solve, TenNodesAndPressuresKeepTheVolumeOnOneRankAndTwo) {
    const Folder folder;
    prepare_press(folder);
    const std::string scene =
        press_with("materials", "materials: [{young_Pa: 5000, poisson: 0.4999}]") +
        "elements: P2\noutput: {fields: [stress, von_mises, strain_energy, volume_change, "
        "reactions]}\n";
    write_text(folder / "scene.yaml", scene);
    const auto one = livetet(folder, "solve scene.yaml --json one.json");
    ASSERT_EQ(one.status, 0) << one.err;
    const ResultReader result(folder / "result.h5");
    const TetMesh& mesh = result.mesh();
    EXPECT_EQ(mesh.edge_nodes.size(), mesh.tets.size());
    // Little volume is lost in the mean, though the patch is pressed by an eighth of the height.
    const auto change = result.field("volume_change", 0, 1);
    double lost = 0;
    for (std::size_t e = 0; e < change.size(); ++e)
        lost += change[e] * signed_volume(mesh, mesh.tets[e]);
    EXPECT_LT(std::abs(lost), 2e-3 * volume(mesh));
    // Forces balance, and the press is pushed back.
    const auto reactions = result.field("reactions", 0, 3);
    Vector3 sum = Vector3::Zero();
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
        sum += Eigen::Map<const Vector3>(&reactions[3 * n]);
    const auto json = nlohmann::json::parse(text_of(folder / "one.json"));
    const double pushed = json["reactions_N"]["drive[0]"][2];
    EXPECT_LT(pushed, -0.1);
    EXPECT_LT(sum.norm(), 1e-6 * std::abs(pushed));
    // Von Mises' stress is the stress's.
    const auto stress = result.field("stress", 0, 9), mises = result.field("von_mises", 0, 1);
    const auto* s = &stress[9 * 100];
    EXPECT_NEAR(mises[100],
                std::sqrt(0.5 * (std::pow(s[0] - s[4], 2) + std::pow(s[4] - s[8], 2) +
                                 std::pow(s[8] - s[0], 2)) +
                          3 * (s[1] * s[1] + s[2] * s[2] + s[5] * s[5])),
                1e-6 * mises[100]);
    EXPECT_NE(text_of(folder / "result.xdmf").find("Tetrahedron_10"), std::string::npos);

    const auto u1 = last_displacement(folder / "result.h5");
    const auto two = livetet(folder, "solve scene.yaml", "mpirun --oversubscribe -n 2");
    ASSERT_EQ(two.status, 0) << two.err;
    const auto u2 = last_displacement(folder / "result.h5");
    for (std::size_t n = 0; n < u1.size(); ++n) ASSERT_LT((u1[n] - u2[n]).norm(), 1e-8 * 0.012);
}

TEST(Solve, ASoftPatchPullsWithItsStiffnessAndATurnedOneTurns) {
    const Folder folder;
    prepare_press(folder);
    write_text(
        folder / "scene.yaml",
        press_with("drive",
                   "drive: [{box_mm: [199, -1, -1, 201, 101, 101], displacement_mm: [5, 0, 0], "
                   "stiffness_N_per_m: 30}]"));
    ASSERT_EQ(livetet(folder, "solve scene.yaml --json soft.json").status, 0);
    const auto u = last_displacement(folder / "result.h5");
    const TetMesh mesh = ResultReader(folder / "result.h5").mesh();
    double mean = 0;
    const auto end = test::nodes_where(mesh, [](const Vector3& x) { return x.x() > 0.1999; });
    for (const std::int32_t n : end) mean += u[n].x() / static_cast<double>(end.size());
    const double force =
        nlohmann::json::parse(text_of(folder / "soft.json"))["reactions_N"]["drive[0]"][0];
    EXPECT_NEAR(force, 30 * (5e-3 - mean), 1e-9);
    EXPECT_GT(mean, 1e-4);
    EXPECT_LT(mean, 4e-3);

    write_text(folder / "scene.yaml",
               press_with("drive",
                          "drive: [{box_mm: [199, -1, -1, 201, 101, 101], rotation_deg: "
                          "[40, 0, 0], displacement_mm: [3, 0, 0]}]"));
    ASSERT_EQ(livetet(folder, "solve scene.yaml").status, 0);
    const auto turned = last_displacement(folder / "result.h5");
    const Eigen::Matrix3d R =
        Eigen::AngleAxisd(40 * M_PI / 180, Vector3::UnitX()).toRotationMatrix();
    const Vector3 centre(0.2, 0.05, 0.05);
    for (const std::int32_t n : end)
        EXPECT_LT((mesh.nodes[n] + turned[n] -
                   (centre + R * (mesh.nodes[n] - centre) + Vector3(0.003, 0, 0)))
                      .norm(),
                  1e-12);
}

TEST(Solve, AdaptiveStepsFollowTheirTolerance) {
    const Folder folder;
    prepare_press(folder);
    const auto swing = [&](const std::string& time) {
        write_text(folder / "swing.yaml",
                   "mesh: {file: block.h5}\nmaterials: [{young_Pa: 5e4, poisson: 0.3, "
                   "density_kg_per_m3: 1000}]\nfix: "
                   "[{half_space_mm: [1, 0, 0, 1, 0, 0]}]\ngravity_m_per_s2: [0, 0, -3]\nsolver: "
                   "{newton_tolerance: "
                   "1e-8, relative_tolerance: 1e-5}\ntime: {duration_s: 0.3, " +
                       time + "}\n");
        const auto outcome = livetet(folder, "solve swing.yaml --json swing.json");
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return last_displacement(folder / "result.h5");
    };
    const auto reference = swing("scheme: newmark, step_s: 5e-4");
    double last = 1;
    for (const double tolerance : {0.1, 0.01}) {
        const auto u = swing("scheme: newmark, step_s: 0.01, adaptive_tolerance_mm: " +
                             std::to_string(tolerance));
        double error = 0;
        for (std::size_t n = 0; n < u.size(); ++n)
            error = std::max(error, (u[n] - reference[n]).norm());
        EXPECT_LT(error, 0.5 * last) << tolerance;
        last = error;
        const auto json = nlohmann::json::parse(text_of(folder / "swing.json"));
        double time = 0;
        for (const auto& step : json["steps"]) time = std::max(time, step["time_s"].get<double>());
        EXPECT_NEAR(time, 0.3, 1e-9);
    }
    EXPECT_LT(last, 1e-3);
    const auto alpha = swing("scheme: generalized_alpha, step_s: 2e-3, rho_inf: 0.9");
    double error = 0;
    for (std::size_t n = 0; n < alpha.size(); ++n)
        error = std::max(error, (alpha[n] - reference[n]).norm());
    EXPECT_LT(error, 1e-3);
}

TEST(Solve, AStaticSolveThatFindsNoEquilibriumKeepsTheLastOneAndExits3) {
    const Folder folder;
    prepare_press(folder);
    // Green's strain collapses in compression beyond 1 / sqrt 3: eight iterations are not enough.
    std::string scene = press_with(
        "drive", "drive: [{box_mm: [199, -1, -1, 201, 101, 101], displacement_mm: [-190, 0, 0]}]");
    scene.replace(scene.find("solver: {"), 9, "solver: {max_newton: 8, ");
    write_text(folder / "scene.yaml", scene + "strain: green\ntime: {load_steps: 8}\n");
    const auto outcome = livetet(folder, "solve scene.yaml --json failed.json");
    EXPECT_EQ(outcome.status, 3) << outcome.err;
    EXPECT_NE(outcome.err.find("no equilibrium was found beyond"), std::string::npos)
        << outcome.err;
    const auto json = nlohmann::json::parse(text_of(folder / "failed.json"));
    const double share = json["share"];
    EXPECT_GT(share, 0);
    EXPECT_LT(share, 1);
    const ResultReader result(folder / "result.h5");
    EXPECT_NEAR(result.times_s().back(), share, 1e-12);
    for (const Vector3& u : last_displacement(folder / "result.h5")) ASSERT_LE(u.norm(), 0.3);
}

TEST(Solve, StiffMaterialsConvergeToRoundOffAndPressuresDoNotSlowNewton) {
    const Folder folder;
    prepare_press(folder);
    const std::string scene =
        "mesh: {file: block.h5}\nfix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]\n"
        "solver: {kind: direct}\n";
    write_text(folder / "steel.yaml",
               scene +
                   "materials: [{young_Pa: 2.1e11, poisson: 0.3}]\n"
                   "loads: [{box_mm: [199, -1, -1, 201, 101, 101], traction_Pa: [1000, 0, 0]}]\n");
    const auto steel = livetet(folder, "solve steel.yaml --json steel.json");
    ASSERT_EQ(steel.status, 0) << steel.err;
    const auto forces =
        nlohmann::json::parse(text_of(folder / "steel.json"))["reactions_N"]["fix[0]"];
    EXPECT_NEAR(forces[0].get<double>(), -10, 1e-3);

    int newton_iterations[2] = {0, 0};
    for (const bool mixed : {false, true}) {
        write_text(
            folder / "bend.yaml",
            scene + "materials: [{young_Pa: 1e4, poisson: 0.4}]\nformulation: " +
                (mixed ? "mixed" : "displacement") +
                "\nloads: [{box_mm: [199, -1, -1, 201, 101, 101], traction_Pa: [0, 0, -200]}]\n");
        const auto bend = livetet(folder, "solve bend.yaml --json bend.json");
        ASSERT_EQ(bend.status, 0) << bend.err;
        newton_iterations[mixed] =
            nlohmann::json::parse(text_of(folder / "bend.json"))["linearisations"];
    }
    EXPECT_LE(newton_iterations[1], 2 * newton_iterations[0] + 4);
}

TEST(Solve, EachSetIsToldItsOwnForce) {
    const Folder folder;
    prepare_press(folder);
    write_text(
        folder / "two.yaml",
        press_with(
            "drive",
            "drive:\n- {box_mm: [199, -1, -1, 201, 101, 101], displacement_mm: [1, 0, 0], "
            "stiffness_N_per_m: 100}\n- {box_mm: [199, -1, -1, 201, 101, 101], displacement_mm: "
            "[3, 0, 0], stiffness_N_per_m: 100}"));
    ASSERT_EQ(livetet(folder, "solve two.yaml --json two.json").status, 0);
    const auto forces = nlohmann::json::parse(text_of(folder / "two.json"))["reactions_N"];
    const double first = forces["drive[0]"][0], second = forces["drive[1]"][0],
                 held = forces["fix[0]"][0];
    EXPECT_NEAR(second - first, 100 * 2e-3, 1e-9);
    EXPECT_NEAR(first + second + held, 0, 1e-6);
}

std::vector<std::string> files_in(const Folder& folder) {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
        names.push_back(entry.path().filename());
    std::sort(names.begin(), names.end());
    return names;
}

TEST(Solve, WithoutAFileNothingIsWritten) {
    const Folder folder;
    prepare_press(folder);
    std::string scene = press;
    scene.erase(scene.find("probes:"));
    write_text(folder / "scene.yaml", scene + "output: {file: none}\n");
    (void)livetet(folder, "scene");  // what the test itself keeps is there
    const auto before = files_in(folder);
    const auto outcome = livetet(folder, "solve scene.yaml");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("no result (output.file: none)"), std::string::npos) << outcome.out;
    EXPECT_EQ(files_in(folder), before);
    write_text(folder / "scene.yaml", scene +
                                          "time: {scheme: euler, step_s: 0.1, duration_s: "
                                          "0.2}\noutput: {file: none, checkpoint_every: 1}\n");
    test::expect_refused(livetet(folder, "solve scene.yaml"), {"output.file = none"});
}

TEST(Solve, AProfileSaysWhatEachPartTookAndWhatWasLeftOut) {
    const Folder folder;
    prepare_press(folder);
    const auto profile = [&](const std::string& keys) {
        std::map<std::string, nlohmann::json> parts;
        write_text(folder / "scene.yaml", press + keys);
        const auto outcome = livetet(folder, "solve scene.yaml --profile --json told.json");
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        const auto told = nlohmann::json::parse(text_of(folder / "told.json"));
        for (const auto& part : told.at("profile")) {
            parts[part.at("part")] = part;
            EXPECT_NE(outcome.out.find("\n" + part.at("part").get<std::string>() + " "),
                      std::string::npos)
                << outcome.out;
        }
        return parts;
    };
    const auto linear = profile("strain: linear\ntime: {load_steps: 4}\n");
    for (const char* part : {"rotations", "mass", "velocities", "pressures"})
        EXPECT_FALSE(linear.at(part).at("built")) << part;
    EXPECT_EQ(linear.at("rotations").at("times"), 0);
    EXPECT_EQ(linear.at("operators").at("times"), 1) << "four load steps, one operator";
    EXPECT_EQ(linear.at("preconditioner").at("times"), 1);
    EXPECT_GT(linear.at("linear solves").at("times"), 4);
    EXPECT_GT(linear.at("elements").at("bytes"), 1e5);
    const auto moving =
        profile("formulation: mixed\ntime: {scheme: newmark, step_s: 0.1, duration_s: 0.2}\n");
    for (const char* part : {"rotations", "mass", "velocities", "pressures", "coarse levels"}) {
        EXPECT_TRUE(moving.at(part).at("built")) << part;
        EXPECT_GT(moving.at(part).at("bytes"), 1000) << part;
    }
    EXPECT_GT(moving.at("operators").at("times"), 2);
}

/// A step that Newton's iterations do not suffice for is taken in parts, and the run goes on
/// from there.
TEST(Solve, ADynamicStepThatDoesNotConvergeIsTakenInParts) {
    const Folder folder;
    prepare_press(folder);
    std::string scene = press;
    scene.replace(scene.find("displacement_mm: [0, 2, -12]"), 28,
                  "displacement_mm: [0, 5, -40], ramp_s: 0.2");
    scene.replace(scene.find("solver: {"), 9, "solver: {max_newton: 4, ");
    write_text(folder / "scene.yaml",
               scene + "time: {scheme: euler, step_s: 0.1, duration_s: 0.2}\n");
    const auto outcome = livetet(folder, "solve scene.yaml --json told.json");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const auto told = nlohmann::json::parse(text_of(folder / "told.json"));
    int refused = 0;
    double time = 0;
    for (const auto& step : told.at("steps")) {
        if (!step.at("converged").get<bool>()) {
            ++refused;
            continue;
        }
        EXPECT_NEAR(step.at("time_s").get<double>() - step.at("step_s").get<double>(), time, 1e-12);
        time = step.at("time_s");
    }
    EXPECT_GT(refused, 0) << "else this test shows nothing";
    EXPECT_NEAR(time, 0.2, 1e-12);
    EXPECT_EQ(ResultReader(folder / "result.h5").frame_count(), 2u)
        << "parts of a step are no frames";
}

TEST(Solve, PartsOfALoadStepGrowAgain) {
    const Folder folder;
    prepare_press(folder);
    std::string scene = press;
    scene.replace(scene.find("displacement_mm: [0, 2, -12]"), 28, "displacement_mm: [0, 5, -40]");
    scene.replace(scene.find("solver: {"), 9, "solver: {max_newton: 4, ");
    write_text(folder / "scene.yaml", scene);
    const auto outcome = livetet(folder, "solve scene.yaml --json told.json");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    double before = 1, sum = 0;
    int grown = 0, refused = 0;
    const auto told = nlohmann::json::parse(text_of(folder / "told.json"));
    for (const auto& step : told.at("steps")) {
        const double part = step.at("step_s");
        if (!step.at("converged").get<bool>()) {
            ++refused;
            EXPECT_LE(part, 2.001 * before);
        } else {
            grown += part > 1.2 * before;
            before = part;
            sum += part;
        }
    }
    EXPECT_GT(refused, 0) << "else this test shows nothing";
    EXPECT_GT(grown, 0);
    EXPECT_NEAR(sum, 1, 1e-12);
}

}  // namespace
}  // namespace livetet
