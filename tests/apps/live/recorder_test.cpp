#include "apps/live/recorder.hpp"

#include <cmath>

#include "io/files.hpp"
#include "io/meshes.hpp"

namespace livetet {
namespace {

using namespace testing_files;

constexpr double older_file = -7;

/// A result of one frame and one sample of one tool; its numbers as a damaged file may have them.
struct Recorded {
    double sample = 1, status = 0, frame_sample = 1, checksum = 7, iterations = 2, ahead_s = 0.0173;

    std::string refusal() const {
        return error_of([&] { (void)read(); });
    }
    RecordedRun read() const {
        const auto path = fresh_folder() / "r.h5";
        ResultWriter writer(path, testing_meshes::cube(), "");
        std::vector<double> row(17, 0);
        row[0] = sample;
        row[4] = status;
        row[5] = row[10] = row[15] = 1;
        writer.append_row("arrivals", row);
        writer.append(0, std::vector<Vector3>(8, Vector3::Zero()));
        writer.append_values("sample", {{frame_sample}});
        writer.append_values("checksum", {{checksum}});
        std::vector<double> solves(2 * max_recorded_solves, 0);
        solves[0] = iterations;
        writer.append_values("solves", solves);
        if (ahead_s != older_file) writer.append_values("ahead_s", {{ahead_s}});
        writer.close();
        return read_recorded_run(ResultReader(path), "r.h5");
    }
};

TEST(RecordedRun, TellsByHowMuchPosesWereAheadIfTheFileDoes) {
    EXPECT_EQ(Recorded().read().frames.at(0).ahead_s, 0.0173) << "to the bit";
    EXPECT_EQ(Recorded{.ahead_s = older_file}.read().frames.at(0).ahead_s, std::nullopt);
    for (const double wrong : {std::nan(""), -0.01, 0.6})
        EXPECT_TRUE(says(Recorded{.ahead_s = wrong}.refusal(),
                         {"r.h5", "frame 0", "ahead_s", "expected from 0 to 0.5"}));
}

TEST(RecordedRun, NumbersThatStandForNoWholeOnesAreRefused) {
    EXPECT_EQ(Recorded().refusal(), "");
    for (const double wrong : {std::nan(""), -1.0, 1e300, 0.5}) {
        EXPECT_TRUE(says(Recorded{.sample = wrong}.refusal(),
                         {"r.h5", "sample", "expected a whole number"}));
        EXPECT_TRUE(says(Recorded{.status = wrong}.refusal(), {"status", "up to 5"}));
        EXPECT_TRUE(says(Recorded{.frame_sample = wrong}.refusal(), {"sample"}));
        EXPECT_TRUE(says(Recorded{.checksum = wrong}.refusal(), {"checksum"}));
        EXPECT_TRUE(says(Recorded{.iterations = wrong}.refusal(), {"iterations"}));
    }
}

Frame frame_with_sensors(std::vector<SensorState> sensors) {
    Frame frame;
    frame.displacement.assign(8, Vector3::Zero());
    frame.sensors = std::move(sensors);
    return frame;
}

/// Their order in the scene may change during a run.
TEST(SlippedSensors, AreToldByTheirToolsAndNotByTheirOrder) {
    using enum SensorTrouble;
    const SensorState first{.tool = 1, .trouble = none}, other{.tool = 3, .trouble = slipped},
        far{.tool = 52, .trouble = slipped};
    const std::uint64_t sum = slipped_sensors(frame_with_sensors({first, other, far}));
    EXPECT_EQ(slipped_sensors(frame_with_sensors({far, other, first})), sum);
    EXPECT_TRUE(is_slipped(sum, 3) && is_slipped(sum, 52));
    for (const std::size_t tool : {0, 1, 2, 53, 64, 67})
        EXPECT_FALSE(is_slipped(sum, tool)) << tool;
    EXPECT_EQ(slipped_sensors(frame_with_sensors({first, {.tool = 60, .trouble = slipped}})), 0u);
}

/// A patch that is released at once has slipped in one frame; `output.every` may leave that out.
TEST(Recorder, TheNextKeptFrameTellsTheSlipsOfThoseBetween) {
    using enum SensorTrouble;
    const Frame well = frame_with_sensors({{.tool = 1, .trouble = none}, {.tool = 2}}),
                one = frame_with_sensors({{.tool = 1, .trouble = slipped}, {.tool = 2}}),
                other = frame_with_sensors({{.tool = 1}, {.tool = 2, .trouble = slipped}});
    const auto path = fresh_folder() / "r.h5";
    ResultWriter writer(path, testing_meshes::cube(), "");
    ArrivalLog arrivals;
    Recorder recorder({&writer, nullptr}, SolverKind::multigrid, arrivals);
    EXPECT_TRUE(recorder.keep(well, {}, 0));
    recorder.pass_over(one);
    recorder.pass_over(well);
    EXPECT_TRUE(recorder.keep(other, {}, 0));
    EXPECT_TRUE(recorder.keep(well, {}, 0));
    EXPECT_EQ(recorder.close(), std::nullopt);
    writer.close();
    const ResultReader reader(path);
    ASSERT_EQ(reader.frame_count(), 3u);
    const std::uint64_t expected[] = {0, 1U << 1 | 1U << 2, 0};
    for (std::size_t k = 0; k < 3; ++k)
        EXPECT_EQ(read_slipped(reader, k, "r.h5"), expected[k]) << k;
}

}  // namespace
}  // namespace livetet
