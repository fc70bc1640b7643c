#include "io/openigtlink/gatherer.hpp"

#include <fmt/ranges.h>

#include <algorithm>

#include "io/openigtlink/codec.hpp"
#include "io/openigtlink/conversions.hpp"
#include "io/openigtlink/plus_pose.hpp"

namespace livetet {

namespace {

constexpr std::size_t max_names = 256;
constexpr double clock_was_set_s = 1;

/// While no tool is reported, empty samples are posted at intervals of this fraction of the
/// silence, so that a gradual release of the patches proceeds in small steps.
constexpr double quiet_share = 0.05, shortest_quiet_step_s = 0.05, longest_quiet_step_s = 0.5;

std::string cut(const std::string& name) { return name.substr(0, igtl::device_name_size); }

/// The pose status in the metadata, ok if there is none. `prefix` names the tool in messages with
/// several tools.
PoseStatus status_of(const igtl::Message& message, const std::string& prefix) {
    if (const auto* word = find_metadata(message, prefix + "TransformStatus"))
        return parse_pose_status(*word);
    if (const auto* valid = find_metadata(message, prefix + "TransformValid"))
        return *valid == "true" || *valid == "1" ? PoseStatus::ok : PoseStatus::invalid;
    return PoseStatus::ok;
}

}  // namespace

void check_tools_differ(const std::vector<std::string>& tools) {
    std::map<std::string, std::string> taken;
    for (const std::string& name : tools)
        for (const std::string& sent : {name, name + std::string(to_tracker)})
            if (const auto [other, is_new] = taken.emplace(sent, name); !is_new)
                fail("tools {} and {}: both are sent as {}, expected two names", other->second,
                     name, sent);
}

PoseGatherer::PoseGatherer(const std::vector<std::string>& tools,
                           const OpenIgtLinkSourceOptions& options, Post post, double now_s,
                           double utc_s)
    : options_(options),
      post_(std::move(post)),
      last_tool_s_(now_s),
      posted_s_(now_s),
      utc_from_steady_s_(utc_s - now_s) {
    check_tools_differ(tools);
    for (const std::string& tool : tools) add_tool(tool);
}

void PoseGatherer::add_tool(const std::string& tool) {
    State& added = tools_.emplace_back();
    added.name = tool;
    added.transform = tool + std::string(to_tracker);
    sample_.sample.poses.resize(tools_.size());
    sample_.times.resize(tools_.size());
}

void PoseGatherer::take(const igtl::Message& m, double now_s) {
    const auto one = [&](const Pose& pose) {
        update(whole_name(m), pose, status_of(m, ""), m.time_stamp, now_s);
        post_if_complete(now_s);
    };
    std::vector<std::pair<std::string, Pose>> list;
    if (const auto* transform = std::get_if<igtl::Transform>(&m.content)) {
        one(igtl::tracker_from_tool(transform->matrix));
    } else if (const auto* position = std::get_if<igtl::Position>(&m.content)) {
        const bool has_rotation = position->layout != igtl::Position::Layout::without_rotation;
        one(has_rotation ? igtl::tracker_from_tool(position->position, position->quaternion)
                         : std::nullopt);
    } else if (const auto* data = std::get_if<igtl::TrackingData>(&m.content)) {
        for (const auto& tool : data->tools)
            list.emplace_back(tool.name, igtl::tracker_from_tool(tool.matrix));
        take_list(m, list, now_s);
    } else if (const auto* quaternions = std::get_if<igtl::QuaternionTrackingData>(&m.content)) {
        for (const auto& tool : quaternions->tools)
            list.emplace_back(tool.name, igtl::tracker_from_tool(tool.position, tool.quaternion));
        take_list(m, list, now_s);
    }
}

void PoseGatherer::take_list(const igtl::Message& m,
                             std::span<const std::pair<std::string, Pose>> list, double now_s) {
    const std::string& device = whole_name(m);
    for (State& tool : tools_)
        if (tool.list == device) tool.left_out = true;
    std::map<std::string, int> sent;
    for (const auto& [name, pose] : list) ++sent[name];
    for (const auto& [name, pose] : list) {
        if (sent[name] > 1 && name.size() == igtl::device_name_size) mixed_.insert(name);
        const State* tool = find(name);
        const bool by_tool = tool && find_metadata(m, tool->name + "TransformStatus");
        State* updated =
            update(name, pose, status_of(m, by_tool ? tool->name : name), m.time_stamp, now_s);
        if (updated) updated->list = device;
    }
    // That all tools are gone is worth a sample.
    if (!stamp_ && std::ranges::any_of(tools_, &State::left_out)) {
        stamp_ = m.time_stamp;
        due_s_ = now_s;
    }
    post_if_complete(now_s);
}

PoseGatherer::State* PoseGatherer::update(const std::string& name, const Pose& pose,
                                          PoseStatus status, std::uint64_t stamp, double now_s) {
    if (names_.size() < max_names || names_.contains(name)) ++names_[name];
    State* tool = find(name);
    if (!tool) {
        const std::vector<std::string> claims = claims_on(name);
        if (claims.size() > 1) refuse(name, fmt::format("{}", fmt::join(claims, ", ")));
        return nullptr;
    }
    if (is_mixed(*tool, name, pose, stamp)) mixed_.insert(name);
    if (mixed_.contains(name)) {
        refuse(name, "several tools that are sent under it");
        return nullptr;
    }
    tool->left_out = false;
    if (stamp != 0 && stamp == tool->stamp) return tool;  // an old pose, sent again
    if (stamp_ && (*stamp_ != stamp || tool->in_sample)) post(now_s);
    if (!stamp_) {
        stamp_ = stamp;
        due_s_ = now_s + options_.gather_s;
    }
    tool->pose = {};
    tool->pose.status = status != PoseStatus::ok ? status : PoseStatus::broken;
    if (status == PoseStatus::ok && pose) tool->pose = {pose->rotation, pose->translation, status};
    tool->times = {igtl::seconds_of_stamp(stamp), now_s};
    tool->stamp = stamp;
    tool->in_sample = true;
    return tool;
}

double PoseGatherer::due_s() const {
    if (stamp_) return due_s_;
    const double quiet_s = posted_s_ - last_tool_s_;
    if (quiet_s == 0) return last_tool_s_ + options_.stale_after_s;
    return posted_s_ +
           std::clamp(quiet_share * quiet_s, shortest_quiet_step_s, longest_quiet_step_s);
}

void PoseGatherer::post_due(double now_s) {
    if (now_s < due_s()) return;
    if (stamp_)
        post(now_s);
    else
        post_quiet(now_s);
}

void PoseGatherer::post_if_complete(double now_s) {
    if (stamp_ && std::ranges::all_of(tools_, [&](const State& t) {
            return is_up_to_date(t) || !is_alive(t, now_s);
        }))
        post(now_s);
}

/// The time of a sample, extrapolated from the previous one by arrival times.
double PoseGatherer::expected_time_s(double now_s) const {
    const bool first = sample_.arrived_s == 0;
    return first ? now_s + utc_from_steady_s_ : sample_.sample.time_s + (now_s - sample_.arrived_s);
}

void PoseGatherer::post(double now_s) {
    const bool first = sample_.arrived_s == 0;
    const double last_s = sample_.sample.time_s, expected_s = expected_time_s(now_s);
    double time_s = expected_s;
    if (*stamp_ != 0) {
        time_s = igtl::seconds_of_stamp(*stamp_) + clock_shift_s_;
        if (!first &&
            (time_s < last_s - clock_was_set_s || time_s > expected_s + clock_was_set_s)) {
            clock_shift_s_ += expected_s - time_s;
            time_s = expected_s;
        }
    }
    last_tool_s_ = now_s;
    ++samples_;
    hand_over(first ? time_s : std::max(time_s, last_s), now_s);
}

void PoseGatherer::post_quiet(double now_s) { hand_over(expected_time_s(now_s), now_s); }

void PoseGatherer::hand_over(double time_s, double now_s) {
    sample_.sample.time_s = time_s;
    sample_.arrived_s = posted_s_ = now_s;
    for (std::size_t i = 0; i < tools_.size(); ++i) {
        State& tool = tools_[i];
        sample_.sample.poses[i] = pose_of(tool, now_s);
        sample_.times[i] = tool.times;
        tool.in_sample = false;
    }
    stamp_.reset();
    post_(sample_);
}

/// The tools that a name of 20 bytes may stand for: those followed, and others known by the whole
/// name. Empty if it is none of those followed.
std::vector<std::string> PoseGatherer::claims_on(const std::string& name) const {
    std::vector<std::string> claims;
    if (name.size() != igtl::device_name_size) return claims;
    for (const State& tool : tools_)
        if (name == cut(tool.name) || name == cut(tool.transform)) claims.push_back(tool.name);
    if (claims.empty()) return claims;
    for (const auto& [whole, count] : names_)
        if (whole.size() > name.size() && cut(whole) == name &&
            std::ranges::none_of(tools_, [&](const State& tool) {
                return whole == tool.name || whole == tool.transform;
            }))
            claims.push_back(whole);
    return claims;
}

/// The tool of a name on the wire; nullptr if there is none, or if it may be one of several.
PoseGatherer::State* PoseGatherer::find(const std::string& name) {
    const auto found = std::ranges::find_if(
        tools_, [&](const State& tool) { return name == tool.name || name == tool.transform; });
    if (found != tools_.end()) return &*found;
    if (name.size() != igtl::device_name_size) return nullptr;
    const auto by_beginning = std::ranges::find_if(tools_, [&](const State& tool) {
        return name == cut(tool.name) || name == cut(tool.transform);
    });
    if (by_beginning == tools_.end()) return nullptr;
    return claims_on(name).size() > 1 ? nullptr : &*by_beginning;
}

/// Whether a cut name brings another pose of the same moment: two tools are sent under it.
bool PoseGatherer::is_mixed(const State& tool, const std::string& name, const Pose& pose,
                            std::uint64_t stamp) const {
    const bool is_cut = name != tool.name && name != tool.transform;
    return is_cut && stamp != 0 && stamp == tool.stamp && pose &&
           tool.pose.status == PoseStatus::ok &&
           (pose->translation != tool.pose.translation || pose->rotation != tool.pose.rotation);
}

void PoseGatherer::refuse(const std::string& name, const std::string& claims) {
    ++ambiguous_;
    if (ambiguous_ > 1 && ambiguity_.starts_with(name)) return;
    ambiguity_ = fmt::format(
        "{} stands for {}: the sender cuts names to 20 bytes, expected whole names in metadata "
        "(version 2) or names that differ earlier",
        name, claims);
}

/// Whether the tool was reported for the current sample, or earlier with the same time stamp.
bool PoseGatherer::is_up_to_date(const State& tool) const {
    return tool.in_sample || (*stamp_ != 0 && tool.stamp == *stamp_);
}

bool PoseGatherer::is_alive(const State& tool, double now_s) const {
    return tool.times.arrived_s > 0 && !tool.left_out &&
           now_s - tool.times.arrived_s < options_.stale_after_s;
}

TrackedPose PoseGatherer::pose_of(const State& tool, double now_s) const {
    if (is_alive(tool, now_s)) return tool.pose;
    TrackedPose none;
    if (tool.times.arrived_s > 0 && !tool.left_out) none.status = PoseStatus::stale;
    return none;
}

std::vector<std::string> PoseGatherer::never_came() const {
    std::vector<std::string> names;
    for (const State& tool : tools_)
        if (tool.times.arrived_s == 0) names.push_back(tool.name);
    return names;
}

}  // namespace livetet
