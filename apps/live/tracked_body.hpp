#pragma once

#include <functional>
#include <list>
#include <optional>

#include "apps/scene/body_factory.hpp"
#include "tracking/live_registration.hpp"
#include "tracking/pose_filter.hpp"
#include "tracking/sample.hpp"
#include "tracking/sensor_patch.hpp"

namespace livetet {

/// What one deformation sensor does in a frame.
struct SensorState {
    DriveStatus drive = DriveStatus::placing;
    SensorTrouble trouble = SensorTrouble::lost;
    double press = 0;  ///< how far the middle of its patch was moved since the sensor was placed, m
    double off_organ =
        0;  ///< how far off the surface it was when it could not be placed, m; 0: it could
    std::optional<RigidTransform<ImageFrame, Sensor>>
        base{};  ///< its place at rest, once that is known
};

/// A marker that is pulled by hand: where on the organ, as it was then, it was set, and where it is
/// pulled to (image frame, m). `number`: counted up with each marker, from 1.
struct HandPull {
    int number = 0;
    Vector3 base = Vector3::Zero(), to = Vector3::Zero();
};

/// What one frame came to, but for the displacement.
struct FrameState {
    double time_s = 0;  ///< the sample's own time stamp
    RigidTransform<Tracker, ImageFrame> tracker_from_image;
    RegistrationStatus registration = RegistrationStatus::lost;
    SensorTrouble reference = SensorTrouble::lost;
    double press = 0;                          ///< the largest of the sensors', m
    std::vector<SensorState> sensors;          ///< as the scene lists them
    std::vector<TrackedPose> image_from_tool;  ///< as `TrackedBody::tools` lists them
    std::optional<HandPull> pull{};
    StepReport step;
    double sensor_s = 0,
           output_s =
               0;  ///< what the way from sample to constraints took, and the displacement's out
};
struct Frame : FrameState {
    std::vector<Vector3> displacement;  ///< m, each node of the finest mesh
};

/// What a frame may take: it is to be done by `deadline`, as near to converged as that allows;
/// `iterations` of each solve at most (0: as the scene says); `by_halves`: one half of the operator
/// renewed, the other by the next frame, which else only a near deadline leads to; `as_done`: as an
/// earlier frame was solved, to the bit.
struct FrameLimits {
    std::optional<Clock::time_point> deadline{};
    int iterations = 0;
    bool by_halves = false;
    const std::array<SolveRecord, max_recorded_solves>* as_done = nullptr;
};

/// The place of a tool in the samples' poses; throws Error where there is none of that name.
using ToolFinder = std::function<std::size_t(const std::string& tool)>;
/// That of a list of names.
ToolFinder tool_finder(std::vector<std::string> tools);

/// An edited scene with all that its files say of sensors, tools and fixed nodes.
struct SceneChange {
    Scene scene;
    SceneConstraints constraints;
    std::vector<RigidTransform<Tool, Tip>> tips;  ///< as track.tools lists them
};

/// Reads the masks and tips of `scene`. Throws Error where one is not good, or nothing would hold
/// the body.
SceneChange prepare_change(const Scene& scene, const TetMesh& mesh);

/// What a sensor's patch is in this scene.
SensorPatchOptions sensor_patch_options(const Scene& scene, const SensorOptions& sensor);

/// How far off the organ's surface a sensor may be when it is placed, m.
inline constexpr double farthest_from_organ = 0.02;

/// From a tracker's sample to the deformed organ: registration by the reference sensor, the
/// deformation sensors' patches, the constraints, one time step. Its times are the samples'; a
/// clock decides only when to stop solving.
class TrackedBody {
  public:
    /// Throws Error where a tool of the scene is not found, or nothing holds the body when no
    /// sensor does. `misplaced_waits`: a sensor that is not on the organ when it is placed is
    /// placed again later, which the frame says; else `advance` throws Error.
    TrackedBody(const Scene& scene, SceneBody& body, ToolFinder find_tool,
                const RigidTransform<ImageFrame, Reference>& image_from_reference,
                bool misplaced_waits = false);

    /// One frame. After the first ones nothing is allocated, but where a patch is placed, let go or
    /// taken hold of.
    const Frame& advance(const TrackerSample& sample, FrameLimits limits = {});

    /// Takes up the sensors, tools and fixed nodes of another state of the scene, without reading
    /// any file. A sensor whose entry is gone or has changed holds its patch and lets it go as a
    /// lost one does; what is new is placed first. Nodes that are fixed from now on are led to
    /// their place at rest in `track.release_s`. Throws Error, and changes nothing, where that
    /// cannot be.
    void change(SceneChange&& change);

    /// From the next frame on a patch about the marker's base goes with it, as with a sensor that
    /// was placed there at once; of an earlier marker, or with nothing, it is let go as that of a
    /// lost sensor is. A base that is farther than `farthest_from_organ` off the surface moves
    /// nothing.
    void pull(const std::optional<HandPull>& pull);

    struct ShownTool {
        std::string tool;
        bool has_tip = false;
        std::size_t pose = 0;  ///< its place in the samples' poses
    };
    /// What `Frame::image_from_tool` shows: the reference, the sensors, the tools of the scene.
    const std::vector<ShownTool>& tools() const { return shown_; }

    /// Nodes that follow sensors and that the scene does not hold, and where to: the frame's
    /// prescribed displacements, m.
    const std::vector<std::int32_t>& driven() const { return driven_; }
    const std::vector<Vector3>& driven_to() const { return driven_to_; }
    /// All constraints but the values of `driven`.
    const Constraints& constraints() const { return constraints_; }

  private:
    struct Sensor {
        SensorOptions options;
        std::size_t pose = 0;
        bool leaving = false;  ///< its entry, or the hand's marker, is gone: it is lost for good
        int by_hand = 0;       ///< the marker's number; 0: a tracked sensor
        SensorPatch patch;
        bool is_hard = false;
        double off_organ = 0;
    };
    /// Nodes that were fixed while displaced, on their way to rest.
    struct Settling {
        std::vector<std::int32_t> nodes;
        std::vector<Vector3> from, now;
        double since_s = 0;
    };
    Sensor new_sensor(const SensorOptions& options) const;
    void follow_hand(Sensor& sensor);
    void find_shown(std::vector<RigidTransform<Tool, Tip>> tips);
    void begin_settling(const std::vector<std::uint8_t>& before);
    void follow(const TrackerSample& sample);
    void place_patches();
    void take_constraints();
    void move_patches();
    void pull_patches();
    void settle();

    Scene scene_;
    SceneBody& body_;
    ToolFinder find_tool_;
    bool misplaced_waits_;
    std::size_t reference_;
    OutlierGate reference_gate_;
    PoseFilter reference_filter_;
    LiveRegistration registration_;
    std::optional<SceneConstraints> scene_constraints_;
    Constraints constraints_;
    Springs springs_;
    bool pulled_ = false;        ///< some patch is held by springs
    int hand_ = 0;               ///< the last marker's number
    std::list<Sensor> sensors_;  ///< as the scene lists them, then those that leave
    std::vector<ShownTool> shown_;
    std::vector<RigidTransform<Tool, Tip>> tips_;  ///< of those shown
    std::vector<std::int32_t> surface_;            ///< nodes of the mesh's surface
    std::vector<std::int32_t> driven_;
    std::vector<Vector3> driven_to_;
    std::vector<std::int32_t> driven_slot_;  ///< of each node, in driven_; -1
    std::vector<int> driven_by_;             ///< how many patches hold it
    std::optional<Settling> settling_;
    double tail_s_ = 0;  ///< what a frame still needs after its last solve: the most of late
    std::optional<double> last_time_s_;
    Frame frame_;
};

}  // namespace livetet
