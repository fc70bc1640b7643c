#include "io/tip_file.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/file.hpp"
#include "files.hpp"

namespace livetet {
namespace {

using namespace testing_files;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using nlohmann::json;

TEST(TipFile, KeepsTheShaftWithTheTip) {
    const auto file = fresh_folder() / "tip.json";
    ToolTip tip{"Stylus", {}, {}};
    tip.pivot.tool_from_tip.translation = {0.004, -0.002, 0.15};
    tip.pivot.rank = 6;
    tip.pivot.rms = 0.0004;
    write_tip(file, tip);
    EXPECT_FALSE(read_tip(file).spin);
    EXPECT_EQ(read_tip(file).tool_from_tip().rotation, Eigen::Matrix3d::Identity());

    const Vector3d shaft = Vector3d(0.1, 0.2, 1).normalized();
    tip.spin = SpinCalibration{shaft, Vector3d::UnitX(), 0.5, 300, 120};
    write_tip(file, tip);
    const ToolTip back = read_tip(file);
    EXPECT_LT((back.tool_from_tip().rotation.col(2) - shaft).norm(), 1e-12);
    EXPECT_LT((back.tool_from_tip().translation - Vector3d(0.004, -0.002, 0.15)).norm(), 1e-15);
    EXPECT_EQ(back.spin->used, 120u);
    EXPECT_NEAR(back.pivot.rms, 0.0004, 1e-15);

    json j = json::parse(read_text_file(file));
    // PLUS's matrix: the third column is the shaft, the fourth the tip in mm.
    EXPECT_NEAR(j["tool_from_tip_mm"][2].get<double>(), shaft.x(), 1e-12);
    EXPECT_NEAR(j["tool_from_tip_mm"][11].get<double>(), 150, 1e-9);
    j["shaft"]["in_tool"] = {1, 1, 0};
    write_text_file(file, j.dump());
    EXPECT_TRUE(
        says(error_of([&] { read_tip(file); }), {"tip.json", "shaft.in_tool", "expected 1"}));
    j["tip_mm"] = {1, 2};
    write_text_file(file, j.dump());
    EXPECT_TRUE(says(error_of([&] { read_tip(file); }), {"tip_mm has 2 numbers"}));
    write_tip(file, {"Stylus", {}, {}});
    EXPECT_EQ(read_tip(file, "Stylus").tool, "Stylus");
    EXPECT_TRUE(says(error_of([&] { read_tip(file, "Pointer"); }),
                     {"tip.json", "is the tip of Stylus", "that of Pointer"}));
}

// Of 0.3 mm along the shaft and 0.1 mm across it, the shaft being askew in the tool's frame.
Matrix3d a_tip_covariance() {
    const Matrix3d axes = rotation_of_vector({0.4, -0.3, 1});
    return axes * Vector3d(1e-8, 1e-8, 9e-8).asDiagonal() * axes.transpose();
}

TEST(TipFile, CovarianceOfTheTipComesBack) {
    const auto file = fresh_folder() / "tip.json";
    const Matrix3d covariance = a_tip_covariance();
    write_tip(file, {"Stylus", {}, {}, covariance});
    const json j = json::parse(read_text_file(file))["covariance_mm2"];
    ASSERT_EQ(j.size(), 9u);
    EXPECT_NEAR(j[5].get<double>(), 1e6 * covariance(1, 2), 1e-12);
    ToolTip tip = read_tip(file);
    ASSERT_TRUE(tip.covariance);
    EXPECT_LT((*tip.covariance - covariance).norm(), 1e-12 * covariance.norm());
    // It stays when another calibration is added.
    tip.spin = SpinCalibration{Vector3d::UnitZ(), Vector3d::UnitX(), 0.5, 300, 120};
    write_tip(file, tip);
    EXPECT_LT((*read_tip(file).covariance - covariance).norm(), 1e-12 * covariance.norm());
    // Files of 0.1.0 have none.
    write_tip(file, {"Stylus", {}, {}});
    EXPECT_FALSE(json::parse(read_text_file(file)).contains("covariance_mm2"));
    EXPECT_FALSE(read_tip(file).covariance);
}

TEST(TipFile, RefusesACovarianceThatIsNone) {
    const auto file = fresh_folder() / "tip.json";
    write_tip(file, {"Stylus", {}, {}, a_tip_covariance()});
    const json good = json::parse(read_text_file(file));
    const auto refusal = [&](const auto& change) {
        json bad = good;
        change(bad["covariance_mm2"]);
        write_text_file(file, bad.dump());
        return error_of([&] { read_tip(file); });
    };
    EXPECT_TRUE(says(refusal([](json& rows) { rows.erase(8); }),
                     {"tip.json: covariance_mm2: has 8 entries, expected 9 numbers"}));
    EXPECT_TRUE(says(refusal([](json& rows) { rows = 0.01; }),
                     {"tip.json: covariance_mm2: is of the type number, expected 9 numbers"}));
    EXPECT_TRUE(says(refusal([](json& rows) { rows = nullptr; }), {"tip.json: covariance_mm2"}));
    EXPECT_TRUE(says(refusal([](json& rows) { rows[4] = "0.01"; }),
                     {"tip.json: covariance_mm2: entry 5 is of the type string"}));
    EXPECT_TRUE(says(refusal([](json& rows) { rows[4] = nullptr; }),  // a NaN
                     {"tip.json: covariance_mm2: entry 5 is of the type null"}));
    EXPECT_TRUE(says(refusal([](json& rows) { rows[1] = rows[3].get<double>() + 0.01; }),
                     {"tip.json: covariance_mm2: ", "at (1, 2)", "expected equal"}));
    EXPECT_TRUE(says(refusal([](json& rows) { rows = {0.01, 0, 0, 0, 0.01, 0, 0, 0, -0.04}; }),
                     {"tip.json: covariance_mm2: ", "the eigenvalue -0.04 mm^2"}));
    EXPECT_EQ(refusal([](json& rows) { rows = {0.01, 0, 0, 0, 0.01, 0, 0, 0, 0}; }), "");
}

}  // namespace
}  // namespace livetet
