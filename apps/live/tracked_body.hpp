#pragma once

#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "apps/live/cut_opening.hpp"
#include "apps/live/frame.hpp"
#include "apps/live/patch_options.hpp"
#include "apps/live/pose_quality.hpp"
#include "apps/scene/body_factory.hpp"
#include "mesh/mesh_pieces.hpp"
#include "mesh/turned_elements.hpp"
#include "tracking/live_registration.hpp"
#include "tracking/pose_follower.hpp"
#include "tracking/sample.hpp"
#include "tracking/sensor_patch.hpp"

namespace livetet {

/// Limits of a frame, as FrameControls has them, and the time that it is for. `deadline`: when the
/// frame must be done, with its displacement read. `ahead_s`: time by which the pose estimator
/// predicts beyond the sample, s, from 0 to 0.5; none: as the scene says.
struct FrameLimits {
    std::optional<Deadline> deadline{};
    std::optional<int> max_iterations{};  ///< of each linear solve; none: as the scene says
    RenewalExtent renewal = RenewalExtent::whole;
    const SolveRecords* as_done = nullptr;
    std::optional<double> ahead_s{};
};

/// What becomes of a sensor that is not on the organ when it is placed: `advance` throws Error; or
/// it is tried again in later frames, which report it.
enum class MisplacedSensor { refuse, wait };

/// Finds the index of a tool in the samples' poses. Throws Error if there is no such tool.
using ToolFinder = std::function<std::size_t(const std::string& tool)>;
/// Finds a tool in a list of names.
ToolFinder tool_finder(std::vector<std::string> tools);

/// An edited scene, with the contents of its files on sensors, tools and fixed nodes.
struct SceneChange {
    Scene scene;
    SceneConstraints constraints;
    std::vector<FixOptions> fix;                  ///< scene.fix, its selections as lists of nodes
    std::vector<RigidTransform<Tool, Tip>> tips;  ///< in the order of track.tools
};

/// Reads the masks and tips of `scene`. `mesh`: as it was loaded, whatever blades have cut since.
/// Throws Error if a file is invalid, if `place_mm` of a sensor is off the body, or if nothing
/// would fix the body.
SceneChange prepare_change(const Scene& scene, const TetMesh& mesh);

/// Maximum distance from the organ's surface of a sensor that is placed, m.
inline constexpr double farthest_from_organ = 0.02;

/// Computes the deformed organ from a tracker's sample: registration by the reference sensor, cuts
/// by blades, the deformation sensors' patches, the constraints, one time step. Time is that of the
/// samples; a clock only decides when to stop solving.
///
/// When a cut opens, the mesh gets nodes, and a body is made anew on it, between frames if
/// prepare_cut is called: `FrameState::cut` and SceneBody::mesh() have the new mesh from that frame
/// on. References to the old one end.
class TrackedBody {
  public:
    /// `body` is on the scene's mesh as it was loaded. Throws Error if a tool of the scene is not
    /// found, if nothing fixes the body without sensors, or if `track.start` is no state of this
    /// body (see start_state.hpp).
    TrackedBody(const Scene& scene, SceneBody& body, ToolFinder find_tool,
                const RigidTransform<ImageFrame, Reference>& image_from_reference,
                MisplacedSensor misplaced = MisplacedSensor::refuse);

    /// Computes a frame. Blades also cut where they were in the samples that were `passed` over
    /// since the last frame. Allocates nothing after the first frames, except when a patch is
    /// placed, released or taken up again, and while a blade is near the organ.
    const Frame& advance(const TrackerSample& sample, FrameLimits limits = {},
                         std::span<const TrackerSample> passed = {});

    /// Applies a changed scene: sensors, tools and fixed nodes, without reading a file. A sensor
    /// that was removed or changed releases its patch as a lost one does; new ones are placed
    /// first. Newly fixed nodes are led to rest within `track.release_s`. Throws Error, and changes
    /// nothing, if the change is invalid, or if it has a blade and the scene had none at the start.
    void change(SceneChange&& change);

    /// From the next frame on, a patch about the marker's base follows the marker as it would
    /// follow a sensor placed there. The patch of an earlier marker is released, as is the last one
    /// if `pull` is empty. A base more than `farthest_from_organ` off the surface moves nothing.
    void pull(const std::optional<HandPull>& pull);

    /// The next frame cuts along a line; none: along none. Only for scenes with
    /// track.cut_by_hand_mm.
    void cut_by_hand(std::shared_ptr<const HandCut> cut);

    /// From the next frame on, frames state the errors at the scene's targets. `registration`: the
    /// error of image_from_reference; none: not known.
    void state_errors(std::unique_ptr<ErrorStatement> statement,
                      const std::optional<ExpectedRegistrationError>& registration);
    /// From the next frame on, slips of sensors beside others are judged with these responses,
    /// which have no places. For scenes without targets: a statement brings its own. Without
    /// either, they are judged as if a patch did not move the tissue around it.
    void judge_slips_by(std::unique_ptr<TargetResponses> responses);
    /// The targets of `Frame::statement`; none if errors are not stated.
    const std::vector<std::string>& target_names() const { return stating_.names; }
    /// Call it after each frame, once that was passed on: after patches were placed, it makes a
    /// part of the solves that the statement, or judging slips, needs. As a rule it does nothing,
    /// as while a cut is being opened. Returns false if nothing is to be done now.
    bool work_on_responses();

    /// Call it between frames: prepares the next opening of a cut until `is_over`, which another
    /// thread asks every few milliseconds while this one waits. Returns true if there is nothing
    /// left to do. What is left when it is time to open the cut, a frame does.
    bool prepare_cut(const std::function<bool()>& is_over);

    struct ShownTool {
        std::string tool;
        bool has_tip = false;
        std::size_t pose = 0;              ///< index in the samples' poses
        std::optional<BladeEdge> blade{};  ///< from the tip, m
    };
    /// The tools of `Frame::image_from_tool`: reference, sensors, tools of the scene.
    const std::vector<ShownTool>& tools() const { return shown_; }
    bool is_cutting() const { return cutting_ != nullptr; }

    /// The last frame, without its displacement.
    const FrameState& last() const { return frame_; }
    /// The last frame of a body that ends: its displacement stays where it is.
    Frame take_frame() && { return std::move(frame_); }

    /// Nodes that follow sensors and are not fixed by the scene, and their displacements in this
    /// frame, m.
    const std::vector<std::int32_t>& driven() const { return driven_.nodes; }
    const std::vector<Vector3>& driven_to() const { return driven_.to; }
    /// All constraints, without the values of `driven`.
    const Constraints& constraints() const { return constraints_; }

  private:
    struct Sensor {
        SensorOptions options;
        std::size_t pose = 0;
        bool leaving = false;  ///< the sensor was removed or the marker let go: lost for good
        int by_hand = 0;       ///< number of the marker; 0: a tracked sensor
        SensorPatch patch;
        bool is_hard = false, holds = false;
        double off_organ = 0;
        /// Other sensors have moved the model since it was placed.
        bool had_others = false;
    };
    /// Nodes that were fixed while displaced, on their way to rest.
    struct Settling {
        std::vector<std::int32_t> nodes;
        std::vector<Vector3> from, now;
        double since_s = 0;
    };
    struct Stating {
        std::unique_ptr<ErrorStatement> statement;  ///< none: no targets
        std::vector<std::string> names;             ///< of the targets
        std::optional<ExpectedRegistrationError> registration;
        std::unique_ptr<TargetResponses> for_slips;  ///< where no errors are stated
        std::vector<const SensorPatch*> patches;     ///< that the responses are of
        std::vector<FixOptions> fix;                 ///< as SceneChange::fix: needs no file
        bool is_outdated = true;                     ///< patches or fixed nodes have changed
        /// Forgets all but what is fixed.
        void restart() {
            std::vector<FixOptions> kept = std::move(fix);
            *this = {};
            fix = std::move(kept);
        }
    };
    /// Nodes that follow sensors.
    struct Driven {
        std::vector<std::int32_t> nodes;
        std::vector<Vector3> to;         ///< m
        std::vector<std::int32_t> slot;  ///< index in `nodes` of each node, or -1
        std::vector<int> by;             ///< number of patches that hold each of `nodes`
    };
    /// A piece of a static body that neither fix nor drive holds.
    struct FreePiece {
        std::vector<std::int32_t> nodes;
        std::vector<Vector3> at{};  ///< where it rests, m; empty while a sensor carries it
    };
    /// What a scene with blades needs.
    struct Cutting {
        BladeCuts cuts;
        Scene listed;  ///< its selections as lists of nodes of the present mesh: needs no file
        std::vector<PoseFollower> followers{};          ///< of image_from_tool, one a blade
        std::vector<std::optional<BladeEdge>> edges{};  ///< in the image, m
        std::vector<FreePiece> free{};                  ///< of a static scene
        /// Free pieces that were told of, by their first cell and number of cells.
        std::set<std::pair<std::int32_t, std::size_t>> told{};
        std::unique_ptr<CutOpening> opening{};  ///< none: nothing is to open
        std::unique_ptr<CutBody> replaced{};    ///< the body before the last opening: to be freed
    };
    Sensor new_sensor(const SensorOptions& options) const;
    void follow_hand(Sensor& sensor);
    void find_shown(std::vector<RigidTransform<Tool, Tip>> tips);
    void begin_settling(const std::vector<std::uint8_t>& before);
    void follow(const TrackerSample& sample, std::span<const TrackerSample> passed);
    void judge_slips();
    void note_others();
    std::optional<Eigen::Matrix3d> ring_response(const Sensor& sensor) const;
    bool has_response(const Sensor& sensor) const;
    bool renew_patches();
    void renew_responses_for_slips();
    void place_patches();
    void take_constraints();
    void move_patches();
    void pull_patches();
    void settle();
    void state_errors_of_frame();
    /// Throws Error where a blade does not cut what the body is made of.
    void check_ten_node_tets_can_be_cut() const;
    void begin_cutting();
    void follow_blades(
        const TrackerSample& sample,
        const std::optional<RigidTransform<Tracker, Reference>>& tracker_from_reference);
    void follow_hand_cut();
    void cut_by_blades();
    void restart_opening();
    void open_cut();
    void continue_on_mesh(CutBody& made);
    static void add_copies_to(Settling& settling, const CutBody& made);
    std::vector<FixOptions> fix_of_change(const SceneChange& change) const;
    bool is_held(std::span<const std::int32_t> piece) const;
    bool is_carried(std::span<const std::int32_t> piece) const;
    void hold_free_pieces();
    bool is_held_anew() const;
    void take_free_pieces(const std::vector<MeshPiece>& free);

    Scene scene_;
    const int newton_iterations_;  ///< of a frame, whatever of the scene changes
    SceneBody& body_;
    ToolFinder find_tool_;
    MisplacedSensor misplaced_;
    std::size_t reference_;
    PoseFollower reference_follower_;
    LiveRegistration registration_;
    std::optional<SceneConstraints> scene_constraints_;
    Constraints constraints_;
    Springs springs_;
    bool pulled_ = false;        ///< a patch is held by springs
    int hand_ = 0;               ///< number of the last marker
    std::list<Sensor> sensors_;  ///< in the order of the scene, then those being released
    std::vector<ShownTool> shown_;
    std::vector<RigidTransform<Tool, Tip>> tips_;  ///< of the shown tools
    std::vector<std::int32_t> surface_;            ///< nodes on the surface of the mesh
    TurnedElements turned_;                        ///< looked at in each frame
    Driven driven_;
    std::optional<Settling> settling_;
    double tail_s_ = 0;  ///< time a frame needs after its last solve: recent maximum
    std::optional<double> last_time_s_;
    Stating stating_;
    std::unique_ptr<Cutting> cutting_;  ///< none: the scene has no blade
    Frame frame_;
};

/// Those of a frame: of the reference and of the sensors.
PoseQualities pose_qualities(std::span<const TrackedBody::ShownTool> tools,
                             const FrameState& frame);

}  // namespace livetet
