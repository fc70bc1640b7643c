#include "config/key_places.hpp"

#include <gtest/gtest.h>

namespace livetet {
namespace {

TEST(KeyPlaces, GivesTheLineOfAKeyOrOfTheTableAroundIt) {
    const KeyPlaces places("liver.yaml",
                           "mesh: {file: liver.h5}\n"
                           "track:\n"
                           "  ahead_ms: 40\n"
                           "  sensors:\n"
                           "    - {tool: Sensor}\n"
                           "    - tool: Other\n"
                           "      patch_spread_mm: 20\n");
    EXPECT_EQ(places("mesh.file"), "liver.yaml:1");
    EXPECT_EQ(places("track.ahead_ms"), "liver.yaml:3");
    EXPECT_EQ(places("track.sensors[0].tool"), "liver.yaml:5");
    EXPECT_EQ(places("track.sensors[1].patch_spread_mm"), "liver.yaml:7");
    EXPECT_EQ(places("track.sensors[1].placement"), "liver.yaml:6");
    EXPECT_EQ(places("track.sensors[7].tool"), "liver.yaml:5");
    EXPECT_EQ(places("output.file"), "liver.yaml");
    EXPECT_EQ(places(""), "liver.yaml");
}

TEST(KeyPlaces, WithoutATextThereIsTheFileAlone) {
    EXPECT_EQ(KeyPlaces("study.yaml, solve 3")("track.ahead_ms"), "study.yaml, solve 3");
    EXPECT_EQ(KeyPlaces("empty.yaml", "")("track.ahead_ms"), "empty.yaml");
    EXPECT_EQ(KeyPlaces("text.yaml", "word")("track.ahead_ms"), "text.yaml");
}

}  // namespace
}  // namespace livetet
