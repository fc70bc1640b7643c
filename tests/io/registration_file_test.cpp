#include "io/registration_file.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/file.hpp"
#include "files.hpp"

namespace livetet {
namespace {

using namespace testing_files;
using Eigen::Vector3d;
using nlohmann::json;

FiducialRegistration a_registration() {
    FiducialRegistration r;
    r.reference_tool = "Reference";
    r.image_from_base = {1.02, rotation_of_vector(Vector3d(0.3, -1, 2)), Vector3d(0.1, 0.2, -0.3)};
    r.fiducials.push_back({"F,1", {0.1, 0, 0}, {1, 2, 3}, {4, 5, 6}, 0.001, std::nan(""), 0.5});
    r.fiducials.push_back({"F2", {0, 0.1, 0}, {1, 2, 4}, {4, 5, 7}, 0.002, 0.003, 1});
    r.fre = 0.0015;
    r.fle = 0.0025;
    r.outlier = "F2";
    r.surface = {400, 360, 0.003, 0.0005, 12, 1};
    return r;
}

TEST(RegistrationFile, ComesBackAsItWasWritten) {
    const auto file = fresh_folder() / "registration.json";
    FiducialRegistration r = a_registration();
    write_registration(file, r);
    const FiducialRegistration back = read_registration(file);
    EXPECT_NEAR(back.image_from_base.scale, 1.02, 1e-12);
    EXPECT_LT((back.image_from_base.rotation - r.image_from_base.rotation).norm(), 1e-12);
    EXPECT_LT((back.image_from_base.translation - r.image_from_base.translation).norm(), 1e-12);
    ASSERT_EQ(back.fiducials.size(), 2u);
    EXPECT_EQ(back.fiducials[0].name, "F,1");
    EXPECT_TRUE(std::isnan(back.fiducials[0].leave_one_out));
    EXPECT_NEAR(back.fiducials[1].leave_one_out, 0.003, 1e-15);
    EXPECT_EQ(back.fiducials[0].weight, 0.5);
    EXPECT_LT((back.fiducials[1].in_reference - Vector3d(4, 5, 7)).norm(), 1e-12);
    EXPECT_NEAR(back.fle, 0.0025, 1e-15);
    EXPECT_EQ(back.outlier, "F2");
    ASSERT_TRUE(back.surface);
    EXPECT_EQ(back.surface->used, 360u);
    EXPECT_NEAR(back.surface->rms_after, 0.0005, 1e-15);
    EXPECT_EQ(back.surface->free_motions, 1u);

    r.reference_tool.clear();
    r.outlier.reset();
    r.surface.reset();
    write_registration(file, r);
    EXPECT_TRUE(json::parse(read_text_file(file)).contains("image_from_tracker_mm"));
    EXPECT_FALSE(read_registration(file).surface);
    EXPECT_FALSE(read_registration(file).outlier);
}

TEST(RegistrationFile, RefusesWhatIsNoRegistration) {
    const auto file = fresh_folder() / "registration.json";
    write_registration(file, a_registration());
    const json good = json::parse(read_text_file(file));
    const auto refusal = [&](const auto& change) {
        json bad = good;
        change(bad);
        write_text_file(file, bad.dump());
        return error_of([&] { read_registration(file); });
    };
    const char* matrix = "image_from_reference_mm";
    EXPECT_TRUE(says(refusal([&](json& j) { j[matrix][0] = 2; }),
                     {"registration.json", "a turn, a scale and a shift"}));
    EXPECT_TRUE(says(refusal([&](json& j) {
                         for (int k = 0; k < 3; ++k)
                             j[matrix][k] = -j[matrix][k].get<double>();  // a reflection
                     }),
                     {"a turn, a scale and a shift"}));
    EXPECT_TRUE(says(refusal([&](json& j) { j[matrix].erase(3); }), {"16 numbers"}));
    EXPECT_TRUE(says(refusal([&](json& j) { j.erase(matrix); }), {matrix}));
    EXPECT_TRUE(says(refusal([](json& j) { j["fiducials"][0].erase("weight"); }), {"weight"}));
    EXPECT_TRUE(
        says(refusal([](json& j) { j["surface"]["used"] = "all"; }), {"registration.json"}));
    EXPECT_TRUE(says(refusal([](json& j) { j["format"] = "livetet fiducial registration 1"; }),
                     {"livetet fiducial registration 1", "livetet registration 2"}));
}

// d and a are correlated, as for fiducials away from the origin of their frame.
ExpectedRegistrationError an_expected_error() {
    Eigen::Matrix<double, 6, 6> root;
    for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = (i < 18 ? 1e-4 : 2e-3) * std::cos(3.0 * i);
    return {root * root.transpose(), true};
}

TEST(RegistrationFile, ExpectedErrorComesBackInMetresAndRadians) {
    const auto file = fresh_folder() / "registration.json";
    FiducialRegistration r = a_registration();
    write_registration(file, r);
    EXPECT_FALSE(json::parse(read_text_file(file)).contains("error"));  // as in 0.1.0
    EXPECT_FALSE(read_registration(file).expected_error);

    r.expected_error = an_expected_error();
    const Eigen::Matrix<double, 6, 6>& covariance = r.expected_error->covariance;
    write_registration(file, r);
    const json j = json::parse(read_text_file(file))["error"];
    ASSERT_EQ(j["covariance_mm_rad"].size(), 36u);
    const auto entry = [&](int i, int k) {
        return j["covariance_mm_rad"][6 * i + k].get<double>();
    };
    EXPECT_NEAR(entry(0, 1) / (1e6 * covariance(0, 1)), 1, 1e-12);
    EXPECT_NEAR(entry(1, 5) / (1e3 * covariance(1, 5)), 1, 1e-12);
    EXPECT_NEAR(entry(3, 4) / covariance(3, 4), 1, 1e-12);
    const auto back = read_registration(file).expected_error;
    ASSERT_TRUE(back);
    EXPECT_TRUE(back->holds_tip);
    EXPECT_LT(((back->covariance - covariance).array() / covariance.array()).abs().maxCoeff(),
              1e-12);
    r.expected_error->holds_tip = false;
    write_registration(file, r);
    EXPECT_FALSE(read_registration(file).expected_error->holds_tip);
}

TEST(RegistrationFile, RefusesAnExpectedErrorThatIsNone) {
    const auto file = fresh_folder() / "registration.json";
    FiducialRegistration r = a_registration();
    r.expected_error = an_expected_error();
    write_registration(file, r);
    const json good = json::parse(read_text_file(file));
    const auto refusal = [&](const auto& change) {
        json bad = good;
        change(bad["error"]);
        write_text_file(file, bad.dump());
        return error_of([&] { read_registration(file); });
    };
    const char* rows = "covariance_mm_rad";
    const char* key = "registration.json: error.covariance_mm_rad: ";
    EXPECT_TRUE(says(refusal([](json& j) { j = 0.5; }),
                     {"registration.json: error: is of the type number, expected an object"}));
    EXPECT_TRUE(says(refusal([&](json& j) { j.erase(rows); }),
                     {"registration.json: error.covariance_mm_rad is missing"}));
    EXPECT_TRUE(says(refusal([](json& j) { j.erase("holds_tip"); }),
                     {"registration.json: error.holds_tip is missing"}));
    EXPECT_TRUE(says(refusal([](json& j) { j["holds_tip"] = 1; }),
                     {"registration.json: error.holds_tip: ", "expected true or false"}));
    EXPECT_TRUE(says(refusal([&](json& j) { j[rows].erase(0); }),
                     {key, "has 35 entries, expected 36 numbers"}));
    EXPECT_TRUE(says(refusal([&](json& j) { j[rows][7] = nullptr; }),
                     {key, "entry 8 is of the type null"}));
    EXPECT_TRUE(
        says(refusal([&](json& j) { j[rows][4] = 7; }), {key, "mm rad at (5, 1) and 7 at (1, 5)"}));
    EXPECT_TRUE(says(refusal([&](json& j) { j[rows][35] = -1e-9; }),
                     {key, "scaled to correlations, has the eigenvalue -"}));
}

TEST(RegistrationFile, NamesInLatin1AreWritten) {
    FiducialRegistration registration;
    registration.fiducials.push_back({"Spitze \xfc", {0.1, 0, 0}, {0, 0.1, 0}, {}, 0.001, 0.002});
    registration.fiducials.push_back({"F2", {0, 0.2, 0}, {0, 0.1, 0.3}, {}, 0.001, 0.002});
    const auto file = fresh_folder() / "registration.json";
    write_registration(file, registration);
    EXPECT_TRUE(read_registration(file).fiducials[0].name.starts_with("Spitze "));
}

}  // namespace
}  // namespace livetet
