#pragma once

#include <optional>
#include <span>
#include <vector>

#include "mesh/surface_patch.hpp"
#include "tracking/live_registration.hpp"
#include "tracking/pose_filter.hpp"
#include "tracking/sample.hpp"
#include "tracking/sensor_drive.hpp"

namespace livetet {

/// Why a sensor is not followed: what its pose lacks (see PoseStatus; `lost`: missing), `jumped`:
/// it lies farther from the last pose than a sensor could go, `too_far`: than the organ could be
/// moved, `no_reference`: the reference sensor's pose is not to be had.
enum class SensorTrouble {
    none,
    lost,
    invalid,
    out_of_volume,
    stale,
    broken,
    jumped,
    too_far,
    no_reference
};

/// Of a pose and what the gate says of it.
SensorTrouble trouble_of(const TrackedPose& pose, GateVerdict verdict);

struct SensorPatchOptions {
    SensorDriveOptions drive{};
    PoseFilterOptions filter{};
    double radius = 0.015;  ///< of the patch, m, along the surface
    std::optional<double>
        stiffness{};  ///< N/m of the whole patch: it is pulled by springs; none: it is held hard
    double firm_stiffness = 1e4;  ///< N/m, the same as hard: where a hard patch begins to be let go
};

/// One deformation sensor and the patch of surface that goes with it.
class SensorPatch {
  public:
    explicit SensorPatch(const SensorPatchOptions& options)
        : options_(options), filter_(options.filter), drive_(options.drive) {}

    /// One frame: the sensor's pose and the one of the reference sensor, both of the same moment
    /// and not filtered, so that in their product the organ's own motion cancels and the filter
    /// sees the press alone. What is not usable, or jumps farther than a sensor could, counts as
    /// missing.
    void follow(double time_s, const TrackedPose& sensor, const OutlierGate::Result& reference,
                const RigidTransform<ImageFrame, Reference>& image_from_reference);

    /// Whether the sensor's place at rest is known and no patch is chosen yet.
    bool awaits_placement() const { return drive_.base() && nodes_.empty(); }
    /// Chooses the patch on the body as it is now: each node displaced (m) from the mesh's rest
    /// shape, whose surface has the nodes `surface`. Nothing is chosen, and nothing allocated,
    /// where the sensor lies farther than `farthest` (m) off them: it has to be placed anew.
    /// Returns how far it is.
    double place(const TetMesh& mesh, std::span<const std::int32_t> surface,
                 std::span<const Eigen::Vector3d> displacement, double farthest);

    const std::vector<std::int32_t>& nodes() const { return nodes_; }
    /// Where the k-th node is moved to: its displacement, m.
    Eigen::Vector3d target(std::size_t k) const {
        return placed_[k].offset + drive_.displacement(placed_[k].place);
    }
    /// How far the patch's middle has been moved since the sensor was placed, m.
    double press() const { return nodes_.empty() ? 0 : drive_.displacement(centre_).norm(); }

    bool is_hard() const { return !nodes_.empty() && !options_.stiffness && drive_.grip() == 1; }
    /// What springs hold the whole patch with, N/m; 0 where it is hard or free. While it is let go
    /// this falls by powers of ten, from what is as good as hard to what is as good as nothing.
    double spring_stiffness() const;

    const SensorDrive& drive() const { return drive_; }
    SensorTrouble trouble() const { return trouble_; }

  private:
    struct Placed {
        Eigen::Vector3d offset,
            place;  ///< when placed: the node's displacement, and where it was, m
    };
    SensorPatchOptions options_;
    OutlierGate gate_;
    PoseFilter filter_;
    SensorDrive drive_;
    std::vector<std::int32_t> nodes_;
    std::vector<Placed> placed_;
    Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
    SensorTrouble trouble_ = SensorTrouble::lost;
};

}  // namespace livetet
