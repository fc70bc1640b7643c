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

/// Turns tracking messages into samples as `OpenIgtLinkSource` says; no sockets, no clock of its own: `now_s` is the
/// steady clock's.
class PoseGatherer {
  public:
    using Post = std::function<void(const StreamSample&)>;
    PoseGatherer(const std::vector<std::string>& tools, const OpenIgtLinkSourceOptions& options, Post post);

    /// One tool more, behind the others.
    void add_tool(const std::string& tool);

    /// Takes in a message; others than of tracking data are left alone.
    void take(const igtl::Message& message, double now_s);
    /// When a sample under way must be posted, whatever is missing; nothing where none is.
    std::optional<double> due_s() const;
    void post_due(double now_s);
    /// Posts a sample in which every tool is missing.
    void post_silence(double now_s);

    const std::map<std::string, std::uint64_t>& names() const { return names_; }
    std::vector<std::string> never_came() const;

  private:
    struct State {
        std::string name, transform;  ///< "Stylus", "StylusToTracker"
        std::string list;             ///< the device of the TDATA that it came in, if it did
        TrackedPose pose;
        PoseTimes times;
        std::uint64_t stamp = 0;  ///< of the newest pose, as sent
        bool in_sample = false;   ///< came since the last post
        bool left_out = false;    ///< of the last TDATA of its device
    };
    using Pose = std::optional<RigidTransform<Tracker, Tool>>;

    void take_list(const igtl::Message& message, std::span<const std::pair<std::string, Pose>> tools, double now_s);
    State* update(const std::string& name, const Pose& pose, PoseStatus status, std::uint64_t stamp, double now_s);
    void post_if_complete(double now_s);
    void post(double now_s);
    void hand_over(double time_s, double now_s);
    State* find(const std::string& name);
    bool is_up_to_date(const State& tool) const;
    bool is_alive(const State& tool, double now_s) const;

    OpenIgtLinkSourceOptions options_;
    Post post_;
    std::vector<State> tools_;
    std::map<std::string, std::uint64_t> names_;
    std::optional<std::uint64_t> stamp_;  ///< of the sample under way
    double due_s_ = 0;
    StreamSample sample_;
    double clock_shift_s_ = 0;  ///< added to the sender's clock since it was set back
};

}  // namespace livetet
