#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "apps/report/report.hpp"
#include "geometry/matrix_rows.hpp"
#include "io/hierarchy_file.hpp"
#include "io/result_file.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

using nlohmann::json;
using test::expect_refused;
using test::Folder;
using test::livetet;
using test::text_of;

/// What a reader sees of a page, row by row: "cell|cell|cell".
std::vector<std::string> rows_of(const std::string& page) {
    std::vector<std::string> rows;
    for (std::size_t at = 0; (at = page.find("<tr>", at)) != std::string::npos;) {
        const std::size_t end = page.find("</tr>", at);
        std::string row;
        bool tag = false;
        for (const char c : page.substr(at, end - at)) {
            if (c == '<') tag = true;
            if (!tag) row += c;
            if (c == '>') {
                tag = false;
                if (row.empty() || row.back() != '|') row += '|';
            }
        }
        rows.push_back(row);
        at = end;
    }
    return rows;
}

bool has_row(const std::string& page, const std::string& row) {
    const auto rows = rows_of(page);
    return std::find(rows.begin(), rows.end(), "|" + row + "|") != rows.end();
}

/// A run of a block, pressed deeper from frame to frame; frame k took 10 + k ms.
RunResult made_run() {
    RunResult result;
    result.source = "a <b> & \"c\".h5";
    result.mesh = test::block({2, 2, 2}, {0.1, 0.1, 0.1});
    result.scene_text =
        "mesh: {file: m.h5}\nsolver: {kind: live}\ntrack: {source: press.igs.mha, sensors: [{tool: "
        "Tip, patch_radius_mm: 12}]}\n";
    for (int k = 0; k < 5; ++k) {
        RunFrame frame;
        frame.time_s = 7 + 0.1 * k;
        frame.frame_ms = 10 + k;
        frame.solve_ms = 3 + k;
        frame.press_mm = 2 * k;
        frame.sensors = {k < 2 ? 1.0 : 0.0, k < 2 ? 0.0 : 1.0, 0, 0, 0, 0};
        result.frames.push_back(frame);
    }
    result.displacement = [nodes = result.mesh.nodes.size()](std::size_t) {
        return std::vector<Vector3>(nodes, Vector3::Zero());
    };
    result.info.samples = result.info.frames = 5;
    result.info.tets = result.mesh.tets.size();
    result.info.nodes = result.mesh.nodes.size();
    result.info.levels = 3;
    result.info.budget_ms = 100;
    result.info.fre_mm = 0.28;
    result.info.solver = "cg + mg, 3 levels, rediscretised";
    result.info.version = "0.0.7";
    result.info.fiducials = {{"F<1>", 0.31, 0.52}};
    return result;
}

TEST(ReportPage, HoldsTheFiguresOfTheJson) {
    const Report report = make_report(made_run());
    const std::string page = report_page(report, {});
    const json figures = json::parse(report_json(report));
    for (const auto& [name, key] :
         {std::pair{"whole frame [ms]", "frame_ms"}, {"solve [ms]", "solve_ms"}}) {
        const json& d = figures["frames"][key];
        EXPECT_TRUE(has_row(page, fmt::format("{}|{:.2f}|{:.2f}|{:.2f}|{:.2f}|{:.2f}", name,
                                              d["median"].get<double>(), d["mean"].get<double>(),
                                              d["p95"].get<double>(), d["p99"].get<double>(),
                                              d["worst"].get<double>())))
            << page;
    }
    EXPECT_TRUE(has_row(page, "whole frame [ms]|12.00|12.00|13.80|13.96|14.00"));
    EXPECT_TRUE(has_row(page, "F&lt;1&gt;|0.31|0.52"));
    EXPECT_TRUE(has_row(page, "FRE (RMS of the residuals)|0.28"));
    EXPECT_TRUE(has_row(page, "placing|2 frames"));
    EXPECT_TRUE(has_row(page, "following|3 frames"));
    EXPECT_TRUE(has_row(page, "Tip|a patch of 12 mm radius follows its translation, rigidly"));
    EXPECT_TRUE(has_row(page, "mesh|48 tets, 27 nodes, 3 levels"));
    EXPECT_TRUE(has_row(page, "coarse levels|2 of them, assembled with their own rotations"));
    EXPECT_NE(page.find("run by livetet 0.0.7"), std::string::npos);
    EXPECT_NE(page.find("a &lt;b&gt; &amp; &quot;c&quot;.h5"), std::string::npos);
}

TEST(ReportPage, HoldsTheStatedErrors) {
    EXPECT_EQ(report_page(make_report(made_run()), {}).find("Stated error"), std::string::npos);
    RunResult run = made_run();
    run.targets = {"T<1>"};
    for (std::size_t k = 0; k < run.frames.size(); ++k) {
        FrameStatement& statement = run.frames[k].statement;
        statement.targets.resize(1);
        statement.targets[0].radius_95 = 1e-3 * static_cast<double>(k + 1);
        statement.targets[0].by_source.fill(0.0625e-6);
        statement.missing.add(ErrorSource::law);
        if (k == 0) statement.missing.add(ErrorSource::elements);
    }
    const std::string page = report_page(make_report(run), {});
    EXPECT_TRUE(has_row(page, "95 % radius|median|largest")) << page;
    EXPECT_TRUE(has_row(page, "T&lt;1&gt;|3.00|5.00"));
    EXPECT_TRUE(has_row(page, "T&lt;1&gt;|0.25|0.25|0.25|0.25|0.25|0.25|0.25|-|0.25"));
    EXPECT_NE(page.find("missing in 100.0 % of the frames: elements in 1, law in 5"),
              std::string::npos);
}

TEST(ReportPage, NeedsNoOtherFileAndShowsNoNameAsMarkup) {
    const std::vector<PagePicture> pictures{{"An <organ>", "iVBORw0KGgo="}};
    const std::string page = report_page(make_report(made_run()), pictures);
    EXPECT_NE(
        page.find("<img alt=\"An &lt;organ&gt;\" src=\"data:image/png;base64,iVBORw0KGgo=\">"),
        std::string::npos);
    for (const char* outside : {"http", "<script", "<link", "url(", "F<1>"})
        EXPECT_EQ(page.find(outside), std::string::npos) << outside;
    for (const char* tag : {"table", "section", "figure", "ul", "body", "html"}) {
        const auto count = [&](const std::string& what) {
            std::size_t n = 0;
            for (std::size_t at = 0; (at = page.find(what, at)) != std::string::npos; ++at) ++n;
            return n;
        };
        EXPECT_EQ(count(std::string("<") + tag + ">") + count(std::string("<") + tag + " "),
                  count(std::string("</") + tag + ">"))
            << tag;
    }
}

TEST(ReportPage, OfARunWhoseSceneIsNotKnownLeavesOutWhatItSays) {
    RunResult run = made_run();
    run.scene_text = "mesh: {file: m.h5}\nkey_of_a_later_version: 1\n";
    const std::string page = report_page(make_report(run), {}, "no X server");
    EXPECT_EQ(page.find("What was left out"), std::string::npos);
    EXPECT_NE(page.find("Pictures are left out: no X server."), std::string::npos);
    EXPECT_NE(report_page(make_report(made_run()), {}).find("What was left out"),
              std::string::npos);
}

/// A result of a tracked run as the recorder writes it.
void write_run(const std::filesystem::path& path) {
    const TetMesh mesh = test::block({4, 4, 4}, {0.1, 0.1, 0.1});
    ResultWriter writer(path, mesh, made_run().scene_text);
    for (int k = 0; k < 5; ++k) {
        std::vector<Vector3> u;
        for (const Vector3& x : mesh.nodes)
            u.push_back(Vector3(0, 0, -0.02 * k * x.z() / 0.1 * (x.z() > 0.09)));
        writer.append(7 + 0.1 * k, u);
        writer.append_values("tracker_from_image",
                             matrix_rows(Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()));
        for (const auto& [name, value] : {std::pair{"frame_ms", 10.0 + k},
                                          {"operator_ms", 1.0},
                                          {"forces_ms", 1.0},
                                          {"solve_ms", 2.0},
                                          {"iterations", 1.0},
                                          {"residual", 1e-3},
                                          {"press_mm", 20.0 * k},
                                          {"registration_status", 1.0},
                                          {"converged", 1.0}})
            writer.append_values(name, {{value}});
        writer.append_values("sensors", std::vector<double>{0, 1, 0, 0, 0, 0});
    }
    writer.write_text(
        "run",
        R"({"samples": 5, "frames": 5, "missed": 0, "budget_ms": 66, "fre_mm": 0.28, "fiducials": [], "tets": 384,
                                "nodes": 125, "levels": 3, "solver": "cg + mg, 3 levels, rediscretised", "version": "0.0.7"})");
    writer.close();
}

TEST(ReportPage, IsWrittenByTheCommandWithItsPicturesInIt) {
    const Folder folder;
    write_run(folder / "result.h5");
    const auto outcome =
        livetet(folder, "report result.h5 -o page.html --json figures.json", "env -u DISPLAY");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const std::string page = text_of(folder / "page.html");
    EXPECT_TRUE(has_row(page, "whole frame [ms]|12.00|12.00|13.80|13.96|14.00"));
    EXPECT_EQ(json::parse(text_of(folder / "figures.json"))["frames"]["frame_ms"]["worst"], 14);
    EXPECT_FALSE(std::filesystem::exists(folder / "result.report"));
    std::size_t pictures = 0;
    for (std::size_t at = 0;
         (at = page.find("data:image/png;base64,iVBORw0KGgo", at)) != std::string::npos; ++at)
        ++pictures;
#ifdef LIVETET_IMAGES
    EXPECT_EQ(pictures, 2u) << outcome.err;
    const auto without =
        livetet(folder, "report result.h5 -o without.html", "env -u DISPLAY PATH=/nowhere");
    EXPECT_EQ(without.status, 0);
    EXPECT_EQ(without.err, "pictures left out: there is no X server, and Xvfb is not installed\n");
    EXPECT_NE(text_of(folder / "without.html")
                  .find("Pictures are left out: there is no X server, and Xvfb is not installed"),
              std::string::npos);
#else
    EXPECT_NE(page.find("Pictures are left out: "), std::string::npos);
#endif
    ASSERT_EQ(livetet(folder, "report result.h5 -o bare.html --no-pictures").status, 0);
    EXPECT_EQ(text_of(folder / "bare.html").find("data:image"), std::string::npos);
    expect_refused(livetet(folder, "report result.h5 -o nofolder/page.html"), {"nofolder"});
}

TEST(ReportFolder, BelongsToItsResultAndHoldsNothingOfAnotherRun) {
    const Folder folder;
    write_run(folder / "first.h5");
    write_run(folder / "second.h5");
    for (const char* run : {"first", "second"})
        ASSERT_EQ(livetet(folder, fmt::format("report {}.h5", run), "env -u DISPLAY").status, 0);
    EXPECT_TRUE(std::filesystem::exists(folder / "first.report/report.json"));
    EXPECT_TRUE(std::filesystem::exists(folder / "second.report/report.txt"));
    EXPECT_FALSE(std::filesystem::exists(folder / "report"));

    for (const char* old : {"organ.png", "body.png", "target_error.png", "notes.txt"})
        test::write_text(folder / "first.report" / old, "old");
    ASSERT_EQ(livetet(folder, "report first.h5 --no-pictures").status, 0);
    for (const char* old : {"organ.png", "body.png", "target_error.png"})
        EXPECT_FALSE(std::filesystem::exists(folder / "first.report" / old)) << old;
    EXPECT_EQ(text_of(folder / "first.report/notes.txt"), "old") << "the user's own";
}

TEST(ReportFolder, MayHaveADotInItsName) {
    const Folder folder;
    write_run(folder / "result.h5");
    ASSERT_EQ(livetet(folder, "report result.h5 --no-pictures -o rep_s0.3").status, 0);
    EXPECT_TRUE(std::filesystem::exists(folder / "rep_s0.3/report.txt"));
    expect_refused(livetet(folder, "report result.h5 --no-pictures -o report.pdf"),
                   {"report.pdf", "folder, or one page (.html)"});
}

TEST(SolveReport, SaysOfASolveWhatTheSolveSaid) {
    const Folder folder;
    write_hierarchy(folder / "block.h5", make_hierarchy({test::block({8, 4, 4}, {0.2, 0.1, 0.1}),
                                                         test::block({4, 2, 2}, {0.2, 0.1, 0.1})},
                                                        "a block"));
    test::write_text(folder / "swing.yaml", R"(
mesh: {file: block.h5}
materials: [{young_Pa: 5000, poisson: 0.45}]
fix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]
loads: [{half_space_mm: [199, 0, 0, -1, 0, 0], force_N: [0, 0, -0.5]}]
time: {scheme: newmark, step_s: 0.01, duration_s: 0.3}
)");
    ASSERT_EQ(livetet(folder, "solve swing.yaml --json solve.json").status, 0);
    const auto outcome =
        livetet(folder, "report result.h5 -o page.html --json figures.json", "env -u DISPLAY");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const json solved = json::parse(text_of(folder / "solve.json")),
               figures = json::parse(text_of(folder / "figures.json"));
    for (const char* key : {"tets", "nodes", "levels", "solver", "converged", "solve_s", "steps",
                            "reactions_N", "version"})
        EXPECT_EQ(figures.at(key), solved.at(key)) << key;
    EXPECT_NEAR(figures.at("last_displacement_mm").get<double>(),
                solved.at("largest_displacement_mm").get<double>(), 1e-9)
        << "of the last frame";
    EXPECT_GE(figures.at("largest_displacement_mm").get<double>(),
              figures.at("last_displacement_mm").get<double>());
    const std::string page = text_of(folder / "page.html");
    const json& last = solved.at("steps").back();
    EXPECT_TRUE(has_row(
        page, fmt::format("0.3|0.01|{}|{}|{:.1e}|{:.3g}|{:.3f}", last["linearisations"].get<int>(),
                          last["iterations"].get<int>(), last["imbalance"].get<double>(),
                          last["time_error_mm"].get<double>(), last["seconds"].get<double>())))
        << page;
    EXPECT_NE(page.find("One in 2 of 30 steps. Imbalance"), std::string::npos) << page;
    EXPECT_NE(page.find("What was left out"), std::string::npos);
    EXPECT_NE(outcome.out.find("Converged in 30 steps, "), std::string::npos) << outcome.out;
    std::size_t pictures = 0;
    for (std::size_t at = 0;
         (at = page.find("data:image/png;base64,iVBORw0KGgo", at)) != std::string::npos; ++at)
        ++pictures;
#ifdef LIVETET_IMAGES
    EXPECT_EQ(pictures, 1u) << outcome.err;
#endif
    EXPECT_TRUE(has_row(page, "coarse levels|1 of them, assembled with their own rotations"))
        << page;
    ASSERT_EQ(livetet(folder, "report result.h5 --no-pictures").status, 0);
    EXPECT_NE(text_of(folder / "result.report/report.txt").find("REPORT OF A SOLVE"),
              std::string::npos);
    expect_refused(livetet(folder, "report result.h5 --truth figures.json"), {"figures.json"});
}

/// Targets 0, 1, 2, 3 move by 0, 2, 4, 6 mm in truth; the result moves all by 4 mm.
TEST(SolveReport, ComparesItsLastFrameWithTheDeepestPressOfATruth) {
    const Folder folder;
    const TetMesh mesh = test::block({2, 2, 2}, {0.1, 0.1, 0.1});
    Truth truth;
    truth.depths = {0.005, 0.01};
    for (int i = 0; i < 4; ++i) {
        const Vector3 down(0, 0, -0.002 * i);
        truth.targets.push_back(
            {fmt::format("T{}", i), Vector3(0.02 + 0.02 * i, 0.05, 0.05), {down / 2, down}});
    }
    truth.samples.push_back({});
    write_truth(folder / "truth.json", truth);
    ResultWriter writer(folder / "result.h5", mesh, "");
    for (const double z : {-0.001, -0.004})
        writer.append(-z, std::vector<Vector3>(mesh.nodes.size(), Vector3(0, 0, z)));
    writer.close();
    const auto outcome =
        livetet(folder, "report result.h5 --truth truth.json --json figures.json --no-pictures");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const json targets = json::parse(text_of(folder / "figures.json"))["targets"];
    EXPECT_EQ(targets["moving"], 2);
    EXPECT_EQ(targets["targets"], 4);
    EXPECT_NEAR(targets["depth_mm"].get<double>(), 10, 1e-9);
    EXPECT_NEAR(targets["rms_mm"].get<double>(), std::sqrt(2.0), 1e-6);
    EXPECT_NEAR(targets["worst_mm"].get<double>(), 2, 1e-6);
    EXPECT_NEAR(targets["rigid_rms_mm"].get<double>(), std::sqrt(26.0), 1e-6);
    EXPECT_NE(outcome.out.find("1.41 mm"), std::string::npos) << outcome.out;
    for (TruthTarget& t : truth.targets)
        for (Vector3& u : t.displacement) u /= 10;
    write_truth(folder / "truth.json", truth);
    expect_refused(livetet(folder, "report result.h5 --truth truth.json"),
                   {"--truth", "4 targets", "3 mm"});
}

TEST(SolveReport, OfAResultThatSaysLittleSaysWhatItMayAndOfOneThatIsDamagedNothing) {
    const Folder folder;
    const TetMesh mesh = test::block({1, 1, 1}, {0.1, 0.1, 0.1});
    for (const auto& [name, text] : {std::pair{"old.h5", ""},
                                     {"cut.h5", "{\"solver\": \"cg\", \"levels\""},
                                     {"odd.h5", "{\"solver\": 3}"}}) {
        ResultWriter writer(folder / name, mesh, "");
        writer.append(0, std::vector<Vector3>(mesh.nodes.size(), Vector3(0, 0.003, 0.004)));
        if (*text) writer.write_text("solve", text);
        writer.close();
    }
    const auto outcome = livetet(folder, "report old.h5 -o page.html --no-pictures");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(text_of(folder / "page.html").find("The body moves by 5.000 mm at most."),
              std::string::npos);
    EXPECT_EQ(text_of(folder / "page.html").find("onverged"), std::string::npos);
    for (const char* name : {"cut.h5", "odd.h5"})
        expect_refused(livetet(folder, std::string("report ") + name),
                       {name, "description of the solve"});
}

TEST(SolveReport, LeavesOutStepsThatWereDoneAgainAndSaysWhereARunWasTakenUp) {
    const Folder folder;
    const TetMesh mesh = test::block({1, 1, 1}, {0.1, 0.1, 0.1});
    ResultWriter writer(folder / "result.h5", mesh, "");
    writer.append(0.5, std::vector<Vector3>(mesh.nodes.size(), Vector3(0, 0.003, 0.004)));
    writer.write_text(
        "solve",
        R"({"solver": "cg + mg, 2 levels, rediscretised", "version": "1", "failure": "", "levels": 2, "ranks": 1, "converged": true,
        "is_static": false, "restarted_at_s": 0.3, "mesh_s": 0, "setup_s": 0, "solve_s": 2, "peak_bytes": 1e8, "reactions_N": {"fix[0]": [1, null, 3]}, "steps": [
        {"time_s": 0.5, "step_s": 0.2, "seconds": 1, "imbalance": 1e-9, "time_error_mm": 9, "linearisations": 3, "iterations": 30, "converged": true, "kept": false},
        {"time_s": 0.4, "step_s": 0.1, "seconds": 1, "imbalance": null, "time_error_mm": 0.5, "linearisations": 2, "iterations": 20, "converged": true, "kept": true}]})");
    writer.close();
    const auto outcome = livetet(folder, "report result.h5 -o page.html --no-pictures");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const std::string page = text_of(folder / "page.html");
    for (const char* words :
         {"Converged in 1 step, 5 Newton iterations, 50 Krylov iterations",
          "Estimated error of a time step: at most 0.5 mm", "restarted at 0.3 s",
          "1 more were tried, and repeated with other lengths."})
        EXPECT_NE(page.find(words), std::string::npos) << words << "\n" << page;
    EXPECT_TRUE(has_row(page, "0.4|0.1|2|20|nan|0.5|1.000"));
    EXPECT_FALSE(has_row(page, "0.5|0.2|3|30|1.0e-09|9|1.000"));
    EXPECT_TRUE(has_row(page, "fix[0]|1|nan|3"));
}

}  // namespace
}  // namespace livetet
