#include "apps/live/recorder.hpp"

#include <cmath>

#include "io/files.hpp"
#include "io/meshes.hpp"

namespace livetet {
namespace {

using namespace testing_files;

/// A result of one frame and one sample of one tool; its numbers as a damaged file may have them.
struct Recorded {
    double sample = 1, status = 0, frame_sample = 1, checksum = 7, iterations = 2;

    std::string refusal() const {
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
        writer.close();
        return error_of([&] { (void)read_recorded_run(ResultReader(path), "r.h5"); });
    }
};

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

}  // namespace
}  // namespace livetet
