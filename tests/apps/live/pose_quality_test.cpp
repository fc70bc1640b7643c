#include "apps/live/pose_quality.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/error.hpp"

namespace livetet {
namespace {

using nlohmann::json;

TEST(PoseQualities, AreReadAsTheyWereWritten) {
    const PoseQualities poses{{"Reference", {0.0125, 1, 2.5}}, {"Sensor", {{}, 3, 1}}};
    const PoseQualities read = parse_pose_qualities(json_of(poses), "r.h5");
    ASSERT_EQ(read.size(), 2u);
    EXPECT_NEAR(*read.at("Reference").lag_s, 0.0125, 1e-15);
    EXPECT_EQ(read.at("Reference").rotation_noise_ratio, 2.5);
    EXPECT_FALSE(read.at("Sensor").lag_s);
    EXPECT_EQ(read.at("Sensor").position_noise_ratio, 3);
}

TEST(PoseQualities, NameWhatIsNotANumber) {
    for (const char* text : {"[]", "{\"Sensor\": 1}", "{\"Sensor\": {}}",
                             "{\"Sensor\": {\"position_noise_ratio\": 1, "
                             "\"rotation_noise_ratio\": 1, \"lag_ms\": \"late\"}}",
                             "{\"Sensor\": {\"position_noise_ratio\": null, "
                             "\"rotation_noise_ratio\": 1}}"})
        EXPECT_THROW(parse_pose_qualities(json::parse(text), "r.h5"), Error) << text;
}

TEST(PoseQualities, TellWhatIsTwiceAsNoisyAsStated) {
    EXPECT_EQ(noise_text({{"Reference", {{}, 1.9, 1.9}}}), "");
    EXPECT_EQ(noise_text({{"Reference", {{}, 1, 2.5}}, {"Sensor", {{}, 3.06, 1}}}),
              "noise of Reference 2.5 times, Sensor 3.1 times what track.position_noise_mm and "
              "rotation_noise_deg say");
}

TEST(PoseQualities, TellWhatLagsAndWhatIsAhead) {
    EXPECT_EQ(lags_text({{"Reference", {}}}), "");
    EXPECT_EQ(lags_text({{"Reference", {-0.0003}}, {"Sensor", {-0.048}}}),
              "Reference 0 ms, Sensor 48 ms ahead");
}

}  // namespace
}  // namespace livetet
