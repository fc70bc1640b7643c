#ifdef LIVETET_IMAGES
#include "apps/bench/accuracy_run.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "apps/bench/accuracy_population.hpp"
#include "apps/bench/accuracy_result.hpp"
#include "apps/phantom/phantom_shape.hpp"
#include "apps/phantom/phantom_truth.hpp"

namespace livetet {
namespace {

/// The phantom, coarse, pressed to two depths; a model of it that is coarser still.
class Accuracy : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        const PhantomImages images = make_phantom_images(0.003, 1);
        organ_ = new PressedOrgan(press_organ(images, 2500, {0.008, 0.015}));
        model_ = new AccuracyModel(accuracy_scene(),
                                   mesh_for_truth(images.labels, images.fixed_mask, 2000), *organ_);
    }
    static void TearDownTestSuite() {
        delete model_;
        delete organ_;
    }
    /// How far the judged targets truly move, RMS, mm.
    static double true_motion_mm(std::size_t depth) {
        double squares = 0;
        const auto judged = judged_targets(organ_->truth);
        for (const std::size_t i : judged)
            squares += organ_->truth.targets[i].displacement[depth].squaredNorm();
        return 1e3 * std::sqrt(squares / static_cast<double>(judged.size()));
    }
    static AccuracyErrors at(const AccuracyCase& c, std::size_t depth) {
        return model_->run(c)[depth];
    }

    static PressedOrgan* organ_;
    static AccuracyModel* model_;
};
PressedOrgan* Accuracy::organ_ = nullptr;
AccuracyModel* Accuracy::model_ = nullptr;

TEST_F(Accuracy, WithoutNoiseTheRigidErrorIsTheTrueMotionAndDeformingTakesMostOfIt) {
    for (const int sensors : {1, 3}) {
        const auto errors = model_->run({0, 0, sensors, 1, false});
        for (std::size_t d = 0; d < 2; ++d) {
            EXPECT_NEAR(errors[d].registration, 0, 1e-6);
            EXPECT_NEAR(errors[d].rigid, true_motion_mm(d), 1e-6);
            EXPECT_NEAR(errors[d].deforming, errors[d].deformation, 1e-6);
            EXPECT_LT(errors[d].deforming, 0.4 * errors[d].rigid)
                << sensors << " sensors";  // by 2,000 tets; 6,000 leave a fifth to a third
        }
    }
}

TEST_F(Accuracy, TheReferenceSensorsNoiseIsTheSameWhateverOtherSensorsThereAre) {
    const AccuracyErrors one = at({1.4, 0.5, 1, 7}, 1), three = at({1.4, 0.5, 3, 7}, 1),
                         other = at({1.4, 0.5, 1, 8}, 1);
    EXPECT_NEAR(one.rigid, three.rigid, 1e-9);
    EXPECT_NEAR(one.registration, three.registration, 1e-9);
    EXPECT_GT(std::abs(one.deforming - three.deforming), 1e-4);
    EXPECT_GT(std::abs(one.rigid - other.rigid), 1e-3);
}

TEST_F(Accuracy, ARunDoesNotKnowTheOneBefore) {
    const AccuracyErrors first = at({1.4, 0.5, 2, 3}, 1);
    (void)at({0.5, 0.2, 4, 5}, 1);
    EXPECT_NEAR(at({1.4, 0.5, 2, 3}, 1).deforming, first.deforming, 1e-2);
}

TEST_F(Accuracy, WithNoiseDeformingBeatsRigidOnlyAndLessNoiseIsBetter) {
    const AccuracyErrors noisy = at({1.4, 0.5, 1, 2}, 1), quieter = at({0.5, 0.2, 1, 2}, 1);
    EXPECT_LT(noisy.deforming, 0.8 * noisy.rigid);
    EXPECT_LT(quieter.deforming, noisy.deforming);
    EXPECT_GT(noisy.registration, 0.1);
    EXPECT_LE(noisy.deforming, noisy.registration + noisy.deformation);  // RMS of their sum
}

TEST_F(Accuracy, SensorsRestOnTheFreeSurfaceAndRideOnIt) {
    ASSERT_EQ(organ_->sensors.size(), static_cast<std::size_t>(max_true_sensors));
    for (const TrueSensor& sensor : organ_->sensors) {
        const Vector3& place = sensor.at_rest.translation;
        EXPECT_NEAR(phantom::organ_distance(place), 0, 1e-4);
        EXPECT_FALSE(phantom::is_held(place));
        const double way = (sensor_at(*organ_, sensor, 0.015).translation - place).norm();
        if (&sensor == &organ_->sensors.front()) {
            EXPECT_NEAR(way, 0.015, 5e-4);  // of a coarse surface
        } else {
            EXPECT_LT(way, 0.008);
        }
    }
}

TEST(AccuracyTables, AVerdictNamesEachLostCellWhereThePressIsLargerThanTheNoise) {
    AccuracySeries series{
        {{{3, 2, 1, 1}, {3, 4, 1, 1}, {3, 1, 1, 1}}, {{5, 2, 1, 1}, {3, 4, 1, 1}, {3, 2, 1, 1}}}};
    EXPECT_DOUBLE_EQ(over_seeds(series, 0, &AccuracyErrors::rigid).mean, 4);
    EXPECT_DOUBLE_EQ(*over_seeds(series, 0, &AccuracyErrors::rigid).sd, std::sqrt(2.0));
    const AccuracyTable table{{1.4, 0.5}, {1, 5, 10}, {0.4, 2, 4}, {series}};
    const AccuracyVerdict verdict = judge({table});
    EXPECT_EQ(verdict.cells, 2);
    ASSERT_EQ(verdict.lost.size(), 1u);
    EXPECT_NE(verdict.lost.front().find("5 mm"), std::string::npos) << verdict.lost.front();
}

/// A series of one run at one depth.
AccuracySeries stated_series(double covered, double median, double median_radius) {
    AccuracyErrors at;
    at.covered = covered;
    at.median = median;
    at.median_radius = median_radius;
    return {{{at}}};
}

TEST(AccuracyTables, ASingleRunHasNoSpread) {
    const AccuracyTable table{{1.4, 0.5}, {5}, {2}, {stated_series(0.95, 1, 2.4)}};
    EXPECT_FALSE(over_seeds(table.by_sensors[0], 0, &AccuracyErrors::covered).sd);
    const nlohmann::json errors = json_of(table)["by_sensors"][0]["errors"][0];
    EXPECT_TRUE(errors["rigid_mm"].contains("mean"));
    EXPECT_FALSE(errors["rigid_mm"].contains("sd"));
}

TEST(AccuracyTables, AStatementIsRightIfItCoversEnoughAndIsNotTooWide) {
    const AccuracyTable table{{1.4, 0.5},
                              {5},
                              {2},
                              {stated_series(0.95, 1, 2.4), stated_series(0.91, 1, 2),
                               stated_series(0.985, 1, 2), stated_series(0.95, 1, 2.6)}};
    const AccuracyVerdict verdict =
        judge_statement({table}, {{"a soft body", 6, stated_series(0.5, 1, 1)}});
    EXPECT_EQ(verdict.cells, 5);
    ASSERT_EQ(verdict.lost.size(), 4u);
    for (const char* part : {"2 sensors", "91.0 %"})
        EXPECT_NE(verdict.lost[0].find(part), std::string::npos) << verdict.lost[0];
    EXPECT_NE(verdict.lost[3].find("a soft body"), std::string::npos) << verdict.lost[3];
}

TEST_F(Accuracy, TheSharesWithinStatedProbabilitiesRiseToTheCoverage) {
    const AccuracyErrors errors = at({1.4, 0.5, 1, 3}, 1);
    EXPECT_TRUE(std::ranges::is_sorted(errors.within));
    EXPECT_NEAR(errors.within.back(), errors.covered, 1e-9) << "that of 95 % is the radius";
    EXPECT_LT(errors.within.front(), 0.5);
    const AccuracyTable table{{1.4, 0.5}, {8, 15}, {4, 8}, {{{model_->run({1.4, 0.5, 1, 3})}}}};
    const SpreadChart chart = calibration_chart_of(table);
    ASSERT_EQ(chart.lines.size(), 3u) << "two depths and the diagonal";
    EXPECT_NEAR(chart.lines[1].mean.back(), 100 * errors.covered, 1e-9);
    EXPECT_EQ(chart.lines[2].x, chart.lines[2].mean);
    const nlohmann::json within = json_of(table)["by_sensors"][0]["errors"][1]["within"];
    EXPECT_EQ(within["probability"].size(), 19u);
    EXPECT_EQ(within["share"], nlohmann::json(errors.within));
    const std::string csv = csv_of({table});
    EXPECT_NE(csv.find(",radius_95_mm,within_5,"), std::string::npos) << csv;
    EXPECT_NE(csv.find(",within_95\n"), std::string::npos);
}

TEST(AccuracyPopulation, HasTheStatedSpreadsAndEachPartOfThemOnce) {
    const auto bodies = draw_bodies(10);
    ASSERT_EQ(bodies.size(), 10u);
    const TrueBody usual;
    std::vector<double> poisson, radius;
    for (const DrawnBody& b : bodies) {
        poisson.push_back((b.body.poisson - usual.poisson) / stated_poisson_spread);
        radius.push_back((b.body.patch_radius / usual.patch_radius - 1) / stated_radius_share);
        EXPECT_GT(b.mesh_share, 0.8);
        EXPECT_LT(b.mesh_share, 1.25);
    }
    EXPECT_NE(poisson, radius) << "not the same part of each";
    for (const DrawnBody& b : draw_bodies(most_drawn_bodies)) EXPECT_LT(b.body.poisson, 0.497);
    for (std::vector<double>* values : {&poisson, &radius}) {
        std::ranges::sort(*values);
        // medians of ten equally likely parts of a standard normal distribution, from a table
        const double expected[] = {0.12566, 0.38532, 0.67449, 1.03643, 1.64485};
        for (std::size_t i = 0; i < 5; ++i) {
            EXPECT_NEAR((*values)[5 + i], expected[i], 1e-5);
            EXPECT_NEAR((*values)[4 - i], -expected[i], 1e-5);
        }
    }
}

TEST(AccuracyPopulation, HasAllRunsOfABodyInEachCell) {
    const TrackerKind trackers[] = {{1.4, 0.5}, {0.5, 0.2}};
    std::vector<std::string> said;
    const auto tables =
        press_population({2, 2, 2, 1500, 1500}, trackers, {0.008, 0.015},
                         [&](double, std::string_view words) { said.emplace_back(words); });
    ASSERT_EQ(tables.size(), 2u);
    for (const AccuracyTable& t : tables) {
        EXPECT_EQ(t.depths_mm, (std::vector<double>{8, 15}));
        EXPECT_GT(t.motion_mm[1], 1.5 * t.motion_mm[0]);
        EXPECT_NEAR(t.motion_mm[1], 7.6, 1.5) << "RMS over bodies, not their sum";
        ASSERT_EQ(t.by_sensors.size(), 2u);
        for (const AccuracySeries& cell : t.by_sensors) {
            ASSERT_EQ(cell.runs.size(), 4u);
            for (std::size_t a = 0; a < 4; ++a)
                for (std::size_t b = 0; b < a; ++b)
                    EXPECT_GT(std::abs(cell.runs[a][1].registration - cell.runs[b][1].registration),
                              1e-6)
                        << "seeds of their own";
            for (const auto& run : cell.runs) {
                EXPECT_GT(run[1].by_source[static_cast<std::size_t>(ErrorSource::materials)], 0)
                    << "the scene states a spread";
                EXPECT_LT(run[1].deforming, run[1].rigid);
            }
        }
    }
    EXPECT_NE(said.back().find("body 2 of 2"), std::string::npos) << said.back();
}

}  // namespace
}  // namespace livetet
#endif
