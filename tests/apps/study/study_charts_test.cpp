#ifdef LIVETET_IMAGES
#include "apps/commands/study_charts.hpp"

#include <gtest/gtest.h>

#include "config/unit_of.hpp"

namespace livetet {
namespace {

/// A study of two keys, and a table of its solves, whose output is ten times the first input.
struct Varied {
    Study study;
    StudyTable table;

    Varied() {
        study.options.vary.resize(2);
        study.options.vary[0].spacing = Spacing::logarithmic;
        table.inputs = {"materials[0].young_Pa", "drive[0].displacement_mm[2]"};
        table.outputs = {"largest_displacement_mm"};
    }
    void add(double young, double press) {
        table.values.push_back({fmt::format("{}", young), fmt::format("{}", press)});
        table.results.push_back({10 * young});
        table.failures.emplace_back();
    }
};

TEST(UnitOf, IsThatOfTheScenesReference) {
    EXPECT_EQ(unit_of<Scene>("materials[0].young_Pa"), "Pa");
    EXPECT_EQ(unit_of<Scene>("drive[12].displacement_mm[2]"), "mm");
    EXPECT_EQ(unit_of<Scene>("gravity_m_per_s2[0]"), "m/s^2");
    EXPECT_EQ(unit_of<Scene>("materials[0].poisson"), "");
    EXPECT_EQ(unit_of<Scene>("materials[0].k1_Pa"), "Pa") << "a key of a model";
    EXPECT_EQ(unit_of<Scene>("no.such.key"), "");
}

TEST(StudyCharts, AxesHaveUnitsAndPointsTheColourOfTheOtherInput) {
    Varied v;
    for (const double young : {1000, 2000, 4000})
        for (const double press : {-4, -8}) v.add(young, press);
    v.table.failures[1] = "did not converge";
    const auto charts = study_charts(v.table, v.study, "largest_displacement_mm");
    ASSERT_EQ(charts.size(), 2u);
    const ScatterChart& c = charts[0];
    EXPECT_EQ(c.x_axis, "materials[0].young_Pa [Pa]");
    EXPECT_EQ(c.y_axis, "largest_displacement_mm [mm]");
    EXPECT_TRUE(c.logarithmic);
    EXPECT_EQ(c.colour_axis, "drive[0].displacement_mm[2] [mm]");
    EXPECT_EQ(c.groups, (std::vector<std::string>{"-8", "-4"})) << "by rising value";
    EXPECT_EQ(c.x, (std::vector<double>{1000, 2000, 2000, 4000, 4000}));
    EXPECT_EQ(c.group_of, (std::vector<std::size_t>{1, 1, 0, 1, 0}));
    EXPECT_EQ(charts[1].groups, (std::vector<std::string>{"1000", "2000", "4000"}));
}

TEST(StudyCharts, ManyValuesAreGroupedByFivePartsOfTheirRange) {
    Varied v;
    for (int k = 0; k <= 50; ++k) v.add(1000 * std::pow(100, k / 50.0), k);
    const auto charts = study_charts(v.table, v.study, "largest_displacement_mm");
    ASSERT_EQ(charts.size(), 2u);
    EXPECT_EQ(charts[0].groups.size(), 5u);
    EXPECT_EQ(charts[0].groups.front(), "0 to 10");
    EXPECT_EQ(charts[0].group_of.back(), 4u);
    EXPECT_EQ(charts[1].groups.front(), "1e+03 to 2.51e+03") << "equal ratios";
    v.table.inputs.resize(1);
    EXPECT_TRUE(study_charts(v.table, v.study, "largest_displacement_mm")[0].groups.empty())
        << "there is no other input";
}

}  // namespace
}  // namespace livetet
#endif
