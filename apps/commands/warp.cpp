#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/commands/commands.hpp"
#include "apps/warp/warp_frame.hpp"
#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/parallel_jobs.hpp"
#include "base/progress.hpp"
#include "base/stopwatch.hpp"

namespace livetet {

namespace {

/// The results of a batch: each is read when its first frame begins, and given up when its last one
/// has ended.
class WarpInputs {
  public:
    WarpInputs(const WarpArguments& arguments, const std::vector<WarpJob>& jobs)
        : arguments_(arguments), slots_(arguments.results.size()) {
        for (const WarpJob& job : jobs) ++slots_[job.result].jobs_left;
    }

    /// May be called by several threads.
    std::shared_ptr<const WarpInput> get(std::size_t result) {
        Slot& slot = slots_[result];
        const std::lock_guard lock(slot.mutex);
        if (!slot.input)
            slot.input = std::make_shared<const WarpInput>(arguments_.results[result], arguments_);
        return slot.input;
    }

    void end_job(std::size_t result) {
        Slot& slot = slots_[result];
        const std::lock_guard lock(slot.mutex);
        if (--slot.jobs_left == 0) slot.input.reset();
    }

  private:
    struct Slot {
        std::mutex mutex;
        std::shared_ptr<const WarpInput> input;
        std::size_t jobs_left = 0;
    };
    const WarpArguments& arguments_;
    std::vector<Slot> slots_;
};

void write_json(const WarpArguments& a, const nlohmann::json& json) {
    if (!a.json.empty())
        write_text_file(a.json,
                        json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

void run_one(const WarpArguments& a, const WarpJob& job, int threads) {
    const WarpInput input(a.results[job.result], a);
    fmt::print("frame        {} at {:.3f} s, of {}\n{}", job.frame + 1, input.time_s(job.frame),
               input.frame_count(), input.note());
    ThreadTeam team(threads);
    const WarpedFrame frame = warp_frame(input, job, a, team);
    fmt::print("{}", frame.text);
    write_json(a, frame.figures);
}

/// Frames side by side, one a thread: most of a frame's time is compression and files, which its
/// threads could not share.
void run_batch(const WarpArguments& a, const std::vector<WarpJob>& jobs, int threads) {
    WarpInputs inputs(a, jobs);
    std::vector<nlohmann::json> figures(jobs.size());
    const int workers = static_cast<int>(std::min<std::size_t>(threads, jobs.size()));
    std::mutex printing;
    std::size_t written = 0;
    ProgressLine progress("warp");
    Stopwatch watch;
    const JobsEnd end = run_jobs(jobs.size(), workers, AfterError::stop, [&](std::size_t n) {
        const WarpJob& job = jobs[n];
        ThreadTeam team(std::max(1, threads / workers));
        const auto input = inputs.get(job.result);
        figures[n] = warp_frame(*input, job, a, team).figures;
        inputs.end_job(job.result);
        const std::lock_guard lock(printing);
        ++written;
        progress.update(static_cast<double>(written) / static_cast<double>(jobs.size()),
                        fmt::format("frame {} of {}", job.frame + 1, input->file().string()));
    });
    if (end.first_error) {
        const WarpJob& job = jobs[end.first_failed];
        try {
            std::rethrow_exception(end.first_error);
        } catch (const Error& e) {
            fail("{} (frame {} of {}; {} of {} frames are written)", e.what(), job.frame + 1,
                 a.results[job.result].string(), end.done, jobs.size());
        }
    }
    write_json(a, {{"frames", figures}});
    fmt::print("written      {} of {}, {:.1f} s on {}\n", counted(jobs.size(), "frame"),
               counted(a.results.size(), "result"), watch.lap(), counted(workers, "thread"));
}

void run(const WarpArguments& a) {
    const std::vector<WarpJob> jobs = plan_warp(a);
    const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    const int threads = a.threads > 0 ? a.threads : cores;
    if (jobs.size() == 1)
        run_one(a, jobs.front(), threads);
    else
        run_batch(a, jobs, threads);
}

}  // namespace

void add_warp_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "warp", "Warps the meshed image to a frame of a result; writes displacement fields");
    command->footer(
        "A voxel inside the deformed body takes the value at its tissue's rest position. Voxels "
        "that the body has left are empty; all others are unchanged.");
    auto a = std::make_shared<WarpArguments>();
    command
        ->add_option("results", a->results,
                     "results of livetet track or solve (.h5); of several the names of outputs "
                     "need {result} or {folder}, the result's name and folder")
        ->required();
    command->add_option("-o,--output", a->output,
                        "the deformed image to write (.nii, .nii.gz), or a folder for a DICOM "
                        "series (a '/' at its end), if the image that is warped is DICOM");
    CLI::Option* frame = command->add_option(
        "--frame", a->frame, "frame, counted from 1 as in `livetet view` (default: the last)");
    CLI::Option* time =
        command->add_option("--time", a->time_s, "the frame nearest to this time, s")
            ->excludes(frame);
    command
        ->add_option("--frames", a->frames,
                     "several frames, side by side: numbers and ranges FIRST:LAST:STEP (with LAST; "
                     "each may be left out), separated by commas; the names of outputs need "
                     "{frame}, the frame's number")
        ->excludes(frame)
        ->excludes(time);
    command->add_option("--image", a->image,
                        "image to warp (default: the one from which the result's mesh was made)");
    command->add_option("--grid", a->grid,
                        "image whose voxel grid to use (default: that of the warped image)");
    command
        ->add_option("--interpolation", a->interpolation,
                     "interpolation between voxels: nearest, linear or cubic (default: nearest for "
                     "a label map, linear for a grey image; an image of at most 200 different "
                     "whole values, none negative, is taken for a label map)")
        ->transform(CLI::CheckedTransformer(
            std::map<std::string, Interpolation>{{"nearest", Interpolation::nearest},
                                                 {"linear", Interpolation::linear},
                                                 {"cubic", Interpolation::cubic}}));
    command->add_option(
        "--empty", a->empty,
        "value of voxels that the body has left (default: label 0, or the least grey value)");
    command
        ->add_option(
            "--rind-mm", a->rind_mm,
            "thickness of the layer about the mesh that moves with it, as the organ in the image "
            "extends a little beyond the mesh (default: the longest side of a voxel)")
        ->check(CLI::NonNegativeNumber);
    command->add_option("--inverse-field", a->inverse_field,
                        "write the field for resampling images, from deformed to rest (NIfTI "
                        "vectors, mm, LPS: ANTs, 3D Slicer, ITK)");
    command->add_option("--forward-field", a->forward_field,
                        "write the field for moving points, from rest to deformed (same format)");
    command->add_option("--registration", a->registration,
                        "write the field from deformed to rest as a DICOM Deformable Spatial "
                        "Registration object (.dcm), if the image that is warped is DICOM");
    command
        ->add_option("--threads", a->threads,
                     "0: one a core; of several frames each has one in memory")
        ->capture_default_str()
        ->check(CLI::Range(0, 64));
    command->add_option("--json", a->json, "also write the figures to this file");
    command->callback([a] { run(*a); });
}

}  // namespace livetet
