#include "config/yaml.hpp"

#include <gtest/gtest.h>

#include "mechanics/material.hpp"
#include "mechanics/time_scheme.hpp"

namespace livetet {
namespace {

struct Sample {
    Material material;
    std::vector<Material> others;
    TimeOptions time;
    Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
};

template <class Visitor>
void visit_fields(Visitor& v, Sample& s) {
    v.group("material", s.material, "the material");
    v.list("others", s.others, "more materials");
    v.group("time", s.time, "time");
    v.field("gravity", s.gravity, "m/s^2", "acceleration");
}

std::string refusal(const std::string& text) {
    try {
        read_yaml<Sample>(text, "liver.yaml");
    } catch (const Error& e) {
        return e.what();
    }
    return "accepted";
}

TEST(Yaml, ReadsWhatIsGivenAndKeepsDefaults) {
    const auto s = read_yaml<Sample>(
        "material: {young_Pa: 5e3}\ntime: {scheme: newmark}\ngravity: [0, 0, -9.81]\n", "x");
    EXPECT_EQ(s.material.young_Pa, 5000);
    EXPECT_EQ(s.material.poisson, Material{}.poisson);
    EXPECT_EQ(s.time.scheme, TimeScheme::newmark);
    EXPECT_EQ(s.gravity.z(), -9.81);
}

TEST(Yaml, NamesTheUnknownKeyAndTheNearestRightOne) {
    EXPECT_EQ(refusal("material:\n  youngs_Pa: 3\n"),
              "unknown key material.youngs_Pa, did you mean material.young_Pa? (liver.yaml:2)");
}

TEST(Yaml, SaysValueLimitAndPlace) {
    EXPECT_EQ(refusal("material:\n  young_Pa: -3\n"),
              "material.young_Pa = -3 Pa must be greater than 0 (liver.yaml:2)");
    EXPECT_EQ(refusal("material: {poisson: 0.5}"),
              "material.poisson = 0.5 must be above -1 and below 0.5, where the material is "
              "positive definite (liver.yaml:1)");
    EXPECT_EQ(refusal("material: {young_Pa: .nan}"),
              "material.young_Pa = .nan Pa must be greater than 0 (liver.yaml:1)");
    EXPECT_EQ(refusal("gravity: [0, 1]"),
              "gravity = [0, 1] must be three numbers [x, y, z] (liver.yaml:1)");
    EXPECT_EQ(refusal("material: {region: 3000000000}"),
              "material.region = 3000000000 must be a whole number from -2147483648 to 2147483647 "
              "(liver.yaml:1)");
    EXPECT_EQ(refusal("time: {scheme: newton}"),
              "time.scheme = newton must be one of static, euler, newmark, generalized_alpha "
              "(liver.yaml:1)");
    EXPECT_EQ(refusal("others:\n - {young_Pa: soft}"),
              "others[0].young_Pa = soft must be a number, or NUMBER +- SPREAD (liver.yaml:2)");
    EXPECT_EQ(refusal("material: {young_Pa: 1, young_Pa: 2}"),
              "material.young_Pa is given twice (liver.yaml:1)");
    EXPECT_EQ(refusal("material: 3"), "material must be a table of keys (liver.yaml:1)");
    EXPECT_NE(refusal("material: [").find("liver.yaml:"), std::string::npos);
    for (const char* key :
         // A list or a table as a key; found by fuzzing.
         {"[a]: 3", "{a: 1}: 3"})
        EXPECT_NE(refusal(fmt::format("material: {{{}}}", key)).find("expected a name"),
                  std::string::npos)
            << key;
}

TEST(Yaml, WritesWhatReadsBackToTheSame) {
    auto s =
        read_yaml<Sample>("others: [{young_Pa: 0.1}, {region: 2}]\ntime: {scheme: euler}", "x");
    s.material.poisson = 1.0 / 3;
    const auto back = read_yaml<Sample>(to_yaml(s), "y");
    EXPECT_EQ(back.material.poisson, s.material.poisson);
    ASSERT_EQ(back.others.size(), 2u);
    EXPECT_EQ(back.others[1].region, 2);
    EXPECT_EQ(back.time.scheme, TimeScheme::implicit_euler);
}

TEST(Yaml, TheReferenceNamesEveryKeyWithUnitAndDefault) {
    const std::string text = reference_of<Sample>();
    for (const char* part : {"young_Pa: 3000", "[Pa]", "below 0.5", "scheme: static", "newmark"})
        EXPECT_NE(text.find(part), std::string::npos) << part;
}

}  // namespace
}  // namespace livetet
