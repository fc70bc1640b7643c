// The path of a pose after it was read: outliers, estimates and lags, whatever times and poses a
// tracker sends.

#include <Eigen/Cholesky>

#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "base/error.hpp"
#include "fuzz/fuzz.hpp"
#include "tracking/pose_follower.hpp"

namespace livetet::fuzz {

namespace {

/// A sample as bytes: the numbers, then the status.
struct Record {
    /// Time; rotation as a quaternion w, x, y, z; translation.
    std::array<double, 8> numbers{0, 1, 0, 0, 0, 0, 0, 0};
    std::uint8_t status = 0;

    double time_s() const { return numbers[0]; }
    /// Poses reach the estimator with orthonormal rotations, or with numbers that are not finite.
    TrackedPose pose() const {
        Eigen::Quaterniond q(numbers[1], numbers[2], numbers[3], numbers[4]);
        const double norm = q.coeffs().stableNorm();
        if (norm > 1e-100 && std::isfinite(norm)) q.coeffs() /= norm;
        if (norm <= 1e-100) q.setIdentity();
        return {q.toRotationMatrix(),
                {numbers[5], numbers[6], numbers[7]},
                static_cast<PoseStatus>(status % 6)};
    }
};
constexpr std::size_t numbers_size = sizeof(Record::numbers), record_size = numbers_size + 1;

void append(Bytes& bytes, const Record& record) {
    const std::size_t at = bytes.size();
    bytes.resize(at + record_size);
    std::memcpy(&bytes[at], record.numbers.data(), numbers_size);
    bytes.back() = record.status;
}

void expect(bool holds) {
    if (!holds) std::abort();
}

void check_estimate(const PoseEstimate& estimate) {
    const Eigen::Matrix<double, 6, 6>& c = estimate.covariance;
    expect(estimate.translation.allFinite() && estimate.rotation.allFinite() && c.allFinite());
    const Eigen::Matrix<double, 6, 1> variances = c.diagonal();
    expect(variances.minCoeff() > 0 && c.isApprox(c.transpose()));
    const Eigen::Matrix<double, 6, 1> scale = variances.cwiseSqrt().cwiseInverse();
    const Eigen::Matrix<double, 6, 6> correlations = scale.asDiagonal() * c * scale.asDiagonal();
    expect((correlations + 1e-9 * Eigen::Matrix<double, 6, 6>::Identity()).llt().info() ==
           Eigen::Success);
}

void check_pose(const TrackedPose& pose) {
    const Eigen::Matrix3d unit = pose.rotation.transpose() * pose.rotation;
    expect(pose.translation.allFinite());
    expect((unit - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-6);
}

/// Throws Error if a pose was an outlier: the input was refused in part.
void follow(ByteView bytes, const PoseFollowerOptions& options) {
    bool is_outlier = false;
    PoseFollower follower(options);
    PoseSmoother smoother(options.estimator);
    for (; bytes.size() >= record_size; bytes = bytes.subspan(record_size)) {
        Record record;
        std::memcpy(record.numbers.data(), bytes.data(), numbers_size);
        record.status = bytes[numbers_size];
        const TrackedPose measured = record.pose();
        const PoseFollower::Result result = follower.update(record.time_s(), measured);
        is_outlier = is_outlier || result.verdict == PoseVerdict::held;
        if (result.verdict != PoseVerdict::unusable && result.pose.status == PoseStatus::ok)
            check_pose(result.pose);
        if (result.unfiltered.status == PoseStatus::ok) check_pose(result.unfiltered);
        if (const auto estimate = follower.estimator().predict(record.time_s()))
            check_estimate(*estimate);
        if (const auto lag_s = follower.quality().lag_s) expect(std::isfinite(*lag_s));
        smoother.update(record.time_s(), measured);
        if (const auto smoothed = smoother.smoothed()) check_estimate(*smoothed);
    }
    if (is_outlier) fail("a pose is an outlier");
}

/// The first byte chooses the options.
void follow(ByteView bytes) {
    if (bytes.empty()) return;
    const PoseFollowerOptions options[] = {{},
                                           {.ahead_s = 0.1},
                                           {.filter = PoseFilterOptions{.ahead_s = 0.04}},
                                           {.filter = PoseFilterOptions{.enabled = false}}};
    follow(bytes.subspan(1), options[bytes[0] % 4]);
}

/// Breathing at 40 Hz; with dropouts; with repeated times; with a clock that is set back.
std::vector<Bytes> seeds() {
    std::vector<Bytes> all;
    for (std::uint8_t kind = 0; kind < 16; ++kind) {
        all.push_back({kind});
        for (int k = 0; k < 120; ++k) {
            Record r;
            double& time_s = r.numbers[0];
            time_s = 0.025 * k;
            if (kind % 4 == 1 && k % 40 > 30) r.status = 1;
            if (kind % 4 == 2) time_s = 0.1 * (k / 4);
            if (kind % 4 == 3 && k > 60) time_s -= k > 90 ? 30 : 0.1;
            r.numbers[4] = 0.1 * std::cos(time_s);
            r.numbers[6] = 0.0075 * std::sin(1.5 * time_s);
            append(all.back(), r);
        }
    }
    return all;
}

}  // namespace

std::vector<Target> targets() {
    return {{"pose_times", [](ByteView bytes) { follow(bytes); }, seeds}};
}

}  // namespace livetet::fuzz

/// Entry point for libFuzzer, whose changes are guided by coverage.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    livetet::fuzz::follow({data, size});
    return 0;
}
