#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "apps/commands/commands.hpp"
#include "apps/warp/warp_results.hpp"
#include "base/counted.hpp"
#include "base/file.hpp"
#include "base/progress.hpp"
#include "base/stopwatch.hpp"

namespace livetet {

namespace {

void run(const WarpArguments& a) {
    Stopwatch watch;
    const std::vector<WarpedFrame> frames = warp_results(a, ProgressLine("warp").callback());
    nlohmann::json figures;
    if (frames.size() == 1) {
        fmt::print("{}", frames.front().text);
        figures = frames.front().figures;
    } else {
        for (const WarpedFrame& frame : frames) figures["frames"].push_back(frame.figures);
        fmt::print("written      {} of {}, {:.1f} s on {}\n", counted(frames.size(), "frame"),
                   counted(a.results.size(), "result"), watch.lap(),
                   counted(warp_threads(a, frames.size()), "thread"));
    }
    if (!a.json.empty())
        write_text_file(
            a.json, figures.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
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
        ->transform(CLI::CheckedTransformer(interpolations));
    command->add_option(
        "--empty", a->empty,
        "value of voxels that the body has left (default: label 0, or the least grey value)");
    command
        ->add_option(
            "--rind-mm", a->rind_mm,
            "thickness of the layer about the mesh that moves with it, as the organ in the image "
            "extends a little beyond the mesh (default: the longest side of a voxel)")
        ->check(CLI::Range(0.0, max_rind_mm));
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
