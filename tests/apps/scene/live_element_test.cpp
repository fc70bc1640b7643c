#include "apps/scene/live_element.hpp"

#include <gtest/gtest.h>

namespace livetet {
namespace {

constexpr Elements both[] = {Elements::p1, Elements::p2};
constexpr const char* laws[] = {"corotated", "neohookean"};

TEST(LiveElement, MeasuredRowsOfAKindStandTogetherByRisingTets) {
    for (const Elements elements : both)
        for (const char* law : laws) {
            const auto rows = live_front(elements, law);
            ASSERT_GE(rows.size(), 2u) << law;
            for (std::size_t k = 0; k < rows.size(); ++k) {
                EXPECT_EQ(rows[k].elements, elements);
                EXPECT_EQ(rows[k].law, law);
                if (k == 0) continue;
                EXPECT_GT(rows[k].tets, rows[k - 1].tets);
                EXPECT_GT(rows[k].frame_s, rows[k - 1].frame_s);
            }
        }
    EXPECT_TRUE(live_front(Elements::p1, "green").empty());
    EXPECT_EQ(measured_law("green"), "neohookean");
    EXPECT_EQ(measured_law("corotated"), "corotated");
}

TEST(LiveElement, ExpectedFramesPassThroughTheMeasuredRowsAndEndWithThem) {
    for (const Elements elements : both)
        for (const char* law : laws)
            for (const LiveFrontRow& row : live_front(elements, law)) {
                const auto expected = expected_frame(elements, law, row.tets);
                ASSERT_TRUE(expected);
                EXPECT_NEAR(expected->frame_s, row.frame_s, 1e-12);
                EXPECT_NEAR(expected->error, row.error, 1e-12);
            }
    const auto middle = expected_frame(Elements::p2, "neohookean", 10000);
    ASSERT_TRUE(middle);
    EXPECT_GT(middle->frame_s, 1.8e-3);
    EXPECT_LT(middle->frame_s, 4.0e-3);
    EXPECT_FALSE(expected_frame(Elements::p2, "neohookean", 2000));
    EXPECT_FALSE(expected_frame(Elements::p1, "corotated", 100000));
}

TEST(LiveElement, NothingThatFitsInTheFrameIsBetterThanTheBest) {
    double before = 1;
    for (const double frame_s : {0.6e-3, 1e-3, 1.5e-3, 3e-3, 5e-3, 8.5e-3, 0.02, 1.0}) {
        const auto best = best_live_element(frame_s);
        ASSERT_TRUE(best) << frame_s;
        EXPECT_LE(best->frame_s, frame_s);
        EXPECT_LE(best->error, before) << "more time, no larger error";
        before = best->error;
        for (const Elements elements : both)
            for (const char* law : laws)
                for (const LiveFrontRow& row : live_front(elements, law))
                    EXPECT_TRUE(row.frame_s > frame_s || row.error >= best->error) << frame_s;
        const auto corotated = best_live_element(frame_s, "corotated");
        ASSERT_TRUE(corotated);
        EXPECT_GE(corotated->error, best->error);
    }
    EXPECT_FALSE(best_live_element(0.2e-3));
    EXPECT_FALSE(best_live_element(0.4e-3, "neohookean"));
}

/// The corotated front is flat from 20,000 tets on: more time buys nothing.
TEST(LiveElement, TheBestCorotatedFrameIsNotTheOneOfTheMostTets) {
    EXPECT_NEAR(best_live_element(0.02, "corotated")->tets, 20117, 1);
}

TEST(LiveElement, ASceneIsToldWhatItsFrameTimeAllows) {
    Scene scene;
    scene.track.emplace();
    const std::string usual = describe_live_element(scene, 60330);
    EXPECT_NE(usual.find("within 10 ms a frame (track.budget is not set)"), std::string::npos);
    EXPECT_NE(usual.find("15154 tets of ten nodes, neohookean: 1.8 % of the press, 4.0 ms"),
              std::string::npos)
        << usual;
    EXPECT_NE(usual.find("60330 tets of four nodes, corotated: 3.9 %"), std::string::npos) << usual;
    scene.track->budget = "3 ms";
    scene.strain = "green";
    const std::string quick = describe_live_element(scene, 500);
    EXPECT_NE(quick.find("within 3 ms a frame (track.budget)"), std::string::npos) << quick;
    EXPECT_NE(quick.find("outside of what was measured"), std::string::npos) << quick;
    EXPECT_NE(quick.find("Frames with green were not measured"), std::string::npos) << quick;
    EXPECT_NE(describe_live_element(scene, 500, 0.1e-3).find("no row that was measured"),
              std::string::npos);
}

}  // namespace
}  // namespace livetet
