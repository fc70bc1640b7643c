#include <gtest/gtest.h>
#include <signal.h>

#include <future>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "apps/bench/convergence_bodies.hpp"
#include "apps/bench/sampled_run.hpp"
#include "io/hierarchy_file.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

using nlohmann::json;
using test::expect_refused;
using test::Folder;
using test::livetet;
using test::text_of;
using test::write_text;

void prepare_load(const Folder& folder, const std::string& time = "") {
    write_hierarchy(folder / "block.h5", make_hierarchy({test::block({8, 4, 4}, {0.2, 0.1, 0.1}),
                                                         test::block({4, 2, 2}, {0.2, 0.1, 0.1})},
                                                        "a block"));
    write_text(folder / "points.csv", "name,x_mm,y_mm,z_mm\ntip,199,50,50\n");
    write_text(folder / "scene.yaml", R"(
mesh: {file: block.h5}
materials: [{young_Pa: 5000, poisson: 0.4}]
fix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]
loads: [{half_space_mm: [199, 0, 0, -1, 0, 0], force_N: [0, 0, -0.5]}]
probes: {points: points.csv, displacements: moved.csv}
)" + time);
}

/// The choices by what they vary and their name.
std::map<std::string, json> choices_of(const Folder& folder) {
    std::map<std::string, json> by_name;
    const json all = json::parse(text_of(folder / "w.json"));
    for (const json& choice : all.at("choices"))
        by_name[choice.at("varied").get<std::string>() + "|" +
                choice.at("name").get<std::string>()] = choice;
    return by_name;
}

TEST(Samples, DifferencesAreWeighedByVolumeAndTakenAtTimesThatBothHave) {
    const TetMesh mesh{
        {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2, 3}}, {}, {}, {}, {}};
    const SamplePoints points(mesh, {{"middle", {0.25, 0.25, 0.25}}});
    SampledRun a, b;
    a.times_s = {1, 2, 3};
    b.times_s = {2, 2.5, 3};
    a.displacement.assign(3, std::vector<Vector3>(5, Vector3::Zero()));
    b.displacement = a.displacement;
    a.displacement[0][0].x() = 100;  // at a time that b has not
    b.displacement[2][1].y() = 2;
    b.displacement[0][4].z() = 0.5;
    const Difference d = difference(points, a, b);
    EXPECT_DOUBLE_EQ(d.largest_m, 2);
    EXPECT_DOUBLE_EQ(d.l2_m, std::sqrt(4.0 / 8));
    EXPECT_DOUBLE_EQ(d.probes_m.at(0), 0.5);
}

TEST(WorkPrecision, FinerMeshesAndTighterSolvesAreNearerAndThePartsSayWhy) {
    const Folder folder;
    prepare_load(folder);
    const auto outcome = livetet(
        folder,
        "bench workprecision scene.yaml --repeats 1 --json w.json --csv w.csv --folder kept");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    auto all = choices_of(folder);
    const auto of = [&](const std::string& name, const char* key) {
        return all.at(name).at(key).get<double>();
    };
    const std::string fine = "P1, to 1e-04|level 0, P1, 1e-04",
                      coarse = "P1, to 1e-04|level 1, P1, 1e-04",
                      loose = "P1, to 1e-01|level 0, P1, 1e-01";
    EXPECT_LT(of(fine, "largest_mm"), 0.6 * of(coarse, "largest_mm"));
    EXPECT_LT(of("P2, to 1e-04|level 1, P2, 1e-04", "largest_mm"), of(fine, "largest_mm"))
        << "ten nodes on half the edges' number";
    EXPECT_GT(of(loose, "algebraic_mm"), 3 * of(fine, "algebraic_mm"));
    EXPECT_GT(of("strain model|level 0, P1, linear", "model_mm"), 20 * of(fine, "algebraic_mm"));
    EXPECT_EQ(of(fine, "model_mm"), 0);
    EXPECT_EQ(of(fine, "time_mm"), 0);
    for (const auto& [name, c] : all) {
        ASSERT_TRUE(c.at("converged").get<bool>()) << name << c;
        const double parts = of(name, "mesh_mm") + of(name, "time_mm") + of(name, "algebraic_mm") +
                             of(name, "model_mm");
        EXPECT_LE(of(name, "l2_mm"), parts * (1 + 1e-9)) << name;
        EXPECT_LE(of(name, "l2_mm"), of(name, "largest_mm")) << name;
        EXPECT_LE(c.at("probes_mm").at("tip").get<double>(), 1.5 * of(name, "largest_mm")) << name;
        EXPECT_GT(of(name, "total_s"), of(name, "setup_s")) << name;
        EXPECT_GT(of(name, "peak_bytes"), 1e7) << name;
    }
    for (const char* solver :
         {"multigrid, Galerkin", "live kernels", "BoomerAMG", "GAMG", "Cholesky", "ICC"})
        EXPECT_NEAR(of(std::string("solver|level 0, P1, ") + solver, "largest_mm"),
                    of(fine, "largest_mm"), 0.03 * of(fine, "largest_mm"))
            << solver;
    EXPECT_NE(outcome.out.find("cheapest with an error (largest) under 1 mm:"), std::string::npos)
        << outcome.out;
    const std::string csv = text_of(folder / "w.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'),
              static_cast<std::ptrdiff_t>(all.size()) + 1);
    EXPECT_NE(csv.find(",tip_mm,"), std::string::npos);
}

TEST(WorkPrecision, KeepsWhatIsDoneWhenItIsEnded) {
    const Folder folder;
    prepare_load(folder);
    auto run = std::async(std::launch::async, [&] {
        return livetet(folder, "bench workprecision scene.yaml --repeats 50 --csv w.csv",
                       "echo $$ > pid.txt && exec");
    });
    const auto rows = [&] {
        const std::string csv = text_of(folder / "w.csv");
        return std::count(csv.begin(), csv.end(), '\n');
    };
    while (rows() < 3 && run.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready)
        ;
    ASSERT_EQ(::kill(std::stoi(text_of(folder / "pid.txt")), SIGINT), 0);
    const auto outcome = run.get();
    EXPECT_NE(outcome.status, 0);
    EXPECT_NE(outcome.out.find("level 0, P1"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("ended after"), std::string::npos) << outcome.out;
    EXPECT_GE(rows(), 3);
}

TEST(WorkPrecision, AChoiceThatTakesTooLongIsGivenUp) {
    const Folder folder;
    prepare_load(folder);
    const auto outcome = livetet(folder,
                                 "bench workprecision scene.yaml --repeats 1 --json w.json --only "
                                 "\"level 1, P1, 1e-04\" --time-limit 0.01");
    EXPECT_EQ(outcome.status, 3) << outcome.err;
    for (const auto& [name, choice] : choices_of(folder))
        EXPECT_NE(choice.at("failure").get<std::string>().find("took longer than 0.01 s"),
                  std::string::npos)
            << name;
}

TEST(WorkPrecision, ADynamicSceneHasItsStepsAmongTheChoices) {
    const Folder folder;
    prepare_load(folder,
                 "time: {scheme: euler, step_s: 0.02, duration_s: 0.16, rayleigh_beta: 0.01}\n");
    const auto outcome =
        livetet(folder, "bench workprecision scene.yaml --repeats 1 --only Euler --json w.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    auto all = choices_of(folder);
    ASSERT_EQ(all.size(), 2u);
    const double twice = all.at("Euler|level 0, P1, Euler, 40 ms").at("time_mm"),
                 four_times = all.at("Euler|level 0, P1, Euler, 80 ms").at("time_mm");
    EXPECT_GT(four_times, 1.3 * twice);
    EXPECT_GT(twice, 0);
}

TEST(WorkPrecision, WhatIsWrongIsOneLine) {
    const Folder folder;
    prepare_load(folder);
    expect_refused(livetet(folder, "bench workprecision scene.yaml --only nonsense"),
                   {"--only nonsense", "no choice"});
    expect_refused(livetet(folder, "tune scene.yaml --error 0.5"), {"--error 0.5", "0.5mm"});
    expect_refused(livetet(folder, "tune scene.yaml --error 1mm --budget 12"),
                   {"--budget 12", "12ms"});
    expect_refused(livetet(folder, "tune scene.yaml --error 1mm -o scene.yaml"),
                   {"scene.yaml", "another file"});
    write_text(folder / "free.yaml", "mesh: {file: block.h5}\n");
    expect_refused(livetet(folder, "bench workprecision free.yaml"), {"the reference failed"});
}

/// Rows of `bench convergence` by "AGAINST|PRECONDITIONER|VALUE".
std::map<std::string, json> convergence_rows(const Folder& folder, const std::string& only) {
    const auto outcome = livetet(folder,
                                 "bench convergence --max-nodes 1100 --nodes 400 --json c.json "
                                 "--csv c.csv --folder kept --only \"" +
                                     only + "\"");
    EXPECT_EQ(outcome.status, 0) << "no mesh is large enough to judge by: " << outcome.err;
    std::map<std::string, json> rows;
    for (const json& row : json::parse(text_of(folder / "c.json"))) {
        const json& value = row.at("value");
        rows[row.at("against").get<std::string>() + "|" +
             row.at("preconditioner").get<std::string>() + "|" +
             (value.is_string() ? value.get<std::string>() : std::to_string(value.get<int>()))] =
            row;
    }
    return rows;
}

TEST(Convergence, CountsIterationsOfEveryPreconditionerAgainstWhatIsVaried) {
    const Folder folder;
    std::map<std::string, json> rows;
    std::string csv;
    for (const char* only :
         {"smoothing", "contrast, multigrid", "anisotropy, BoomerAMG", "nodes"}) {
        rows.merge(convergence_rows(folder, only));
        csv += text_of(folder / "c.csv");
    }
    const auto iterations = [&](const std::string& name) {
        return rows.at(name).at("iterations").get<double>();
    };
    EXPECT_LT(iterations("nodes|multigrid|1050"), 15);
    EXPECT_LT(iterations("nodes|multigrid, Galerkin|1050"), 15);
    EXPECT_LT(iterations("nodes|multigrid, nested|1050"), 15);
    EXPECT_GT(iterations("nodes|Jacobi|1050"), iterations("nodes|ICC|1050"));
    EXPECT_GT(iterations("nodes|ICC|1050"), 3 * iterations("nodes|multigrid|1050"));
    EXPECT_GT(iterations("smoothing|multigrid|1"), 1.5 * iterations("smoothing|multigrid|8"));
    EXPECT_GT(iterations("anisotropy|BoomerAMG|1"), 1);
    EXPECT_NEAR(rows.at("nodes|Jacobi|1050").at("factor").get<double>(),
                std::pow(1e-8, 1 / iterations("nodes|Jacobi|1050")), 1e-12);
    EXPECT_GT(iterations("contrast|multigrid|1"), 1);
    EXPECT_NE(csv.find("anisotropy,0.03"), std::string::npos);
    EXPECT_NE(csv.find("nodes,1050,\"GAMG\""), std::string::npos);
}

#ifdef LIVETET_IMAGES
TEST(Convergence, ABodyIsSolvedByEveryPreconditioner) {
    const Folder folder;
    auto rows = convergence_rows(folder, "part with holes");
    ASSERT_EQ(rows.size(), 7u);
    for (const auto& [name, row] : rows) {
        EXPECT_EQ(row.at("failure"), "") << name;
        EXPECT_GT(row.at("nodes").get<double>(), 200) << name;
        EXPECT_LT(row.at("nodes").get<double>(), 2000) << name;
    }
    const auto iterations = [&](const std::string& method) {
        return rows.at("body|" + method + "|part with holes").at("iterations").get<double>();
    };
    EXPECT_LE(iterations("automatic"), 40);
    EXPECT_EQ(iterations("automatic, one level"), iterations("direct")) << "so small a mesh";
    EXPECT_GT(iterations("GAMG"), iterations("automatic"));
    EXPECT_NE(text_of(folder / "c.csv").find("body,part with holes,\"GAMG\""), std::string::npos);
    // Only the largest part is meshed: a body in pieces has too small a volume.
    EXPECT_NEAR(1e6 * volume(read_hierarchy(folder / "kept" / "part_with_holes.h5").levels.front()),
                120e-3 * 80 * 20 - 20e-3 * std::numbers::pi * (4 * 64 + 400), 3);
}

TEST(Convergence, BodiesHaveTheVolumeOfTheirShapes) {
    // The tree: capsules of 11.3 ml without their ends, less where they overlap.
    const double wall_ml = 1e6 * 0.004 * 0.130 * 2 * std::numbers::pi / 3 * 0.2;
    const std::map<std::string, std::pair<double, double>> range_ml{
        {"organ", {550, 590}},
        {"vessel tree", {10.5, 12.5}},
        {"curved wall", {0.98 * wall_ml, 1.02 * wall_ml}},
        {"part with holes", {148, 154}}};
    ASSERT_EQ(convergence_bodies().size(), range_ml.size());
    for (const ConvergenceBody& body : convergence_bodies()) {
        constexpr int n = 120;  // points along each axis
        const Vector3 step = (body.high - body.low) / n;
        int inside = 0;
        for (int k = 0; k < n * n * n; ++k)
            inside +=
                body.contains(body.low + step.cwiseProduct(Vector3(k % n + 0.5, k / n % n + 0.5,
                                                                   k / (n * n) + 0.5)));
        const double ml = 1e6 * step.prod() * inside;
        const auto [least, most] = range_ml.at(body.name);
        EXPECT_GT(ml, least) << body.name;
        EXPECT_LT(ml, most) << body.name;
    }
}
#endif

TEST(Convergence, OnlyWhatIsAskedForIsSolved) {
    const Folder folder;
    const auto outcome = livetet(
        folder, "bench convergence --nodes 400 --only \"levels, multigrid, G\" --csv c.csv");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const std::string text = text_of(folder / "c.csv");
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1 + 3) << text;
    expect_refused(livetet(folder, "bench convergence --only lewels"), {"--only lewels"});
    expect_refused(livetet(folder, "bench convergence --only levels --figure c.png"),
                   {"--only levels", "--figure"});
    EXPECT_FALSE(std::filesystem::exists(folder / "c.png"));
}

TEST(Tune, WritesTheChoiceAsASceneThatSolvesAndSaysSoWhereNoneIsGoodEnough) {
    const Folder folder;
    prepare_load(folder);
    const Folder other("other");
    prepare_load(other);
    auto none = std::async(std::launch::async, [&] {
        return livetet(other, "tune scene.yaml --error 0.000001mm --repeats 1 -o none.yaml");
    });
    const auto outcome = livetet(folder, "tune scene.yaml --error 1.5mm --repeats 1 -o cheap.yaml");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("chosen"), std::string::npos) << outcome.out;
    EXPECT_TRUE(std::filesystem::exists(folder / "cheap.h5"));
    const auto solved = livetet(folder, "solve cheap.yaml");
    EXPECT_EQ(solved.status, 0) << solved.err << text_of(folder / "cheap.yaml");
    EXPECT_EQ(none.get().status, 3);
    EXPECT_FALSE(std::filesystem::exists(other / "none.yaml"));
}

}  // namespace
}  // namespace livetet
