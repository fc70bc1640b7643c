#pragma once

#include <Eigen/Core>

#include <optional>
#include <vector>

#include "geometry/transform.hpp"

namespace livetet {

/// What of the sensor's motion the patch follows.
enum class DriveMotion { translation, rigid };

/// `placing`: the base pose is being measured, from where the sensor rests on, nothing moves;
/// `following`; `returning`: following again, limited in speed until caught up; `holding`: the
/// sensor is lost and the last motion stands; `releasing`: the patch is let go, little by little;
/// `released`: it is free.
enum class DriveStatus { placing, following, returning, holding, releasing, released };

struct SensorDriveOptions {
    DriveMotion motion = DriveMotion::translation;
    double base_window_s = 0.5;  ///< the base pose is the mean of the valid poses over this long
    double max_base_scatter = 0.01;  ///< m; a pose farther from the mean so far begins the base
                                     ///< anew: several times the noise
    double hold_s = 0.5;
    double release_s = 1;
    double max_displacement =
        0.1;  ///< m; a pose that would move the patch farther counts as missing
    double max_return_speed = 0.1;    ///< m/s, while catching up with a sensor that came back
    double max_return_turn_rate = 1;  ///< rad/s, likewise
};

/// A sensor that moves a patch of the organ. Its pose image_from_sensor when placed is the base;
/// afterwards the motion image_from_sensor * sensor_from_base (both in the image frame, so that
/// moving the organ as a whole deforms nothing) moves the patch: all of it, or its translation.
/// Knows no clock: all times are the samples'.
class SensorDrive {
  public:
    /// Throws Error for options that are negative (speeds: not positive).
    explicit SensorDrive(const SensorDriveOptions& options = {});

    /// One frame at `time_s`: the sensor's pose in the image, or nothing where it (or the
    /// registration) is missing or stale. A pose that is not finite counts as missing. A time
    /// before the last one counts as the last one.
    DriveStatus update(double time_s,
                       const std::optional<RigidTransform<ImageFrame, Sensor>>& image_from_sensor);

    /// The displacement (metres, image frame) of a patch node whose rest position (metres, image
    /// frame) is given.
    Eigen::Vector3d displacement(const Eigen::Vector3d& rest_position) const;

    /// How firmly the patch is held, from 1 (it goes where `displacement` says) to 0 (it is free).
    double grip() const { return grip_; }

    DriveStatus status() const { return status_; }
    /// Whether the last pose was farther from the base than `max_displacement`.
    bool is_too_far() const { return too_far_; }
    /// The pose when placed; empty while placing.
    const std::optional<RigidTransform<ImageFrame, Sensor>>& base() const { return base_; }
    /// Forgets the base: the sensor is placed anew.
    void reset() { *this = SensorDrive(options_); }

  private:
    /// The patch's motion: a turn about the sensor's base position (rotation vector, radians) and a
    /// translation (metres).
    struct Motion {
        Eigen::Vector3d turn = Eigen::Vector3d::Zero();
        Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    };
    void place(double time_s, const RigidTransform<ImageFrame, Sensor>& pose);
    void begin_base();
    Motion motion_to(const RigidTransform<ImageFrame, Sensor>& pose) const;
    void follow(double dt, const Motion& target);
    void release(double time_s);

    SensorDriveOptions options_;
    DriveStatus status_ = DriveStatus::placing;
    std::optional<RigidTransform<ImageFrame, Sensor>> base_;
    std::optional<double> last_s_;
    double first_s_ = 0, seen_s_ = 0;
    bool too_far_ = false;
    Eigen::Matrix3d rotation_sum_ = Eigen::Matrix3d::Zero();
    Eigen::Vector3d translation_sum_ = Eigen::Vector3d::Zero();
    int poses_ = 0;
    Motion motion_;
    double grip_ = 1;
};

}  // namespace livetet
