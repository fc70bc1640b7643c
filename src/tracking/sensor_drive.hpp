#pragma once

#include <Eigen/Core>

#include <optional>
#include <vector>

#include "geometry/transform.hpp"
#include "tracking/rest_average.hpp"

namespace livetet {

/// Which part of the sensor's motion the patch follows.
enum class DriveMotion { translation, rigid };

/// State of a sensor drive.
/// - `placing`: the base pose is being averaged while the sensor rests; the patch does not move. A
///   sensor that does not rest is waited for.
/// - `following`: the patch follows the sensor.
/// - `returning`: the sensor came back; the patch catches up at limited speed.
/// - `holding`: the sensor is lost; the last motion stands.
/// - `releasing`: the patch is released gradually.
/// - `released`: the patch is free.
enum class DriveStatus { placing, following, returning, holding, releasing, released };

/// Options of a SensorDrive. Times: how long a lost sensor's motion is held, then released.
struct SensorDriveOptions {
    DriveMotion motion = DriveMotion::translation;
    double base_window_s = 0.5;  ///< averaging time of the base pose
    /// A pose farther than this from the running mean restarts the averaging of the base pose, m.
    /// Set it to several times the tracker's noise.
    double max_base_scatter = 0.01;
    double max_base_drift = 0.002;  ///< RestAverageOptions::max_drift, m
    double hold_s = 0.5;
    double release_s = 1;
    /// A pose that would move the patch farther than this counts as missing, m.
    double max_displacement = 0.1;
    double max_return_speed = 0.1;    ///< m/s, in state `returning`
    double max_return_turn_rate = 1;  ///< rad/s, in state `returning`
};

/// Turns a sensor's motion into the motion of a patch of the organ. The mean pose image_from_sensor
/// after placement is the base; then the motion image_from_sensor * sensor_from_base, or its
/// translation alone, moves the patch. Both poses are in the image frame, so a motion of the whole
/// organ deforms nothing. All times are the samples'; the class reads no clock.
class SensorDrive {
  public:
    /// Throws Error if a time is negative or a limit is not positive.
    explicit SensorDrive(const SensorDriveOptions& options = {});

    /// Processes one frame at `time_s`. `image_from_sensor` is empty if the sensor or the
    /// registration is missing or stale. A pose that is not finite counts as missing. A time before
    /// the last one counts as the last one.
    DriveStatus update(double time_s,
                       const std::optional<RigidTransform<ImageFrame, Sensor>>& image_from_sensor);

    /// Displacement (metres, image frame) of a patch node with the given rest position (metres,
    /// image frame).
    Eigen::Vector3d displacement(const Eigen::Vector3d& rest_position) const;

    /// Motion since the base: translation (m) and rotation vector (rad) about the base's position.
    Eigen::Matrix<double, 6, 1> motion() const {
        Eigen::Matrix<double, 6, 1> motion;
        motion << motion_.translation, motion_.turn;
        return motion;
    }
    /// How firmly the patch is constrained: 1 prescribes `displacement`, 0 leaves the patch free.
    double grip() const { return grip_; }

    DriveStatus status() const { return status_; }
    /// Whether the last pose was farther from the base than `max_displacement`.
    bool is_too_far() const { return too_far_; }
    /// Whether the sensor is not placed because it was seen to move.
    bool is_restless() const { return !base_ && rest_.state() == RestAverage::State::moving; }
    /// image_from_sensor at the base; empty while placing.
    const std::optional<RigidTransform<ImageFrame, Sensor>>& base() const { return base_; }
    /// Number of poses that the base is the mean of, or will be.
    int base_poses() const { return rest_.poses(); }
    /// If no pose comes from now on, the patch is released at once, without `hold_s`.
    void stop_holding() { seen_s_ -= options_.hold_s; }
    /// Discards the base; the sensor must be placed again.
    void reset() { *this = SensorDrive(options_); }

  private:
    /// Motion of the patch: a rotation vector (radians) about the sensor's base position and a
    /// translation (metres).
    struct Motion {
        Eigen::Vector3d turn = Eigen::Vector3d::Zero();
        Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    };
    void place(double time_s, const RigidTransform<ImageFrame, Sensor>& image_from_sensor);
    Motion motion_to(const RigidTransform<ImageFrame, Sensor>& image_from_sensor) const;
    void follow(double dt, const Motion& target);
    void release(double time_s);

    SensorDriveOptions options_;
    DriveStatus status_ = DriveStatus::placing;
    std::optional<RigidTransform<ImageFrame, Sensor>> base_;
    std::optional<double> last_s_;
    double seen_s_ = 0;
    bool too_far_ = false;
    RestAverage rest_;
    Motion motion_;
    double grip_ = 1;
};

}  // namespace livetet
