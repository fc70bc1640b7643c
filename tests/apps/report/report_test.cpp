#include "apps/report/report.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include <cmath>
#include <functional>
#include <numeric>
#include <sstream>

#include "apps/report/truth_match.hpp"
#include "base/error.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

using nlohmann::json;

/// A block of 10 cm with four targets, pressed 10 mm deep from 2 s to 3 s. Truly, target i moves i
/// * 2 mm downwards at full depth: two of the four (4 and 6 mm) move more than 3 mm.
Truth make_truth() {
    Truth truth;
    truth.depths = {0.005, 0.01};
    for (int i = 0; i < 4; ++i) {
        const Vector3 down(0, 0, -0.002 * i);
        truth.targets.push_back(
            {"T-" + std::to_string(i), Vector3(0.02 + 0.02 * i, 0.05, 0.05), {down / 2, down}});
    }
    for (int k = 0; k <= 40; ++k) {
        TruthSample sample;
        sample.time_s = 100 + 0.1 * k;
        sample.depth = k >= 20 && k <= 30 ? 0.01 : 0;
        sample.tracker_from_image.translation = {0.3, 0.01 * k, 0};
        truth.samples.push_back(sample);
    }
    return truth;
}

/// A run that registers 3 mm off along x, always, and follows the press by `share` of the true
/// motion of T-2 (4 mm) at every node.
RunResult make_result(const Truth& truth, double share) {
    RunResult result;
    result.source = "made.h5";
    result.mesh = test::block({2, 2, 2}, {0.1, 0.1, 0.1});
    for (const TruthSample& sample : truth.samples) {
        RunFrame frame;
        frame.time_s = sample.time_s;
        frame.tracker_from_image = sample.tracker_from_image;
        frame.tracker_from_image.translation.x() += 0.003;
        frame.press_mm = 1e3 * sample.depth;
        result.frames.push_back(frame);
    }
    const std::size_t nodes = result.mesh.nodes.size();
    result.displacement = [truth, share, nodes](std::size_t k) {
        return std::vector<Vector3>(nodes, Vector3(0, 0, -0.4 * share * truth.samples[k].depth));
    };
    result.info.samples = 41;
    result.info.frames = 41;
    result.info.budget_ms = 100;
    return result;
}

std::string message_of(const std::function<void()>& run) {
    try {
        run();
    } catch (const Error& e) {
        return e.what();
    }
    return "";
}

TEST(Distribution, OfOneToAHundredIsKnown) {
    std::vector<double> values(100);
    std::iota(values.rbegin(), values.rend(), 1);
    const Distribution d = distribution(values);
    EXPECT_EQ(d.count, 100U);
    EXPECT_DOUBLE_EQ(d.median, 50.5);
    EXPECT_NEAR(d.p95, 95.05, 1e-12);
    EXPECT_NEAR(d.p99, 99.01, 1e-12);
    EXPECT_EQ(d.worst, 100);
    EXPECT_NEAR(d.mean, 50.5, 1e-12);
    EXPECT_NEAR(d.rms, std::sqrt(338350.0 / 100), 1e-12);
}

TEST(Distribution, OfNothingIsZero) { EXPECT_EQ(distribution({}).count, 0U); }

TEST(Report, CountsFramesOverBudgetMissedHeldAndNotConverged) {
    RunResult result = make_result(make_truth(), 1);
    result.info.missed = 7;
    for (std::size_t k = 0; k < result.frames.size(); ++k) {
        result.frames[k].frame_ms = static_cast<double>(k);  // 0 to 40
        result.frames[k].iterations = k < 30 ? 4 : 6;
    }
    result.frames[3].frame_ms = 101;
    result.frames[5].converged = false;
    result.frames[4].turned_elements = 2;
    result.frames[6].registration_held = true;
    const Report report = make_report(result);
    EXPECT_EQ(report.run.missed, 7U);
    EXPECT_EQ(report.frames.over_budget, 1U);
    EXPECT_EQ(report.frames.not_converged, 1U);
    EXPECT_EQ(report.frames.turned_over, 1U);
    EXPECT_EQ(report.frames.registration_held, 1U);
    EXPECT_EQ(report.frames.frame_ms.worst, 101);
    EXPECT_DOUBLE_EQ(report.frames.frame_ms.median, 21);  // 3 went to the top
    EXPECT_EQ(report.frames.iterations.median, 4);
    EXPECT_EQ(report.frames.iterations.worst, 6);
    EXPECT_EQ(report.deepest_frame, 20U);
    EXPECT_FALSE(report.truth);
}

/// Also where nothing is pressed, so that no frame is the deepest.
TEST(Report, AFrameThatIsFarBeyondTheBodyIsTold) {
    RunResult result;
    result.source = "made.h5";
    result.scene_text =
        "mesh: {file: block.h5}\nfix: [{half_space_mm: [0, 0, 0, 1, 0, 0]}]\n"
        "track: {source: press.igs.mha, registration: registration.json}\n";
    result.mesh = test::block({2, 2, 2}, {0.1, 0.1, 0.1});
    result.frames.resize(400);
    for (std::size_t k = 0; k < 400; ++k) result.frames[k].time_s = 0.1 * static_cast<double>(k);
    for (const double far : {0.001, 0.5}) {
        result.displacement = [far, n = result.mesh.nodes.size()](std::size_t k) {
            return std::vector<Vector3>(n, Vector3(k > 200 && k < 240 ? far : 0, 0, 0));
        };
        const std::string text = report_text(make_report(result, nullptr));
        EXPECT_EQ(text.find("500 mm, is above the body's size") != std::string::npos, far > 0.1)
            << text;
    }
}

TEST(Report, ARigidErrorAddsToTheMotionThatIsNotFollowed) {
    const Truth truth = make_truth();
    const TargetErrors e = compare_with_truth(make_result(truth, 1), truth);
    EXPECT_EQ(e.targets, 4U);
    EXPECT_EQ(e.moving, 2U);  // 4 and 6 mm
    EXPECT_EQ(e.deepest_frames, 11U);
    EXPECT_EQ(e.rigid_mm.count, 22U);
    // 3 mm sideways with 4 mm or 6 mm down: squares 25 and 45
    EXPECT_NEAR(e.rigid_mm.rms, std::sqrt(35.0), 1e-9);
    EXPECT_NEAR(e.rigid_mm.worst, std::sqrt(45.0), 1e-9);
    // followed by 4 mm: squares 9 and 9 + 4
    EXPECT_NEAR(e.deforming_mm.rms, std::sqrt(11.0), 1e-9);
    EXPECT_NEAR(e.gain(), std::sqrt(35.0 / 11.0), 1e-9);
    EXPECT_NEAR(e.registration_mm.rms, 3, 1e-9);
    EXPECT_NEAR(e.registration_mm.worst, 3, 1e-9);
    EXPECT_NEAR(e.deformation_mm.rms, std::sqrt(2.0), 1e-9);  // 0 and 2
}

TEST(Report, AModelThatDoesNotFollowGainsNothing) {
    const Truth truth = make_truth();
    const TargetErrors e = compare_with_truth(make_result(truth, 0), truth);
    EXPECT_NEAR(e.gain(), 1, 1e-12);
}

TEST(Report, TheSeriesHasAllFramesInOrder) {
    const Truth truth = make_truth();
    const TargetErrors e = compare_with_truth(make_result(truth, 1), truth);
    ASSERT_EQ(e.samples.size(), 41U);
    EXPECT_NEAR(e.samples[0].rigid_mm, 3, 1e-9);
    EXPECT_NEAR(e.samples[25].press_mm, 10, 1e-9);
    EXPECT_NEAR(e.samples[25].deforming_mm, std::sqrt(11.0), 1e-9);
}

TEST(Report, AtRestAModelThatMovesTargetsIsTold) {
    const Truth truth = make_truth();
    RunResult result = make_result(truth, 1);
    EXPECT_NEAR(compare_with_truth(result, truth).rest.organ_travel_mm, 400, 1e-9);
    EXPECT_EQ(compare_with_truth(result, truth).rest.frames, 30U);
    EXPECT_EQ(compare_with_truth(result, truth).rest.moved_mm.worst, 0);
    EXPECT_TRUE(compare_with_truth(result, truth).rest.explained());
    const std::size_t nodes = result.mesh.nodes.size();
    result.displacement = [nodes](std::size_t) {
        return std::vector<Vector3>(nodes, Vector3(0, 0.004, 0));
    };
    const RestErrors rest = compare_with_truth(result, truth).rest;
    EXPECT_NEAR(rest.moved_mm.rms, 4, 1e-9);
    EXPECT_FALSE(rest.explained());  // the registration is off by 3 mm only
}

TEST(Report, ALateRegistrationIsSeenAsLag) {
    const Truth truth = make_truth();
    RunResult result = make_result(truth, 1);
    // 0.1 m/s along y: 5 ms behind is 0.5 mm
    for (RunFrame& frame : result.frames)
        frame.tracker_from_image.translation += Vector3(-0.003, -0.0005, 0);
    EXPECT_NEAR(compare_with_truth(result, truth).rest.registration_lag_ms, 5, 1e-6);
}

TEST(Report, PredictedPosesAreComparedWithTheTruthOfTheirTime) {
    const Truth truth = make_truth();
    RunResult result = make_result(truth, 1);
    // 0.1 m/s along y: 25 ms ahead is 2.5 mm
    for (RunFrame& frame : result.frames) {
        frame.tracker_from_image.translation += Vector3(-0.003, 0.0025, 0);
        frame.ahead_ms = 25;
    }
    const TargetErrors e = compare_with_truth(result, truth);
    EXPECT_NEAR(e.rest.registration_lag_ms, 0, 1e-6);
    EXPECT_NEAR(e.rest.registration_mm.worst, 0, 1e-9);
    EXPECT_NEAR(e.ahead_ms.mean, 25, 1e-9);
    EXPECT_EQ(e.beyond_truth_frames, 1U) << "the last one";
    EXPECT_EQ(e.samples.size(), 40U);
    EXPECT_EQ(e.rest.frames, 28U) << "0 to 19 and 31 to 39, but 19: the press begins after it";

    // The one-euro filter makes up for its own lag.
    result.scene_text =
        "mesh: {file: m.h5}\ntrack: {source: press.igs.mha, smoothing_Hz: 2, sensors: [{tool: Tip, "
        "patch_radius_mm: 12}]}\n";
    const TargetErrors filtered = compare_with_truth(result, truth);
    EXPECT_NEAR(filtered.rest.registration_lag_ms, -25, 1e-6);
    EXPECT_EQ(filtered.ahead_ms.worst, 0);
    EXPECT_EQ(lag_text(filtered.rest.registration_lag_ms), "25 ms ahead of the organ");
    EXPECT_EQ(lag_text(3.2), "3 ms behind the organ");
    result.scene_text.clear();
    for (RunFrame& frame : result.frames) frame.ahead_ms.reset();
    EXPECT_NE(report_text(make_report(result, &truth)).find("25 ms ahead of the organ"),
              std::string::npos);
}

TEST(Report, BetweenTwoTrueSamplesTheTruthIsBetweenThem) {
    Truth truth = make_truth();
    for (std::size_t k = 0; k < truth.samples.size(); ++k)
        truth.samples[k].tracker_from_image.rotation =
            Eigen::AngleAxisd(0.02 * static_cast<double>(k), Vector3::UnitZ()).toRotationMatrix();
    RunResult result = make_result(truth, 1);
    for (RunFrame& frame : result.frames) frame.ahead_ms = 40;
    const TruthMatches matched = match_with_truth(result, truth);
    ASSERT_EQ(matched.matches.size(), 40U);
    const TruthMatch& pressing = matched.matches[19];  // 0.4 of the way to the press
    EXPECT_EQ(pressing.sample, 19U);
    EXPECT_NEAR(pressing.truth.time_s, 101.94, 1e-9);
    EXPECT_NEAR(pressing.truth.depth, 0.004, 1e-9);
    EXPECT_NEAR(pressing.truth.tracker_from_image.translation.y(), 0.194, 1e-9);
    EXPECT_NEAR(Eigen::AngleAxisd(pressing.truth.tracker_from_image.rotation).angle(), 0.388, 1e-9);
}

TEST(Report, FramesWithoutARegistrationAreLeftOutAndCounted) {
    const Truth truth = make_truth();
    RunResult result = make_result(truth, 1);
    result.frames[0].tracker_from_image.translation.x() = std::nan("");
    const TargetErrors e = compare_with_truth(result, truth);
    EXPECT_EQ(e.unregistered_frames, 1U);
    EXPECT_EQ(e.samples.size(), 40U);
    EXPECT_NEAR(e.rest.registration_mm.worst, 3, 1e-9);
}

TEST(Report, TheTruthOfAnotherRecordingIsRefused) {
    const Truth truth = make_truth();
    RunResult result = make_result(truth, 1);
    result.frames[7].time_s += 0.03;
    const std::string message = message_of([&] { compare_with_truth(result, truth); });
    EXPECT_NE(message.find("made.h5"), std::string::npos) << message;
    EXPECT_NE(message.find("100.7300 s"), std::string::npos) << message;
    result.frames[7].time_s -= 0.0295;  // half a millisecond is the same sample
    EXPECT_EQ(message_of([&] { compare_with_truth(result, truth); }), "");
}

TEST(Report, TheTruthOfAnotherOrganIsRefused) {
    Truth truth = make_truth();
    const RunResult result = make_result(truth, 1);
    truth.targets[2].position.z() = 0.3;
    EXPECT_NE(message_of([&] { compare_with_truth(result, truth); }).find("T-2"),
              std::string::npos);
}

TEST(Report, JsonHoldsTheSameFigures) {
    const Truth truth = make_truth();
    RunResult result = make_result(truth, 1);
    result.info.fiducials = {{"F-1", 0.5, 0.9}, {"F-2", 0.25, {}}};
    const Report report = make_report(result, &truth);
    const json out = json::parse(report_json(report));
    EXPECT_NEAR(out["targets"]["deepest_press"]["times_smaller"], std::sqrt(35.0 / 11.0), 1e-9);
    EXPECT_NEAR(out["targets"]["deepest_press"]["rigid_mm"]["rms"], std::sqrt(35.0), 1e-9);
    EXPECT_EQ(out["registration"]["fiducials"][0]["leave_one_out_mm"], 0.9);
    EXPECT_FALSE(out["registration"]["fiducials"][1].contains("leave_one_out_mm"));
    EXPECT_EQ(out["frames"]["samples"], 41);
}

/// Targets "T-3" and "Lesion" with radii of 3.3 mm and of 1 to 5 mm; in the first five frames the
/// elements are missing, and stated with 0.
RunResult with_targets(RunResult result) {
    result.targets = {"T-3", "Lesion"};
    for (std::size_t k = 0; k < result.frames.size(); ++k) {
        FrameStatement& statement = result.frames[k].statement;
        statement.targets.resize(2);
        statement.targets[0].radius_95 = 3.3e-3;
        statement.targets[1].radius_95 = 1e-3 + 1e-4 * static_cast<double>(k);
        for (TargetStatement& t : statement.targets) {
            const bool is_late = k >= 20;  // 21 of 41 frames
            t.by_source[static_cast<std::size_t>(ErrorSource::reference)] = is_late ? 4e-6 : 1e-6;
            t.by_source[static_cast<std::size_t>(ErrorSource::elements)] = k < 5 ? 0 : 0.25e-6;
        }
        if (k < 5) statement.missing.add(ErrorSource::elements);
    }
    return result;
}

TEST(Report, StatedErrorsAreSummedUp) {
    const Report report = make_report(with_targets(make_result(make_truth(), 1)));
    ASSERT_TRUE(report.stated);
    EXPECT_EQ(report.stated->incomplete, 5U);
    EXPECT_EQ(missing_text(*report.stated), "elements in 5");
    ASSERT_EQ(report.stated->targets.size(), 2U);
    const StatedTarget& lesion = report.stated->targets[1];
    EXPECT_EQ(lesion.name, "Lesion");
    EXPECT_NEAR(lesion.radius_95_mm.median, 3, 1e-9);
    EXPECT_NEAR(lesion.radius_95_mm.worst, 5, 1e-9);
    const auto rms = [&](ErrorSource source) {
        return lesion.rms_by_source_mm[static_cast<std::size_t>(source)];
    };
    EXPECT_NEAR(*rms(ErrorSource::reference), std::sqrt((20 * 1 + 21 * 4) / 41.0), 1e-9);
    EXPECT_NEAR(*rms(ErrorSource::elements), 0.5, 1e-9) << "of the frames that have it";
    EXPECT_EQ(*rms(ErrorSource::law), 0);
    EXPECT_FALSE(lesion.truth);
    EXPECT_FALSE(make_report(make_result(make_truth(), 1)).stated) << "no targets";
}

TEST(Report, ASourceThatIsAlwaysMissingHasNoFigure) {
    RunResult result = with_targets(make_result(make_truth(), 1));
    for (RunFrame& frame : result.frames) {
        frame.statement.missing.add(ErrorSource::elements);
        frame.statement.missing.add(ErrorSource::law);
    }
    const Report report = make_report(result);
    EXPECT_EQ(report.stated->incomplete, 41U);
    EXPECT_EQ(missing_text(*report.stated), "elements in 41, law in 41");
    const auto& sources = report.stated->targets[0].rms_by_source_mm;
    EXPECT_FALSE(sources[static_cast<std::size_t>(ErrorSource::law)]);
    EXPECT_TRUE(sources[static_cast<std::size_t>(ErrorSource::solver)]);
    const json out = json::parse(report_json(report))["stated_error"]["targets"][0];
    EXPECT_FALSE(out["rms_by_source_mm"].contains("law"));
}

TEST(Report, StatedRadiiAreComparedWithTheTruthByName) {
    const Truth truth = make_truth();
    RunResult result = with_targets(make_result(truth, 1));
    // T-3 errs by 3 mm sideways and, in the 11 frames of the press, by 2 mm downwards.
    const Report report = make_report(result, &truth);
    const auto& compared = report.stated->targets[0].truth;
    ASSERT_TRUE(compared);
    EXPECT_EQ(compared->frames, 36U) << "in the first five a source is missing";
    EXPECT_EQ(compared->within, 25U);
    EXPECT_NEAR(compared->median_error_mm, 3, 1e-9);
    EXPECT_NEAR(*compared->radius_per_error(), 1.1, 1e-9);
    EXPECT_FALSE(report.stated->targets[1].truth) << "the truth has no Lesion";

    // A frame without a registration is not compared: the radii stay with their frames.
    result.frames[5].tracker_from_image.translation.x() = std::nan("");
    result.frames[5].statement.targets[0].radius_95 = 1;
    result.frames[20].statement.targets[0].radius_95 = 4e-3;
    const auto& fewer = make_report(result, &truth).stated->targets[0].truth;
    EXPECT_EQ(fewer->frames, 35U);
    EXPECT_EQ(fewer->within, 25U);

    for (RunFrame& frame : result.frames) frame.statement.missing.add(ErrorSource::law);
    EXPECT_FALSE(make_report(result, &truth).stated->targets[0].truth) << "no radius is complete";
}

TEST(Report, TextAndJsonHoldTheStatedErrors) {
    const Truth truth = make_truth();
    const Report report = make_report(with_targets(make_result(truth, 1)), &truth);
    const json stated = json::parse(report_json(report))["stated_error"];
    EXPECT_EQ(stated["incomplete_frames"], 5);
    EXPECT_EQ(stated["missing_frames"], json({{"elements", 5}}));
    EXPECT_NEAR(stated["targets"][1]["radius_95_mm"]["median"], 3, 1e-9);
    EXPECT_NEAR(stated["targets"][0]["rms_by_source_mm"]["elements"], 0.5, 1e-9);
    EXPECT_NEAR(stated["targets"][0]["truth"]["coverage"], 25.0 / 36, 1e-9);
    EXPECT_NEAR(stated["targets"][0]["truth"]["radius_per_error"], 1.1, 1e-9);
    EXPECT_FALSE(stated["targets"][1].contains("truth"));

    std::istringstream text(report_text(report));
    std::vector<std::string> rows;
    for (std::string line; std::getline(text, line);) {
        EXPECT_LE(line.size(), 100U) << line;
        if (line.starts_with("  T-3 ")) rows.push_back(line);
    }
    ASSERT_EQ(rows.size(), 2U);
    for (const char* figure : {"3.30", "69.4 %", "1.10"})
        EXPECT_NE(rows[0].find(figure), std::string::npos) << figure << " in " << rows[0];
    EXPECT_NE(rows[1].find("1.59"), std::string::npos) << rows[1];  // the reference
    EXPECT_NE(rows[1].find("0.50"), std::string::npos) << rows[1];
    EXPECT_EQ(report_text(make_report(make_result(truth, 1))).find("STATED"), std::string::npos);
}

TEST(Report, ColumnsOfATableAreAsWideAsTheirLongestCell) {
    EXPECT_EQ(table_text({{"radius", "median", "true error"}, {{"Vein", "1.25"}}, "A note."}, 8),
              "  radius   median true error\n"
              "  Vein       1.25\n"
              "  A note.\n");
}

TEST(Report, TextAndPageHaveTheSameStatedErrors) {
    const Truth truth = make_truth();
    const StatedErrors stated = *make_report(with_targets(make_result(truth, 1)), &truth).stated;
    const ReportTable radii = radius_table(stated), sources = source_table(stated);
    EXPECT_EQ(radii.rows[0], (std::vector<std::string>{"T-3", "3.30", "3.30", "69.4 %", "1.10"}));
    EXPECT_EQ(radii.rows[1].size(), 3U) << "the truth has no Lesion";
    EXPECT_EQ(radii.heads.size(), 5U);
    EXPECT_EQ(sources.heads.size(), 1 + error_source_count);
    EXPECT_EQ(sources.rows[1].size(), sources.heads.size());
    EXPECT_EQ(sources.note, "A source was missing in 12.2 % of the frames: elements in 5.");
    EXPECT_EQ(radius_table(*make_report(with_targets(make_result(truth, 1))).stated).heads.size(),
              3U);
}

TEST(Report, ALongNameIsApartFromItsValue) {
    EXPECT_EQ(report_line("patch", "15 mm"), "  patch                 15 mm\n");
    EXPECT_EQ(report_line("SensorOnTheLeftLobeOfTheLiver", "15 mm"),
              "  SensorOnTheLeftLobeOfTheLiver 15 mm\n");
}

TEST(Report, LinesOfTheTextAreAPageWide) {
    const Truth truth = make_truth();
    std::istringstream text(report_text(make_report(make_result(truth, 1), &truth)));
    for (std::string line; std::getline(text, line);) EXPECT_LE(line.size(), 100U) << line;
}

TEST(Report, SaysWhatBladesCutAndWhatNot) {
    Report report;
    report.run.budget_ms = 30;
    const auto sentence = [&] {
        for (const std::string& s : verdicts(report))
            if (s.starts_with("Cuts:")) return s;
        return std::string();
    };
    EXPECT_EQ(sentence(), "") << "the scene has no blade";
    report.run.cuts.emplace();
    EXPECT_EQ(sentence(), "Cuts: none opened.");
    report.run.cuts->gaps = 1;
    EXPECT_TRUE(sentence().starts_with("Cuts: none opened. NOT cut: 1 blade path,")) << sentence();
    report.run.cuts = {.openings = 2, .parted = 40, .nodes_added = 50, .longest_ms = 12};
    EXPECT_TRUE(sentence().ends_with("the body still hangs together.")) << sentence();
    report.run.cuts->longest_ms = 45;
    EXPECT_NE(sentence().find("the 30 ms of a frame: a longer track.cut_interval_s"),
              std::string::npos)
        << sentence();
    report.prepares_cuts = false;
    EXPECT_EQ(sentence().find("a longer track.cut_interval_s"), std::string::npos) << sentence();
    EXPECT_EQ(sentence().find("had not opened"), std::string::npos);
    report.run.cuts->waits = true;
    EXPECT_NE(sentence().find("What was cut last had not opened"), std::string::npos);
    report.run.cuts->gaps = 2;
    report.run.cuts->gaps_mm = 31;
    EXPECT_NE(sentence().find("NOT cut: 2 blade paths, 31 mm in the organ in all"),
              std::string::npos)
        << sentence();
}

TEST(Report, RunInfoNamesTheKeyThatIsMissing) {
    EXPECT_NE(message_of([] {
                  parse_run_info(R"({"samples": 3, "frames": 3})", "r.h5");
              }).find("\"missed\""),
              std::string::npos);
    EXPECT_NE(message_of([] { parse_run_info("[", "r.h5"); }).find("r.h5"), std::string::npos);
}

TEST(Report, NoFramesIsAnError) {
    RunResult result = make_result(make_truth(), 1);
    result.frames.clear();
    EXPECT_THROW(make_report(result), Error);
}

}  // namespace
}  // namespace livetet
