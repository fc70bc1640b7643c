#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>

#include "geometry/transform.hpp"
#include "io/openigtlink/message.hpp"
#include "io/openigtlink/source.hpp"

namespace livetet {

/// Throws Error if two tools have one name. Names that agree in the 20 bytes that the wire has for
/// a name are told apart by the whole name in the metadata of version 2.
void check_tools_differ(const std::vector<std::string>& tools);

/// Assembles tracking messages into samples by the rules of `OpenIgtLinkSource`. Has no sockets and
/// no clock; every `now_s` is the steady clock's time.
class PoseGatherer {
  public:
    using Post = std::function<void(const StreamSample&)>;
    /// Starts at `now_s`, when the UTC time is `utc_s`.
    PoseGatherer(const std::vector<std::string>& tools, const OpenIgtLinkSourceOptions& options,
                 Post post, double now_s, double utc_s);

    /// Appends a tool.
    void add_tool(const std::string& tool);

    /// Processes a message; ignores messages without tracking data.
    void take(const igtl::Message& message, double now_s);
    /// The time at which the next sample must be posted at the latest: the current one, or one in
    /// which every tool is missing.
    double due_s() const;
    /// Posts the sample that is due at `now_s`, if any.
    void post_due(double now_s);

    /// Number of samples that a tool's message completed.
    std::uint64_t samples() const { return samples_; }
    const std::map<std::string, std::uint64_t>& names() const { return names_; }
    /// Number of poses dropped because several tools have the name, cut to 20 bytes, and why the
    /// last one was.
    std::uint64_t ambiguous() const { return ambiguous_; }
    const std::string& ambiguity() const { return ambiguity_; }
    std::vector<std::string> never_came() const;

  private:
    struct State {
        std::string name, transform;  ///< "Stylus", "StylusToTracker"
        std::string list;  ///< device of the TDATA message that last reported it; empty if none did
        TrackedPose pose;
        PoseTimes times;
        std::uint64_t stamp = 0;  ///< time stamp of the newest pose, as sent; 0 for none
        bool in_sample = false;   ///< reported since the last post
        bool left_out = false;    ///< missing from its device's last TDATA
    };
    using Pose = std::optional<RigidTransform<Tracker, Tool>>;

    void take_list(const igtl::Message& message,
                   std::span<const std::pair<std::string, Pose>> tools, double now_s);
    State* update(const std::string& name, const Pose& pose, PoseStatus status, std::uint64_t stamp,
                  double now_s);
    bool is_mixed(const State& tool, const std::string& name, const Pose& pose,
                  std::uint64_t stamp) const;
    void refuse(const std::string& name, const std::string& claims);
    void post_if_complete(double now_s);
    void post(double now_s);
    void post_quiet(double now_s);
    void hand_over(double time_s, double now_s);
    double expected_time_s(double now_s) const;
    State* find(const std::string& name);
    std::vector<std::string> claims_on(const std::string& name) const;
    bool is_up_to_date(const State& tool) const;
    bool is_alive(const State& tool, double now_s) const;
    TrackedPose pose_of(const State& tool, double now_s) const;

    OpenIgtLinkSourceOptions options_;
    Post post_;
    std::vector<State> tools_;
    std::map<std::string, std::uint64_t> names_;
    std::set<std::string> mixed_;  ///< names under which several tools were seen to be sent
    std::uint64_t ambiguous_ = 0;
    std::string ambiguity_;
    std::optional<std::uint64_t> stamp_;  ///< time stamp of the current sample
    double due_s_ = 0;
    StreamSample sample_;
    std::uint64_t samples_ = 0;
    double last_tool_s_;  ///< arrival of the last tool, or the start
    double posted_s_;     ///< time of the last posted sample
    const double utc_from_steady_s_;
    double clock_shift_s_ = 0;  ///< correction of the sender's time stamps after its clock was set
};

}  // namespace livetet
