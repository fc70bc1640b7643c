#include <fmt/format.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>
#include <variant>

#include "apps/commands/commands.hpp"
#include "apps/scene/outputs.hpp"
#include "apps/scene/scene_image.hpp"
#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/stopwatch.hpp"
#include "config/yaml.hpp"
#include "image/image_warp.hpp"
#include "image/label_map.hpp"
#include "io/image_file.hpp"
#include "io/result_file.hpp"
#include "io/text.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

struct WarpArguments {
    fs::path result, output, image, grid, inverse_field, forward_field, json;
    std::optional<std::int64_t> frame;  ///< counted from 1
    std::optional<double> time_s, empty, rind_mm;
    std::optional<Interpolation> interpolation;
    int threads = 0;
};

std::string size_text(const std::array<int, 3>& size) {
    return fmt::format("{} x {} x {}", size[0], size[1], size[2]);
}

/// Checks the outputs before anything is read.
void check_outputs(const WarpArguments& a) {
    if (a.output.empty() && a.inverse_field.empty() && a.forward_field.empty())
        fail("warp: nothing to write, expected -o, --inverse-field or --forward-field");
    const std::pair<const char*, const fs::path*> written[] = {
        {"--output", &a.output},
        {"--inverse-field", &a.inverse_field},
        {"--forward-field", &a.forward_field},
        {"--json", &a.json}};
    for (const auto& [option, path] : written) {
        if (path->empty()) continue;
        if (const std::string end = ending(*path);
            path != &a.json && end != ".nii" && end != ".nii.gz")
            fail("{} {}: the name ends in '{}', expected .nii or .nii.gz", option, path->string(),
                 end);
        refuse_to_overwrite(option, *path, {a.result, a.image, a.grid});
        for (const auto& [other, other_path] : written)
            if (path != other_path && same_file(*path, *other_path))
                fail("{} and {}: both name {}, expected two files", option, other, path->string());
        (void)PendingFile(*path);  // throws if it cannot be written
        remove_left_parts(*path);
    }
}

/// The requested frame, or the last.
std::size_t chosen_frame(const ResultReader& result, const WarpArguments& a) {
    const std::vector<double>& times = result.times_s();
    if (times.empty()) fail("{}: holds no frame, expected at least one", a.result.string());
    if (a.frame) {
        if (*a.frame < 1 || *a.frame > static_cast<std::int64_t>(times.size()))
            fail("{}: holds {}, found --frame {}, expected 1 to {}", a.result.string(),
                 counted(times.size(), "frame"), *a.frame, times.size());
        return static_cast<std::size_t>(*a.frame - 1);
    }
    if (!a.time_s) return times.size() - 1;
    if (!(*a.time_s >= times.front() && *a.time_s <= times.back()))
        fail("{}: its frames are from {} to {} s, found --time {}", a.result.string(),
             times.front(), times.back(), *a.time_s);
    const auto after = std::lower_bound(times.begin(), times.end(), *a.time_s) - times.begin();
    return after > 0 && *a.time_s - times[after - 1] <= times[after] - *a.time_s ? after - 1
                                                                                 : after;
}

using AnyImage = std::variant<GreyImage, LabelImage>;

/// An image to warp: labels or grey values, and its type in the file.
struct Source {
    fs::path file;
    AnyImage values;
    ScalarType stored = ScalarType::float32;
    Interpolation how = Interpolation::linear;

    ImageGrid grid() const {
        return std::visit([](const auto& image) { return grid_of(image); }, values);
    }
};

/// `known_labels`: whether it was meshed as a label map; if unknown, guessed from the values.
AnyImage values_of(const Volume& volume, const fs::path& file, std::optional<bool> known_labels,
                   std::optional<Interpolation> requested) {
    if (known_labels == false || (requested && *requested != Interpolation::nearest))
        return grey_image(volume, file);
    try {
        LabelImage labels = label_image(volume, file);
        if (known_labels || why_no_label_map(labels).empty()) return labels;
    } catch (const NotALabel&) {
        // grey values
    }
    return grey_image(volume, file);
}

Source read_source(const ResultReader& result, const WarpArguments& a) {
    Source source;
    std::optional<SceneImage> found;
    if (a.image.empty()) {
        try {
            found = find_scene_image(read_yaml<Scene>(result.scene_text(), a.result.string()),
                                     a.result);
        } catch (const Error& e) {
            fail("{}; expected --image to name the image to warp", e.what());
        }
    }
    source.file = found ? found->file : a.image;
    const Volume volume = read_volume(source.file);
    if (found && found->grid &&
        !(found->grid->size == volume.size &&
          found->grid->ras_from_voxel.isApprox(volume.ras_from_voxel, 1e-6)))
        fail(
            "{}: has {} voxels in another place or of another number than the image that was "
            "meshed, of {}; expected --image to "
            "name the image to warp",
            source.file.string(), size_text(volume.size), size_text(found->grid->size));
    source.values =
        values_of(volume, source.file, found ? found->label_map : std::nullopt, a.interpolation);
    const bool plain = volume.slope == 1 && volume.intercept == 0;
    source.stored = plain ? volume.type : ScalarType::float32;
    const bool labels = std::holds_alternative<LabelImage>(source.values);
    source.how = a.interpolation.value_or(labels ? Interpolation::nearest : Interpolation::linear);
    return source;
}

/// Throws Error if the grid contains none of these nodes; prints how many it lacks. `what`: names
/// them.
void check_place(const ImageGrid& grid, std::span<const Vector3> nodes, const char* what,
                 const fs::path& file) {
    const Eigen::Affine3d voxel_from_ras(Eigen::Matrix4d(grid.ras_from_voxel.inverse()));
    const Eigen::Vector3d size(grid.size[0], grid.size[1], grid.size[2]);
    std::size_t outside = 0;
    for (const Vector3& x : nodes) {
        const Vector3 v = voxel_from_ras * x;
        outside += (v.array() < -0.5).any() || (v.array() > size.array() - 0.5).any();
    }
    if (outside == nodes.size()) {
        const Eigen::AlignedBox3d box = box_of(grid);
        fail("{}: is an image of another place: it spans {}, {} spans {} (RAS)", file.string(),
             box_mm(std::array{Vector3(box.min()), Vector3(box.max())}), what, box_mm(nodes));
    }
    if (outside > 0)
        fmt::print("note         {} of {} nodes of {} lie outside of {}\n", outside, nodes.size(),
                   what, file.string());
}

double voxel_ml(const ImageGrid& grid) {
    return 1e6 * std::abs(grid.ras_from_voxel.topLeftCorner<3, 3>().determinant());
}

void print_counts(const WarpCounts& c, double ml) {
    const auto line = [&](const char* name, std::size_t count, const char* what) {
        if (count > 0)
            fmt::print("{:<13}{} voxels, {:.2f} ml: {}\n", name, count,
                       static_cast<double>(count) * ml, what);
    };
    line("carried", c.carried, "moved with the body");
    line("left empty", c.left_empty, "the body was there at rest and has moved away");
    line("inverted", c.inverted, "of the carried: by inverted tets alone");
    line("beyond", c.beyond_image, "their value lies outside the image: empty");
}

/// The value of unknown voxels: the least grey value, or label 0.
double default_empty(const AnyImage& values) {
    const auto* grey = std::get_if<GreyImage>(&values);
    return grey ? *std::min_element(grey->values.begin(), grey->values.end()) : 0;
}

constexpr const char* interpolation_names[] = {"nearest neighbour", "linear", "cubic"};

/// Warps the image and writes it; adds the figures to `json`.
void warp_source(const WarpArguments& a, const Source& source, const ImageGrid& grid,
                 const BodyMotion& motion, ThreadTeam& team, nlohmann::json& json) {
    const double empty = a.empty.value_or(default_empty(source.values));
    const bool labels = std::holds_alternative<LabelImage>(source.values);
    if (labels && empty != std::floor(empty))
        fail("--empty {}: found a fraction, expected a label, for {} is a label map", empty,
             source.file.string());
    WarpCounts counts;
    Stopwatch watch;
    const AnyImage out = std::visit(
        [&]<class T>(const Image<T>& image) -> AnyImage {
            return warp_image(image, grid, motion, source.how, static_cast<T>(empty), team, counts);
        },
        source.values);
    json["warp_s"] = watch.lap();
    if (const auto* grey = std::get_if<GreyImage>(&out))
        write_image(a.output, *grey, source.stored);
    else
        write_image(a.output, std::get<LabelImage>(out));
    json["write_s"] = watch.lap();
    const char* interpolation = interpolation_names[static_cast<int>(source.how)];
    fmt::print("image        {}: {}, {}; empty is {:g}\n", source.file.string(),
               labels ? "a label map" : "grey", interpolation, empty);
    print_counts(counts, voxel_ml(grid));
    fmt::print("seconds      read {:.2f}, warp {:.3f}, write {:.2f}\nwritten      {}\n",
               json["read_s"].get<double>(), json["warp_s"].get<double>(),
               json["write_s"].get<double>(), a.output.string());
    json.update({{"image", source.file.string()},
                 {"label_map", labels},
                 {"interpolation", interpolation},
                 {"empty", empty},
                 {"voxel_ml", voxel_ml(grid)},
                 {"carried", counts.carried},
                 {"left_empty", counts.left_empty},
                 {"inverted", counts.inverted},
                 {"beyond_image", counts.beyond_image}});
}

void run(const WarpArguments& a) {
    // 1. inputs
    check_outputs(a);
    Stopwatch watch;
    const ResultReader result(a.result);
    const std::size_t frame = chosen_frame(result, a);
    fmt::print("frame        {} at {:.3f} s, of {}\n", frame + 1, result.times_s()[frame],
               result.frame_count());
    std::optional<Source> source;
    if (!a.output.empty() || a.grid.empty()) {
        source = read_source(result, a);
        for (const fs::path& written : {a.output, a.inverse_field, a.forward_field, a.json})
            refuse_to_overwrite("warp", written, {source->file});
    }
    ImageGrid grid;
    if (a.grid.empty()) {
        grid = source->grid();
    } else {
        const Volume like = read_volume(a.grid);
        grid = {like.size, like.ras_from_voxel};
    }

    // 2. motion
    const double rind =
        a.rind_mm ? 1e-3 * *a.rind_mm : (source ? source->grid() : grid).spacing().maxCoeff();
    const BodyMotion motion = body_motion(result.mesh(), result.displacement(frame), rind);
    if (source) check_place(source->grid(), result.mesh().nodes, "the mesh at rest", source->file);
    if (!a.grid.empty()) check_place(grid, motion.deformed, "the deformed mesh", a.grid);
    const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    ThreadTeam team(a.threads > 0 ? a.threads : cores);
    nlohmann::json json{{"result", a.result.string()},
                        {"frame", frame + 1},
                        {"time_s", result.times_s()[frame]},
                        {"size", grid.size},
                        {"rind_mm", 1e3 * rind}};
    json["read_s"] = watch.lap();

    // 3. image and fields, each written whole or not at all
    if (!a.output.empty()) warp_source(a, *source, grid, motion, team, json);
    for (const auto& [path, direction] : {std::pair{a.inverse_field, FieldDirection::inverse},
                                          {a.forward_field, FieldDirection::forward}}) {
        if (path.empty()) continue;
        write_displacement_field(path, displacement_field(grid, motion, direction, team));
        fmt::print("written      {}\n", path.string());
    }
    if (!a.json.empty())
        write_text_file(a.json,
                        json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

}  // namespace

void add_warp_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "warp", "Warps the meshed image to a frame of a result; writes displacement fields");
    command->footer(
        "A voxel inside the deformed body takes the value at its tissue's rest position. Voxels "
        "that the body has left are empty; all others are unchanged.");
    auto a = std::make_shared<WarpArguments>();
    command->add_option("result", a->result, "result of livetet track or solve (.h5)")->required();
    command->add_option("-o,--output", a->output, "the deformed image to write (.nii, .nii.gz)");
    CLI::Option* frame = command->add_option(
        "--frame", a->frame, "frame, counted from 1 as in `livetet view` (default: the last)");
    command->add_option("--time", a->time_s, "the frame nearest to this time, s")->excludes(frame);
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
    command->add_option("--threads", a->threads, "0: one a core")
        ->capture_default_str()
        ->check(CLI::Range(0, 64));
    command->add_option("--json", a->json, "also write the figures to this file");
    command->callback([a] { run(*a); });
}

}  // namespace livetet
