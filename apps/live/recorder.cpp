#include "apps/live/recorder.hpp"

#include <zlib.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <utility>

#include "apps/live/statement_record.hpp"
#include "base/error.hpp"
#include "base/log.hpp"
#include "geometry/matrix_rows.hpp"

namespace livetet {

namespace {

constexpr std::size_t frames_waiting = 32, arrivals_waiting = 4096;

/// Columns of a received pose: number and time of its sample, arrival time, index of the tool,
/// status, 3 x 4 matrix by rows.
constexpr std::size_t arrival_columns = 17;
constexpr const char* arrival_table = "arrivals";

/// A frame's HandPull: number (0: none), base, to.
constexpr const char* pull_values = "pull";
constexpr const char* slipped_value = "slipped";
constexpr std::size_t slipped_bits = 53;  // that a double holds exactly

/// A whole number from 0 to `max`, read as a double. Throws Error for any other value.
std::uint64_t whole_number(double x, double max, const char* what, const std::string& source) {
    if (!(x >= 0 && x <= max && x == std::floor(x)))
        fail("{}: found {} = {}, expected a whole number up to {:g}", source, what, x, max);
    return static_cast<std::uint64_t>(x);
}

/// The edges of FrameState::hand_cut: the frame's sample, then both ends.
constexpr const char* hand_cut_table = "hand_cuts";
constexpr std::size_t hand_cut_columns = 7;
constexpr double farthest_drawn = 10;  ///< m, of any coordinate; farther, a line has no end

constexpr double max_samples = 9007199254740992;  // 2^53: a double represents all smaller integers

std::optional<HandPull> read_pull(const ResultReader& reader, std::size_t k,
                                  const std::string& source) {
    const std::vector<double> v = reader.values(pull_values, k, 7);
    const auto number = whole_number(v[0], 1e9, "pull", source);
    if (!std::all_of(v.begin(), v.end(), [](double x) { return std::isfinite(x); }))
        fail("{}: the pull of frame {} is not finite", source, k);
    if (number == 0) return {};
    return HandPull{static_cast<int>(number), {v[1], v[2], v[3]}, {v[4], v[5], v[6]}};
}

/// A frame's FrameState::ahead_s: in seconds, so that a replay reads it to the bit.
constexpr const char* ahead_value = "ahead_s";

double read_ahead(const ResultReader& reader, std::size_t k, const std::string& source) {
    constexpr double max_s = 0.5;  // that of a scene, and of the estimator
    const double ahead_s = reader.values(ahead_value, k, 1)[0];
    if (!(ahead_s >= 0 && ahead_s <= max_s))
        fail("{}: frame {} has {} = {}, expected from 0 to {:g}", source, k, ahead_value, ahead_s,
             max_s);
    return ahead_s;
}

}  // namespace

std::uint32_t checksum(std::span<const Vector3> displacement) {
    return static_cast<std::uint32_t>(::crc32_z(
        0, reinterpret_cast<const Bytef*>(displacement.data()), displacement.size_bytes()));
}

ArrivalLog::ArrivalLog() : ring_(arrivals_waiting) {}

void ArrivalLog::keep(const StreamSample& sample) {
    if (!wanted_.load(std::memory_order_acquire)) return;
    StreamSample* slot = ring_.free_slot();
    if (!slot) {
        ++not_kept_;
        return;
    }
    *slot = sample;
    ring_.push();
}

Recorder::Recorder(const RecordedFiles& files, SolverKind solver, ArrivalLog& arrivals,
                   double flush_s)
    : files_(files),
      solver_(solver),
      ring_(frames_waiting),
      arrivals_(arrivals),
      flush_s_(flush_s) {
    if (files_.result) arrivals_.wanted_.store(true, std::memory_order_release);
    thread_ = std::thread([this] { run(); });
}

Recorder::~Recorder() {
    if (thread_.joinable()) (void)close();
}

bool Recorder::keep(const Frame& frame, const StreamSample& sample, double seconds) {
    pass_over(frame);
    KeptFrame* slot = failed() ? nullptr : ring_.free_slot();
    if (!slot) return false;
    slot->frame = frame;
    slot->sample = sample.number;
    slot->arrived_s = sample.arrived_s;
    slot->done_s = steady_seconds();
    slot->seconds = seconds;
    slot->slipped = std::exchange(slipped_, 0);
    slot->last = false;
    ring_.push();
    return true;
}

void Recorder::pass_over(const FrameState& frame) { slipped_ |= slipped_sensors(frame); }

std::optional<std::string> Recorder::close() {
    KeptFrame* slot = nullptr;
    while (!(slot = ring_.free_slot())) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    slot->last = true;
    ring_.push();
    thread_.join();
    return failure_;
}

void Recorder::run() {
    flushed_s_ = steady_seconds();
    for (;;) {
        const KeptFrame* kept = ring_.oldest();
        if (!kept) {
            ring_.wait();
            continue;
        }
        try {
            if (!failure_) write_arrivals();
            if (!failure_ && !kept->last) write(*kept);
            if (!failure_ && kept->last) flush();
            if (!failure_) flush_in_time();
        } catch (const std::exception& error) {
            failure_ = error.what();
            failed_.store(true, std::memory_order_release);
            log_warning(*failure_ + ": nothing is recorded from here on; tracking continues");
        }
        if (kept->last) return;
        ring_.pop();
    }
}

void Recorder::flush() {
    if (files_.result) files_.result->flush();
    if (files_.probes) files_.probes->flush();
}

void Recorder::flush_in_time() {
    if (steady_seconds() - flushed_s_ < flush_s_) return;
    flush();
    flushed_s_ = steady_seconds();
}

void Recorder::write_arrivals() {
    while (const StreamSample* s = arrivals_.ring_.oldest()) {
        for (std::size_t i = 0; i < s->sample.poses.size(); ++i) {
            const TrackedPose& pose = s->sample.poses[i];
            std::vector<double> row{static_cast<double>(s->number), s->sample.time_s, s->arrived_s,
                                    static_cast<double>(i), static_cast<double>(pose.status)};
            const auto matrix = matrix_rows(pose.rotation, pose.translation);
            row.insert(row.end(), matrix.begin(), matrix.end());
            files_.result->append_row(arrival_table, row);
        }
        arrivals_.ring_.pop();
    }
}

void Recorder::write(const KeptFrame& kept) {
    take_mesh(kept.frame);
    if (files_.result) write_frame(kept);
    if (files_.probes) files_.probes->append(kept.frame.time_s, kept.frame.displacement);
}

/// The files take a mesh before the first frame on it.
void Recorder::take_mesh(const FrameState& frame) {
    if (frame.cut == cut_) return;
    if (files_.result) files_.result->set_mesh(frame.cut->mesh, frame.cut->originals);
    if (files_.probes) files_.probes->set_mesh(frame.cut->mesh);
    cut_ = frame.cut;
}

namespace {

void append_hand_cut(ResultWriter& result, std::uint64_t sample, const HandCut& cut) {
    for (const auto& [a, b] : cut.edges)
        result.append_row(hand_cut_table, {{static_cast<double>(sample), a.x(), a.y(), a.z(), b.x(),
                                            b.y(), b.z()}});
}

/// Gives each frame the line that was cut in it.
void read_hand_cuts(const ResultReader& reader, const std::string& source, RecordedRun& run) {
    if (!reader.has_rows(hand_cut_table)) return;
    const std::vector<double> rows = reader.rows(hand_cut_table, hand_cut_columns);
    std::map<std::uint64_t, HandCut> cuts;
    for (const double* v = rows.data(); v < rows.data() + rows.size(); v += hand_cut_columns) {
        for (const double* x = v + 1; x < v + hand_cut_columns; ++x)
            if (!(std::abs(*x) <= farthest_drawn))
                fail("{}: found {:g} m in {}, expected at most {} m", source, *x, hand_cut_table,
                     farthest_drawn);
        cuts[whole_number(v[0], max_samples, "sample", source)].edges.push_back(
            {Vector3(v[1], v[2], v[3]), Vector3(v[4], v[5], v[6])});
    }
    for (RecordedRun::FrameRecord& frame : run.frames)
        if (const auto cut = cuts.find(frame.sample); cut != cuts.end())
            frame.cut = std::make_shared<const HandCut>(cut->second);
}

}  // namespace

void Recorder::write_frame(const KeptFrame& kept) {
    ResultWriter& result = *files_.result;
    const Frame& f = kept.frame;
    if (f.hand_cut) append_hand_cut(result, kept.sample, *f.hand_cut);
    result.append(f.time_s, f.displacement);
    result.append_values("tracker_from_image", matrix_rows(f.tracker_from_image.rotation,
                                                           f.tracker_from_image.translation));
    const auto value = [&](const char* name, double x) { result.append_values(name, {{x}}); };
    value("frame_ms", 1e3 * kept.seconds);
    value("latency_ms", 1e3 * (kept.done_s - kept.arrived_s));
    value(ahead_value, f.ahead_s);
    value("sensor_ms", 1e3 * f.sensor_s);
    value("forces_ms", 1e3 * f.step.forces_s);
    value("operator_ms", 1e3 * f.step.operator_s);
    value("solve_ms", 1e3 * f.step.solve_s);
    value("finish_ms", 1e3 * f.step.finish_s);
    value("output_ms", 1e3 * f.output_s);
    value("iterations", f.step.iterations);
    value("imbalance", f.step.imbalance);
    value("residual", f.step.linear_residual);
    if (solver_ == SolverKind::live) value("error_estimate_mm", 1e3 * f.step.linear_error);
    value("cut_short",
          f.step.cut_short &&
              f.step.converged);  // a frame that did not converge failed, with or without a budget
    value("press_mm", 1e3 * f.press);
    value("registration_status", static_cast<double>(f.registration));
    value("converged", f.step.converged);
    value("turned_elements", static_cast<double>(f.turned_elements));
    // Number of sensors in each state: placing, following, returning, holding, releasing, released.
    // A replay needs them, too.
    std::vector<double> sensors(static_cast<int>(DriveStatus::released) + 1, 0);
    for (const SensorState& s : f.sensors) ++sensors[static_cast<int>(s.drive)];
    result.append_values("sensors", sensors);
    value(slipped_value, static_cast<double>(kept.slipped));
    value("sample", static_cast<double>(kept.sample));
    std::vector<double> solves;
    for (const SolveRecord& s : f.step.solves) {
        solves.push_back(s.iterations);
        solves.push_back(s.half_renewed);
    }
    result.append_values("solves", solves);
    value("checksum", checksum(f.displacement));
    append_statement(result, f.statement);
    if (!f.statement.targets.empty()) value("statement_ms", 1e3 * f.statement_s);
    const HandPull pull = f.pull.value_or(HandPull{});  // number 0: none
    result.append_values(pull_values,
                         {{static_cast<double>(pull.number), pull.base.x(), pull.base.y(),
                           pull.base.z(), pull.to.x(), pull.to.y(), pull.to.z()}});
}

std::uint64_t slipped_sensors(const FrameState& frame) {
    std::uint64_t sum = 0;
    for (const SensorState& s : frame.sensors)
        if (s.trouble == SensorTrouble::slipped && s.tool < slipped_bits)
            sum |= std::uint64_t{1} << s.tool;
    return sum;
}

bool is_slipped(std::uint64_t sum, std::size_t tool) {
    return tool < slipped_bits && (sum >> tool & 1) != 0;
}

std::uint64_t read_slipped(const ResultReader& reader, std::size_t k, const std::string& source) {
    if (!reader.has_values(slipped_value)) return 0;
    return whole_number(reader.values(slipped_value, k, 1)[0],
                        static_cast<double>((std::uint64_t{1} << slipped_bits) - 1), slipped_value,
                        source);
}

RecordedRun read_recorded_run(const ResultReader& reader, const std::string& source) {
    RecordedRun run;
    const std::vector<double> rows = reader.rows(arrival_table, arrival_columns);
    for (const double* row = rows.data(); row < rows.data() + rows.size(); row += arrival_columns) {
        const std::uint64_t number = whole_number(row[0], max_samples, "sample", source);
        if (run.samples.empty() || run.samples.back().number != number) {
            if (!run.samples.empty() && number < run.samples.back().number)
                fail("{}: sample {} comes after sample {}, expected them in order", source, number,
                     run.samples.back().number);
            run.samples.push_back({});
            run.samples.back().number = number;
            run.samples.back().sample.time_s = row[1];
            run.samples.back().arrived_s = row[2];
        }
        std::vector<TrackedPose>& poses = run.samples.back().sample.poses;
        const auto status =
            whole_number(row[4], static_cast<double>(PoseStatus::broken), "status", source);
        if (row[3] != static_cast<double>(poses.size()))
            fail("{}: sample {} holds tool {}, expected tool {}", source, number, row[3],
                 poses.size());
        const auto pose =
            transform_of_rows<Tracker, Tool>(std::span<const double, 12>(row + 5, 12));
        poses.push_back({pose.rotation, pose.translation, static_cast<PoseStatus>(status)});
    }
    const bool has_pulls = reader.has_values(pull_values),
               has_ahead = reader.has_values(ahead_value);
    for (std::size_t k = 0; k < reader.frame_count(); ++k) {
        RecordedRun::FrameRecord& frame = run.frames.emplace_back();
        frame.sample =
            whole_number(reader.values("sample", k, 1)[0], max_samples, "sample", source);
        frame.checksum = static_cast<std::uint32_t>(
            whole_number(reader.values("checksum", k, 1)[0], 0xffffffff, "checksum", source));
        if (has_pulls) frame.pull = read_pull(reader, k, source);
        if (has_ahead) frame.ahead_s = read_ahead(reader, k, source);
        const std::vector<double> solves = reader.values("solves", k, 2 * max_recorded_solves);
        for (int i = 0; i < max_recorded_solves; ++i)
            frame.solves[i] = {
                static_cast<int>(whole_number(solves[2 * i], 1e6, "iterations", source)),
                solves[2 * i + 1] != 0};
    }
    read_hand_cuts(reader, source, run);
    return run;
}

}  // namespace livetet
