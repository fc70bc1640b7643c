#include "config/uncertain.hpp"

#include <gtest/gtest.h>

#include "config/yaml.hpp"
#include "mechanics/material.hpp"

namespace livetet {
namespace {

TEST(Uncertain, IsReadWithAndWithoutItsSpread) {
    EXPECT_EQ(parse_uncertain("0.45"), Uncertain(0.45));
    EXPECT_EQ(parse_uncertain("0.45 +- 0.03"), Uncertain(0.45, 0.03));
    EXPECT_EQ(parse_uncertain(" -1e-3+-2e-4 "), Uncertain(-1e-3, 2e-4));
    for (const char* text : {"", "+-", "0.45 +-", "+- 0.03", "0.45 +- -0.03", "0.45 +- a",
                             "0.45 +- 0.03 +- 1", "0.45 0.03", "0.45 +- nan"})
        EXPECT_EQ(parse_uncertain(text), std::nullopt) << text;
}

TEST(Uncertain, ReadsBackAsItIsWritten) {
    for (const Uncertain x : {Uncertain(0.45), Uncertain(1.0 / 3, 0.1), Uncertain(3000, 600)})
        EXPECT_EQ(parse_uncertain(text_of(x)), x) << text_of(x);
    EXPECT_EQ(fmt::format("{:g}", Uncertain(0.45, 0.03)), "0.45") << "the value alone";
}

Material material_of_text(const std::string& text) {
    return read_yaml<Material>(text, "scene.yaml");
}

TEST(Uncertain, AMaterialMayHaveIt) {
    const Material m = material_of_text("{young_Pa: 3000 +- 600, poisson: 0.45 +- 0.03}");
    EXPECT_EQ(m.young_Pa, Uncertain(3000, 600));
    EXPECT_EQ(m.poisson, Uncertain(0.45, 0.03));
    const Material again = material_of_text(to_yaml(m));
    EXPECT_EQ(again.young_Pa, m.young_Pa);
    EXPECT_EQ(again.poisson, m.poisson);
    EXPECT_EQ(material_of_text("{poisson: 0.3}").poisson, Uncertain(0.3));
}

std::string refusal_of(const std::string& text) {
    try {
        material_of_text(text);
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

TEST(Uncertain, ASpreadThatReachesWhereNoMaterialIsIsRefused) {
    EXPECT_NE(refusal_of("{poisson: 0.48 +- 0.02}").find("poisson = 0.48 +- 0.02 must be above"),
              std::string::npos)
        << refusal_of("{poisson: 0.48 +- 0.02}");
    EXPECT_NE(refusal_of("{poisson: 0.48 +- 0.02}").find("to value + spread = 0.5 (scene.yaml:1)"),
              std::string::npos)
        << refusal_of("{poisson: 0.48 +- 0.02}");
    EXPECT_EQ(refusal_of("{young_Pa: 3000 +- 3000}"),
              "young_Pa = 3000 +- 3000 Pa must be greater than 0, from value - spread = 0 to value "
              "+ spread = 6000 (scene.yaml:1)");
    EXPECT_NE(refusal_of("{young_Pa: 100 +- -5}").find("NUMBER +- SPREAD"), std::string::npos);
    EXPECT_NE(refusal_of("{young_Pa: soft}").find("must be a number"), std::string::npos);
}

}  // namespace
}  // namespace livetet
