#include "apps/bench/core_watch.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <charconv>

#include "apps/bench/distribution_table.hpp"

namespace livetet {

// First line, in ticks: "cpu user nice system idle iowait irq softirq steal guest guest_nice"
// (proc(5)). Kernels before 2.6.11 end it before steal.
std::optional<double> steal_of(std::string_view stat, double ticks_per_s) {
    constexpr int place = 8;
    std::string_view line = stat.substr(0, stat.find('\n'));
    if (!line.starts_with("cpu ")) return {};
    for (int k = 0; k < place; ++k) {
        const std::size_t blank = line.find(' ');
        if (blank == std::string_view::npos) return {};
        line.remove_prefix(std::min(line.size(), line.find_first_not_of(' ', blank)));
    }
    unsigned long long ticks = 0;
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), ticks);
    if (error != std::errc()) return {};
    return static_cast<double>(ticks) / ticks_per_s;
}

CoreWatch::CoreWatch(const std::filesystem::path& stat)
    : stat_(::open(stat.c_str(), O_RDONLY | O_CLOEXEC)),
      ticks_per_s_(static_cast<double>(::sysconf(_SC_CLK_TCK))) {}

CoreWatch::~CoreWatch() {
    if (stat_ >= 0) ::close(stat_);
}

std::optional<double> CoreWatch::steal() const {
    if (stat_ < 0) return {};
    std::array<char, 256> text;  // the first line alone
    const ssize_t length = ::pread(stat_, text.data(), text.size(), 0);
    if (length <= 0) return {};
    return steal_of({text.data(), static_cast<std::size_t>(length)}, ticks_per_s_);
}

CoreWatch::Totals CoreWatch::totals() {
    rusage process{}, thread{};
    ::getrusage(RUSAGE_SELF, &process);
    ::getrusage(RUSAGE_THREAD, &thread);
    timespec cpu{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &cpu);
    return {static_cast<double>(cpu.tv_sec) + 1e-9 * static_cast<double>(cpu.tv_nsec),
            thread.ru_nvcsw, thread.ru_nivcsw, process.ru_nivcsw};
}

void CoreWatch::start() {
    steal_at_begin_ = steal();
    begin_ = totals();
}

CoreUse CoreWatch::stop() const {
    const Totals end = totals();
    CoreUse use{end.cpu_s - begin_.cpu_s,
                end.blocked - begin_.blocked,
                end.switched - begin_.switched,
                end.process_switched - begin_.process_switched - end.switched + begin_.switched,
                {}};
    if (const auto now = steal(); now && steal_at_begin_) use.steal = *now - *steal_at_begin_;
    return use;
}

FrameTimes frame_times(std::span<const FrameSample> frames) {
    FrameTimes times;
    std::vector<double> all, with_cores;
    for (const FrameSample& f : frames) {
        all.push_back(f.seconds);
        if (f.cores.had_cores()) with_cores.push_back(f.seconds);
        times.cpu_s += f.cores.cpu_s / static_cast<double>(frames.size());
        times.blocked += f.cores.blocked;
        times.switched += f.cores.switched;
        times.others_switched += f.cores.others_switched;
        if (f.cores.steal) times.steal_s = times.steal_s.value_or(0) + *f.cores.steal;
    }
    times.all = distribution(std::move(all));
    times.with_cores = distribution(std::move(with_cores));
    return times;
}

std::string p99_with_cores_text(const FrameTimes& t) {
    return t.with_cores.count > 0 ? fmt::format("{:.2f}", 1e3 * t.with_cores.p99) : "none";
}

std::string core_use_text(const FrameTimes& t) {
    return fmt::format(
        "cpu {:.2f} ms a frame; involuntary switches {} (other threads {}); steal {}; {} of {} "
        "frames had their cores",
        1e3 * t.cpu_s, t.switched, t.others_switched,
        t.steal_s ? fmt::format("{:.2f} s", *t.steal_s) : "not told", t.with_cores.count,
        t.all.count);
}

nlohmann::json json_of(const FrameTimes& t) {
    return {{"all_s", json_of(t.all)},
            {"with_cores_s", t.with_cores.count > 0 ? json_of(t.with_cores) : nlohmann::json()},
            {"cpu_s_mean", t.cpu_s},
            {"voluntary_switches", t.blocked},
            {"involuntary_switches", t.switched},
            {"involuntary_switches_of_other_threads", t.others_switched},
            {"steal_s", t.steal_s ? nlohmann::json(*t.steal_s) : nlohmann::json()}};
}

}  // namespace livetet
