#include "apps/live/replay.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/live/recorder.hpp"
#include "apps/live/run_result.hpp"
#include "apps/live/statement_record.hpp"
#include "apps/live/tracked_model.hpp"
#include "base/error.hpp"
#include "base/progress.hpp"
#include "config/yaml.hpp"
#include "geometry/error_ellipsoid.hpp"
#include "geometry/matrix_rows.hpp"
#include "io/registration_file.hpp"
#include "io/result_file.hpp"

namespace livetet {

namespace {

using nlohmann::json;

constexpr int max_threads = 1024;

/// The checked data of a run that a replay starts from.
struct Origin {
    Scene scene;
    int threads = 0;
    std::vector<std::string> tools;
    RigidTransform<ImageFrame, Reference> image_from_reference;
    std::optional<ExpectedRegistrationError> registration_error;
    std::vector<SceneEvent> events;
};

/// 36 numbers of the covariance by rows, m and rad.
ExpectedRegistrationError read_registration_error(const json& about, const std::string& source) {
    const auto numbers = about.at("covariance").get<std::vector<double>>();
    if (numbers.size() != 36)
        fail("{}: the registration's covariance has {} numbers, expected 36", source,
             numbers.size());
    const ExpectedRegistrationError error{
        Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(numbers.data()),
        about.at("holds_tip").get<bool>()};
    check_covariance(error.covariance, source);
    return error;
}

Origin read_origin(const ResultReader& reader, const std::string& source) {
    Origin origin;
    origin.scene = read_yaml<Scene>(reader.scene_text(), source);
    if (!origin.scene.track)
        fail("{}: its scene has no track section, expected the result of livetet track", source);
    try {
        const json about = json::parse(reader.text("replay"));
        about.at("threads").get_to(origin.threads);
        if (origin.threads < 1 || origin.threads > max_threads)
            fail("{}: was computed by {} threads, expected 1 to {}", source, origin.threads,
                 max_threads);
        about.at("tools").get_to(origin.tools);
        const auto pose = about.at("image_from_reference").get<std::vector<double>>();
        if (pose.size() != 12)
            fail("{}: image_from_reference has {} numbers, expected 12", source, pose.size());
        origin.image_from_reference =
            transform_of_rows<ImageFrame, Reference>(std::span(pose).first<12>());
        if (about.contains("registration_error"))
            origin.registration_error =
                read_registration_error(about["registration_error"], source);
        for (const json& event : about.at("events"))
            origin.events.push_back(
                {event.at("frame").get<std::size_t>(), event.at("scene").get<std::string>()});
    } catch (const json::exception& e) {
        fail("{}: invalid replay data, expected those of livetet track: {}", source, e.what());
    }
    return origin;
}

/// The kept sample of this number, or where it would be.
auto sample_at(const RecordedRun& run, std::uint64_t number) {
    return std::ranges::lower_bound(run.samples, number, {}, &StreamSample::number);
}

/// The samples between those of a frame and the frame before: TrackerSource::passed. Throws Error
/// if one was not kept.
std::vector<TrackerSample> passed_before(const RecordedRun& run, std::size_t frame,
                                         const std::string& source) {
    if (frame == 0) return {};
    const std::uint64_t to = run.frames[frame].sample;
    std::uint64_t from = run.frames[frame - 1].sample + 1;
    if (to > max_passed) from = std::max<std::uint64_t>(from, to - max_passed);
    std::vector<TrackerSample> passed;
    for (auto sample = sample_at(run, from); sample != sample_at(run, to); ++sample)
        passed.push_back(sample->sample);
    if (from < to && passed.size() != to - from)
        fail("{}: of {} samples that blades cut in before frame {}, {} were kept", source,
             to - from, frame, passed.size());
    return passed;
}

}  // namespace

std::string petsc_options_of_run(const std::filesystem::path& path) {
    const ResultReader reader(path);
    return read_yaml<Scene>(reader.scene_text(), path.string()).solver.petsc_options;
}

ReplayReport replay_run(const std::filesystem::path& path, const ProgressCallback& progress,
                        int threads) {
    const std::string source = path.string();
    const ResultReader reader(path);
    Origin origin = read_origin(reader, source);
    const RecordedRun run = read_recorded_run(reader, source);
    if (const std::size_t lacking = parse_run_info(reader.text("run"), source).not_kept;
        lacking > 0)
        fail(
            "{}: lacks {} frames, for which the disk was too slow or too full, expected all of "
            "them for a replay",
            source, lacking);
    if (origin.scene.output.every != 1)
        fail("{}: keeps every {}th frame, expected output.every = 1 for a replay", source,
             origin.scene.output.every);
    origin.scene.solver.threads = threads > 0 ? threads : origin.threads;

    TrackedModel model = make_tracked_model(origin.scene, load_mesh(origin.scene, progress));
    const TetMesh mesh = model.body.mesh();  // before blades cut it
    if (const TetMesh then = reader.first_mesh();
        mesh.nodes != then.nodes || mesh.tets != then.tets)
        fail("{}: {} is not the mesh of this run any more", source,
             origin.scene.mesh.file.string());
    TrackedBody tracked =
        track_model(origin.scene, model, tool_finder(origin.tools), origin.image_from_reference,
                    origin.registration_error, MisplacedSensor::wait);
    const std::vector<std::string> names = StatementReader(reader, source).names();
    if (tracked.target_names() != names)
        fail("{}: the targets of its scene are not those of this run any more: {} now, {} then",
             source, fmt::join(tracked.target_names(), ", "), fmt::join(names, ", "));

    ReplayReport report;
    auto event = origin.events.begin();
    const bool may_be_cut = has_blades(*origin.scene.track);
    for (std::size_t k = 0; k < run.frames.size(); ++k) {
        const RecordedRun::FrameRecord& recorded = run.frames[k];
        for (; event != origin.events.end() && event->frame <= k; ++event)
            tracked.change(prepare_change(read_yaml<Scene>(event->scene, source), mesh));
        const auto sample = sample_at(run, recorded.sample);
        if (sample == run.samples.end() || sample->number != recorded.sample)
            fail("{}: frame {} was made of sample {}, which was not kept", source, k,
                 recorded.sample);
        tracked.pull(recorded.pull);
        tracked.cut_by_hand(recorded.cut);
        const Frame& frame = tracked.advance(
            sample->sample, {.as_done = &recorded.solves, .ahead_s = recorded.ahead_s},
            may_be_cut ? passed_before(run, k, source) : std::vector<TrackerSample>{});
        ++report.frames;
        if (checksum(frame.displacement) == recorded.checksum &&
            holds_statement(reader, k, frame.statement)) {
            ++report.same;
        } else {
            if (report.same + 1 == report.frames) report.first_other = k;
            const std::vector<Vector3> kept = reader.displacement(k);
            // Where the cuts differ, too, the nodes that both have tell.
            for (std::size_t n = 0; n < std::min(kept.size(), frame.displacement.size()); ++n)
                report.largest_gap =
                    std::max(report.largest_gap, (frame.displacement[n] - kept[n]).norm());
        }
        tracked.work_on_responses();
        if (progress)
            progress(static_cast<double>(k + 1) / static_cast<double>(run.frames.size()),
                     fmt::format("frame {}", k));
    }
    return report;
}

}  // namespace livetet
