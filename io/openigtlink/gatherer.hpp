#pragma once

#include <functional>
#include <map>
#include <optional>
#include <span>

#include "geometry/transform.hpp"
#include "io/openigtlink/message.hpp"
#include "io/openigtlink/source.hpp"

namespace livetet {

/// Throws Error where two tools' names are the same in the bytes that the wire has for a name.
void check_tools_differ(const std::vector<std::string>& tools);

/// Turns tracking messages into samples as `OpenIgtLinkSource` says; no sockets, no clock of its
/// own: `now_s` is the steady clock's.
class PoseGatherer {
  public:
    using Post = std::function<void(const StreamSample&)>;
    /// It begins at `now_s`, when the wall clock shows `utc_s`.
    PoseGatherer(const std::vector<std::string>& tools, const OpenIgtLinkSourceOptions& options,
                 Post post, double now_s, double utc_s);

    /// One tool more, behind the others.
    void add_tool(const std::string& tool);

    /// Takes in a message; others than of tracking data are left alone.
    void take(const igtl::Message& message, double now_s);
    /// When the next sample is to be posted whatever comes: the one under way, or one in which
    /// every tool is missing.
    double due_s() const;
    /// Posts what is due.
    void post_due(double now_s);

    /// Samples for which a tool came.
    std::uint64_t samples() const { return samples_; }
    const std::map<std::string, std::uint64_t>& names() const { return names_; }
    std::vector<std::string> never_came() const;

  private:
    struct State {
        std::string name, transform;  ///< "Stylus", "StylusToTracker"
        std::string list;             ///< the device of the TDATA that it came in, if it did
        TrackedPose pose;
        PoseTimes times;
        std::uint64_t stamp =
            0;  ///< of the newest pose, as sent; 0 where the sender's clock stands
        std::uint64_t clock = 0;   ///< what the sender's clock showed last,
        double clock_since_s = 0;  ///< and when it first showed that
        bool in_sample = false;    ///< came since the last post
        bool left_out = false;     ///< of the last TDATA of its device
        bool stands = false;       ///< its time stamp does, while others go on
    };
    using Pose = std::optional<RigidTransform<Tracker, Tool>>;

    void take_list(const igtl::Message& message,
                   std::span<const std::pair<std::string, Pose>> tools, double now_s);
    State* update(const std::string& name, const Pose& pose, PoseStatus status, std::uint64_t stamp,
                  double now_s);
    void post_if_complete(double now_s);
    void post(double now_s);
    void post_quiet(double now_s);
    void hand_over(double time_s, double now_s);
    double expected_time_s(double now_s) const;
    bool clock_stands(const State& tool, double now_s) const;
    bool others_go_on(const State& tool) const;
    State* find(const std::string& name);
    bool is_up_to_date(const State& tool) const;
    bool is_alive(const State& tool, double now_s) const;
    TrackedPose pose_of(const State& tool, double now_s) const;

    OpenIgtLinkSourceOptions options_;
    Post post_;
    std::vector<State> tools_;
    std::map<std::string, std::uint64_t> names_;
    std::optional<std::uint64_t> stamp_;  ///< of the sample under way
    double due_s_ = 0;
    StreamSample sample_;
    std::uint64_t samples_ = 0;
    double last_tool_s_,
        posted_s_;  ///< when a tool last came (or this began), and when a sample was last posted
    const double utc_from_steady_s_;
    double clock_shift_s_ = 0;  ///< added to the sender's clock since it was set
};

}  // namespace livetet
