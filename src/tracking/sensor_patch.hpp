#pragma once

#include <optional>
#include <span>
#include <vector>

#include "mesh/opened_nodes.hpp"
#include "mesh/surface_patch.hpp"
#include "mesh/surface_ring.hpp"
#include "tracking/live_registration.hpp"
#include "tracking/pose_follower.hpp"
#include "tracking/sample.hpp"
#include "tracking/sensor_drive.hpp"
#include "tracking/slip_monitor.hpp"

namespace livetet {

/// Why a sensor is not followed. `lost` to `broken` repeat the pose's status (`lost`: missing).
/// - `jumped`: an outlier: neither noise nor motion explains the pose.
/// - `too_far`: farther from its base than the organ can be moved.
/// - `no_reference`: the reference sensor's pose is not available.
/// - `restless`: it cannot be placed, as it does not rest.
/// - `slipped`: it slipped over the organ; its patch is being released.
enum class SensorTrouble {
    none,
    lost,
    invalid,
    out_of_volume,
    stale,
    broken,
    jumped,
    too_far,
    no_reference,
    restless,
    slipped
};

/// The trouble of a pose, given the estimator's verdict on it.
SensorTrouble trouble_of(const TrackedPose& pose, PoseVerdict verdict);

/// Options of a SensorPatch.
struct SensorPatchOptions {
    SensorDriveOptions drive{};
    PoseFollowerOptions follower{};  ///< its noise is that of one tool
    double radius = 0.015;           ///< of the patch along the surface, m
    /// What the radius may be off by, one standard deviation, m.
    double radius_spread = 0.00225;
    /// Total stiffness of the springs that pull the patch, N/m; none: the displacement is
    /// prescribed.
    std::optional<double> stiffness{};
    /// Spring stiffness that is practically rigid, N/m: where the release of a prescribed patch
    /// begins.
    double firm_stiffness = 1e4;
    bool may_slip = true;  ///< false: all of its motion moves the patch
};

/// How far the motion of a sensor since it was placed may be off, by the noise of its pose and of
/// the reference sensor's. Along the axes of the image.
struct PatchError {
    /// Covariance of (translation, rotation vector), m and rad, without the part that the reference
    /// sensor's present pose brings in.
    Eigen::Matrix<double, 6, 6> own = Eigen::Matrix<double, 6, 6>::Zero();
    double by_reference = 0;  ///< mean square of the translation's error by that part, m^2
    /// Covariance of the place at which the sensor was placed, m^2; a part of `own`.
    Eigen::Matrix3d base = Eigen::Matrix3d::Zero();
    double base_by_reference = 0;  ///< mean square of its part by the reference sensor, m^2
};

/// A deformation sensor and the surface patch that it moves. Order of use: `follow` in every frame,
/// then `judge_slip`; `place` when `awaits_placement` is true; then `nodes`, `target` and
/// `spring_stiffness` give the patch's constraint. The patch of a sensor that slipped is released
/// as if the sensor were lost. Then the patch is given up, and the sensor placed anew.
class SensorPatch {
  public:
    explicit SensorPatch(const SensorPatchOptions& options)
        : options_(options), drive_(options.drive) {}

    /// Processes one frame. Takes the poses of the sensor and of the reference sensor at the same
    /// time, both as measured: the organ's own motion cancels in their product, and only the press
    /// is filtered. `tracker_from_reference` is empty where the reference may not be used. An
    /// unusable pose or an outlier counts as missing. `ahead_s`: as PoseFollower::update.
    void follow(double time_s, const TrackedPose& sensor,
                const std::optional<RigidTransform<Tracker, Reference>>& tracker_from_reference,
                const RigidTransform<ImageFrame, Reference>& image_from_reference,
                std::optional<double> ahead_s = {});

    /// Judges whether the sensor slips; see SlipMonitor. `displacement`: of the model's nodes in
    /// the last frame, m. `ring_response`: displacement of the ring() for a translation of this
    /// patch while the others rest, m/m, where other patches have moved the model since this one
    /// was placed; none: there were no others, and the tissue moves by this patch alone.
    ///
    /// Let u be the ring's displacement since placement, d the sensor's at the ring's middle, and K
    /// the response. Were the patch free, the others would move the tissue there by w, so
    ///
    ///     u = K d + (1 - K) w,     and the excess is     d - w = (1 - K)^-1 (d - u).
    ///
    /// Call it only in frames in which the model follows all that moves the organ: a patch that is
    /// held or let go elsewhere moves the model otherwise than the organ. Allocates nothing.
    void judge_slip(double time_s, std::span<const Eigen::Vector3d> displacement,
                    const std::optional<Eigen::Matrix3d>& ring_response);
    /// What moves the model until slips are judged again is no motion of the organ, as fixed nodes
    /// have changed: it does not count.
    void leave_ring_out() {
        is_ring_moved_ = true;
        monitor_.restart();
    }
    /// From the next frame on, the sensor is taken for one that slipped, if it has a patch.
    void let_go();
    /// How often it slipped so far.
    int slips() const { return slips_; }

    /// Whether the sensor's base is known and no patch has been chosen yet.
    bool awaits_placement() const { return drive_.base() && nodes_.empty(); }
    /// Chooses the patch on the body in its current shape: the rest shape moved by `displacement`
    /// (one vector a node, m); `surface` lists the surface nodes. If the sensor is farther than
    /// `farthest` (m) from the surface, chooses nothing, allocates nothing, and restarts the
    /// placement. Returns the distance of the sensor from the surface, m.
    double place(const TetMesh& mesh, std::span<const std::int32_t> surface,
                 std::span<const Eigen::Vector3d> displacement, double farthest);

    /// A cut changed nodes of the mesh: those of the patch that moved follow the sensor at their
    /// new places, as if the body was not strained when the sensor was placed, and copies of its
    /// nodes join it. `first`: number of the first copy, after all other nodes. The ring around the
    /// patch keeps its nodes.
    void follow_cut(std::size_t first, const OpenedNodes& opened);

    const std::vector<std::int32_t>& nodes() const { return nodes_; }
    /// Prescribed displacement of the k-th patch node, m.
    Eigen::Vector3d target(std::size_t k) const {
        return placed_[k].offset + drive_.displacement(placed_[k].place);
    }
    /// Displacement of the patch's centre since the sensor was placed, m; 0 if the patch is free.
    double press() const {
        return nodes_.empty() || drive_.grip() == 0 ? 0 : drive_.displacement(centre_).norm();
    }
    /// The patch's motion since then, as SensorDrive::motion; zero if it is free.
    Eigen::Matrix<double, 6, 1> motion() const {
        if (nodes_.empty() || drive_.grip() == 0) return Eigen::Matrix<double, 6, 1>::Zero();
        return drive_.motion();
    }

    bool is_hard() const { return !nodes_.empty() && !options_.stiffness && drive_.grip() == 1; }
    /// Total spring stiffness of the patch, N/m; 0 if the patch is prescribed or free. During a
    /// release it decreases by powers of ten from practically rigid to practically free.
    double spring_stiffness() const;

    /// The error of the patch's motion by the noise of sensor and reference; empty while the patch
    /// does not follow the sensor, if that slipped, or if its pose is filtered.
    std::optional<PatchError> error() const;
    /// From the sensor's base to the centroid of the patch, along the surface, m.
    const Eigen::Vector3d& off_centre() const { return off_centre_; }
    /// Where the sensor was placed on the body at rest, m.
    const Eigen::Vector3d& rest_place() const { return rest_place_; }
    /// Outward normal of the surface at the patch, when it was placed.
    const Eigen::Vector3d& normal() const { return normal_; }
    /// The nodes of a patch whose radius is greater by wider_by(), m: by the radius' spread, or by
    /// as much as makes a difference on this mesh. That of a disc of the same area counts.
    const std::vector<std::int32_t>& wider_nodes() const { return wider_; }
    double wider_by() const { return wider_by_; }
    const SensorPatchOptions& options() const { return options_; }
    /// The tissue around the patch.
    const SurfaceRing& ring() const { return ring_; }

    const SensorDrive& drive() const { return drive_; }
    SensorTrouble trouble() const { return trouble_; }
    PoseQuality quality() const { return follower_ ? follower_->quality() : PoseQuality{}; }

  private:
    void find_wider(const SurfaceNeighbourhood& around, double area);
    void give_up_patch();
    double deviation() const;

    struct Placed {
        Eigen::Vector3d offset;  ///< displacement of the node at placement, m
        Eigen::Vector3d place;   ///< position of the node at placement, m
    };
    SensorPatchOptions options_;
    std::optional<PoseFollower> follower_;  ///< of image_from_sensor; none before the first pose
    SensorDrive drive_;
    std::vector<std::int32_t> nodes_;
    std::vector<Placed> placed_;
    Eigen::Vector3d centre_ = Eigen::Vector3d::Zero(), off_centre_ = Eigen::Vector3d::Zero(),
                    normal_ = Eigen::Vector3d::UnitZ();
    Eigen::Vector3d rest_place_ = Eigen::Vector3d::Zero();
    std::vector<std::int32_t> wider_;
    double wider_by_ = 0;
    double reference_share_ = 0.5;  ///< of the mean square of the translation's noise
    SensorTrouble trouble_ = SensorTrouble::lost;
    SurfaceRing ring_;
    Eigen::Vector3d ring_placed_ = Eigen::Vector3d::Zero();  ///< its displacement at placement, m
    /// By which the others moved the tissue since then, when last judged, m.
    Eigen::Vector3d by_others_ = Eigen::Vector3d::Zero();
    bool is_ring_moved_ = false;  ///< see leave_ring_out
    SlipMonitor monitor_;
    bool slipped_ = false;
    int slips_ = 0;
};

}  // namespace livetet
