#include "apps/live/tracker_source.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>

#include "base/error.hpp"
#include "base/file.hpp"
#include "io/openigtlink/source.hpp"
#include "io/sequence_file.hpp"
#include "io/text.hpp"
#include "tracking/playback.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

constexpr std::string_view scheme = "openigtlink://";
constexpr std::uint16_t usual_port = 18944;

std::pair<std::string, std::uint16_t> host_and_port(const std::string& name) {
    std::string_view rest = std::string_view(name).substr(scheme.size());
    while (rest.ends_with('/')) rest.remove_suffix(1);
    const std::size_t bracket = rest.starts_with('[') ? rest.find(']') : 0;  // [::1]:18944
    const std::size_t colon = bracket == std::string_view::npos ? bracket : rest.find(':', bracket);
    std::string_view host = rest.substr(0, colon);
    if (bracket > 0 && host.size() > 2) host = host.substr(1, host.size() - 2);
    std::uint16_t port = usual_port;
    bool good = !host.empty() && bracket != std::string_view::npos;
    if (good && colon != std::string_view::npos) {
        const std::string_view digits = rest.substr(colon + 1);
        const auto [end, error] =
            std::from_chars(digits.data(), digits.data() + digits.size(), port);
        good = error == std::errc{} && end == digits.data() + digits.size() && port > 0;
    }
    if (!good)
        fail("{}: expected openigtlink://host:port, such as openigtlink://localhost:18944", name);
    return {std::string(host), port};
}

}  // namespace

bool is_stream(const std::string& name) {
    if (name.starts_with(scheme)) return true;
    if (name.find("://") != std::string::npos)
        fail("{}: expected openigtlink://host:port, a recording, or a script (.yaml)", name);
    return false;
}

DelayedRecording read_stored(const std::string& name) {
    if (const std::string end = ending(name); end == ".yaml" || end == ".yml")
        return simulate(parse_motion_script(read_text_file(name), name));
    return {read_sequence(name), {}};
}

double sample_interval(const Recording& recording) {
    std::vector<double> gaps;
    for (std::size_t i = 1; i < recording.samples.size(); ++i)
        gaps.push_back(recording.samples[i].time_s - recording.samples[i - 1].time_s);
    if (gaps.empty()) return 0;
    std::nth_element(gaps.begin(), gaps.begin() + gaps.size() / 2, gaps.end());
    return gaps[gaps.size() / 2];
}

std::string names_text(const SourceStatus& status) {
    std::vector<std::string> names;
    for (const auto& [name, count] : status.names) names.push_back(name);
    return fmt::format("{}", fmt::join(names, ", "));
}

double Rate::operator()(std::uint64_t count) {
    const double now_s = steady_seconds();
    if (now_s - marked_s_ >= 1) {
        rate_Hz_ = static_cast<double>(count - marked_) / (now_s - marked_s_);
        marked_ = count;
        marked_s_ = now_s;
    }
    return rate_Hz_;
}

OpenSource open_source(const std::string& name, const std::vector<std::string>& tools,
                       const SourceOptions& options) {
    if (is_stream(name)) {
        const auto [host, port] = host_and_port(name);
        OpenIgtLinkSourceOptions stream;
        stream.listener = options.listener;
        stream.request_ms = options.request_ms;
        return {std::make_unique<OpenIgtLinkSource>(host, port, tools, stream)};
    }
    auto [recording, delays_s] = read_stored(name);
    for (const std::string& tool : tools)
        with_context(name + options.names_tools, [&] { return tool_index(recording, tool); });
    OpenSource open;
    open.samples = recording.samples.size();
    open.interval_s = sample_interval(recording);
    open.source = std::make_unique<Playback>(
        std::move(recording),
        PlaybackOptions{options.speed, std::move(delays_s), options.listener});
    return open;
}

}  // namespace livetet
