#include "apps/warp/warp_frame.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "apps/scene/cuts.hpp"
#include "apps/scene/outputs.hpp"
#include "apps/scene/scene_image.hpp"
#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/stopwatch.hpp"
#include "config/yaml.hpp"
#include "image/image_warp.hpp"
#include "image/label_map.hpp"
#include "io/dicom_name.hpp"
#include "io/image_file.hpp"
#include "mesh/mesh_pieces.hpp"
#include "meshing/surface_check.hpp"
#ifdef LIVETET_IMAGES
#include "io/dicom_derived.hpp"
#include "io/dicom_registration.hpp"
#endif

namespace livetet {

namespace {

namespace fs = std::filesystem;
using AnyImage = std::variant<GreyImage, LabelImage>;

/// HDF5 is not built for use by several threads.
std::mutex& hdf5_mutex() {
    static std::mutex mutex;
    return mutex;
}

/// Opens a result, and closes it, while no other thread uses HDF5.
std::shared_ptr<const ResultReader> open_result(const fs::path& file) {
    const std::lock_guard lock(hdf5_mutex());
    return {new ResultReader(file), [](const ResultReader* reader) {
                const std::lock_guard closing(hdf5_mutex());
                delete reader;
            }};
}

std::string size_text(const std::array<int, 3>& size) {
    return fmt::format("{} x {} x {}", size[0], size[1], size[2]);
}

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

WarpSource read_source(const ResultReader& result, const fs::path& result_file,
                       const WarpArguments& a) {
    WarpSource source;
    std::optional<SceneImage> found;
    if (a.image.empty()) {
        const std::lock_guard lock(hdf5_mutex());  // the scene may name a hierarchy
        try {
            found = find_scene_image(read_yaml<Scene>(result.scene_text(), result_file.string()),
                                     result_file);
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
            "{}: is not on the voxels of the image that was meshed: found {}, expected {} at the "
            "same place; --image names another image to warp",
            source.file.string(), size_text(volume.size), size_text(found->grid->size));
    source.values =
        values_of(volume, source.file, found ? found->label_map : std::nullopt, a.interpolation);
    const bool plain = volume.slope == 1 && volume.intercept == 0;
    source.stored = plain ? volume.type : ScalarType::float32;
    const bool labels = std::holds_alternative<LabelImage>(source.values);
    source.how = a.interpolation.value_or(labels ? Interpolation::nearest : Interpolation::linear);
    return source;
}

/// On the scene's cuts, unless the scene is unknown, and on those of blades in the run; empty if
/// there are none.
std::string text_on_cuts(const ResultReader& result, const fs::path& file) {
    const TetMesh first = result.first_mesh();
    std::string text;
    try {
        text = cuts_text(read_yaml<Scene>(result.scene_text(), file.string()), first);
    } catch (const Error&) {
        text.clear();
    }
    const std::size_t doubled = result.mesh().nodes.size() - first.nodes.size();
    if (doubled == 0) return text;
    return fmt::format("{}{}blades doubled {}; in the end the body is in {}", text,
                       text.empty() ? "" : "; ", counted(doubled, "node"),
                       counted(mesh_pieces(result.mesh()).size(), "piece"));
}

/// Throws Error if the grid contains none of these nodes; returns a note of how many lie outside. A
/// smoothed surface bulges a little over the faces of the image's outermost voxels: those nodes do
/// not count. `what`: names the nodes.
std::string check_place(const ImageGrid& grid, std::span<const Vector3> nodes, const char* what,
                        const fs::path& file) {
    const Eigen::Affine3d voxel_from_ras(Eigen::Matrix4d(grid.ras_from_voxel.inverse()));
    const Eigen::Vector3d size(grid.size[0], grid.size[1], grid.size[2]);
    constexpr double face = 0.5, bulge = 0.25;  // voxels from the centres
    std::size_t outside = 0;
    for (const Vector3& x : nodes) {
        const Vector3 v = voxel_from_ras * x;
        outside += (v.array() < -face - bulge).any() ||
                   (v.array() > size.array() - 1 + face + bulge).any();
    }
    if (outside == nodes.size()) {
        const Eigen::AlignedBox3d box = box_of(grid);
        fail("{}: is an image of another place: it spans {}, {} spans {} (RAS)", file.string(),
             box_mm(std::array{Vector3(box.min()), Vector3(box.max())}), what, box_mm(nodes));
    }
    if (outside == 0) return {};
    return fmt::format("note         {} of {} nodes of {} lie outside of {}\n", outside,
                       nodes.size(), what, file.string());
}

/// Throws Error unless the source is DICOM where an output is derived from DICOM.
void check_dicom([[maybe_unused]] const WarpArguments& a, [[maybe_unused]] const WarpSource& source,
                 [[maybe_unused]] const ImageGrid& grid) {
    const bool series = is_series_folder(a.output);
    if (!series && a.registration.empty()) return;
    const std::string option =
        series ? "--output " + a.output.string() : "--registration " + a.registration.string();
#ifdef LIVETET_IMAGES
    if (!dicom_name(source.file))
        fail(
            "{}: is derived from the image that is warped, found {}, which is no DICOM, expected "
            "--image to name a DICOM series{}",
            option, source.file.string(), series ? ", or an output of .nii.gz" : "");
    if (!a.registration.empty()) check_right_angles(grid, a.registration.string());
#else
    fail("{}: this build of livetet writes no DICOM, expected .nii.gz", option);
#endif
}

double voxel_ml(const ImageGrid& grid) {
    return 1e6 * std::abs(grid.ras_from_voxel.topLeftCorner<3, 3>().determinant());
}

std::string counts_text(const WarpCounts& c, double ml) {
    std::string text;
    const auto line = [&](const char* name, std::size_t count, const char* what) {
        if (count > 0)
            text += fmt::format("{:<13}{} voxels, {:.2f} ml: {}\n", name, count,
                                static_cast<double>(count) * ml, what);
    };
    line("carried", c.carried, "moved with the body");
    line("left empty", c.left_empty, "the body was there at rest and has moved away");
    line("inverted", c.inverted, "of the carried: by inverted tets alone");
    line("beyond", c.beyond_image, "their value lies outside the image: empty");
    return text;
}

/// The value of unknown voxels: the least grey value, or label 0.
double default_empty(const AnyImage& values) {
    const auto* grey = std::get_if<GreyImage>(&values);
    return grey ? *std::min_element(grey->values.begin(), grey->values.end()) : 0;
}

constexpr std::int32_t max_label = std::numeric_limits<std::int32_t>::max();

constexpr const char* interpolation_names[] = {"nearest neighbour", "linear", "cubic"};

#ifdef LIVETET_IMAGES
/// Over how many slices the body moves at most, plus those that interpolation needs.
int slice_reach(const WarpSource& source, const BodyMotion& motion) {
    const Eigen::Vector3d slices_from_metres =
        source.grid().ras_from_voxel.inverse().row(2).head<3>().transpose();
    double max_slices = 0;
    for (const Vector3& u : differences(motion.rest, motion.deformed))
        max_slices = std::max(max_slices, std::abs(slices_from_metres.dot(u)));
    return static_cast<int>(std::ceil(std::min(max_slices, 1e6))) +
           (source.how == Interpolation::cubic ? 2 : 1);
}

DicomDerivation derivation_of(const WarpInput& input, std::size_t frame, double empty,
                              const BodyMotion& motion) {
    const WarpSource& source = *input.source();
    const std::string place = fmt::format("frame {} at {:.3f} s", frame + 1, input.time_s(frame));
    return {fmt::format("Deformed by livetet {}: {} of a simulation of soft tissue. Voxels inside "
                        "of the deformed organ are resampled ({}), those that it has left have the "
                        "value {:g}, all others are unchanged.",
                        LIVETET_VERSION, place, interpolation_names[static_cast<int>(source.how)],
                        empty),
            "livetet warp, " + place, LIVETET_VERSION, slice_reach(source, motion)};
}
#endif

/// Warps one frame and writes its files.
class FrameWriter {
  public:
    FrameWriter(const WarpInput& input, const WarpJob& job, const WarpArguments& a,
                ThreadTeam& team, const BodyMotion& motion, WarpedFrame& out)
        : input_(input), job_(job), a_(a), team_(team), motion_(motion), out_(out) {
        if (input.source()) empty_ = a.empty.value_or(default_empty(input.source()->values));
    }

    /// Warps the image and writes it.
    void write_image() {
        const WarpSource& source = *input_.source();
        const bool labels = std::holds_alternative<LabelImage>(source.values);
        if (labels && (empty_ != std::floor(empty_) || std::abs(empty_) > max_label))
            fail("--empty {}: expected a label, a whole number up to {}, for {} is a label map",
                 empty_, max_label, source.file.string());
        WarpCounts counts;
        Stopwatch watch;
        const AnyImage image = std::visit(
            [&]<class T>(const Image<T>& values) -> AnyImage {
                return warp_image(values, input_.grid(), motion_, source.how,
                                  static_cast<T>(empty_), team_, counts);
            },
            source.values);
        const double warp_s = watch.lap();
        write(image);
        const double write_s = watch.lap(), ml = voxel_ml(input_.grid());
        const char* interpolation = interpolation_names[static_cast<int>(source.how)];
        out_.text += fmt::format("image        {}: {}, {}; empty is {:g}\n", source.file.string(),
                                 labels ? "a label map" : "grey", interpolation, empty_) +
                     counts_text(counts, ml) + clamped_text() +
                     fmt::format("seconds      read {:.2f}, warp {:.3f}, write {:.2f}\n",
                                 input_.read_s(), warp_s, write_s) +
                     fmt::format("written      {}\n", job_.files.image.string());
        out_.figures.update({{"image", source.file.string()},
                             {"label_map", labels},
                             {"interpolation", interpolation},
                             {"empty", empty_},
                             {"voxel_ml", ml},
                             {"carried", counts.carried},
                             {"left_empty", counts.left_empty},
                             {"inverted", counts.inverted},
                             {"beyond_image", counts.beyond_image},
                             {"warp_s", warp_s},
                             {"write_s", write_s}});
    }

    void write_fields() {
        for (const auto& [path, direction] :
             {std::pair{job_.files.inverse_field, FieldDirection::inverse},
              {job_.files.forward_field, FieldDirection::forward}}) {
            if (path.empty()) continue;
            write_displacement_field(path,
                                     displacement_field(input_.grid(), motion_, direction, team_));
            out_.text += fmt::format("written      {}\n", path.string());
        }
    }

    void write_registration() {
#ifdef LIVETET_IMAGES
        DicomDerivation derivation = derivation_of(input_, job_.frame, empty_, motion_);
        write_dicom_registration(
            job_.files.registration, *dicom_name(input_.source()->file),
            displacement_field(input_.grid(), motion_, FieldDirection::inverse, team_), derivation,
            series_);
        out_.text += fmt::format("written      {}\n", job_.files.registration.string());
#endif
    }

  private:
    void write(const AnyImage& image) {
        const fs::path& file = job_.files.image;
#ifdef LIVETET_IMAGES
        if (is_series_folder(a_.output)) {
            const DicomName source = *dicom_name(input_.source()->file);
            const DicomDerivation derivation = derivation_of(input_, job_.frame, empty_, motion_);
            series_ = std::visit(
                [&](const auto& values) {
                    return write_dicom_series(file, source, values, derivation);
                },
                image);
            out_.figures["clamped"] = series_.clamped;
            return;
        }
#endif
        if (const auto* grey = std::get_if<GreyImage>(&image))
            livetet::write_image(file, *grey, input_.source()->stored);
        else
            livetet::write_image(file, std::get<LabelImage>(image));
    }

    std::string clamped_text() const {
#ifdef LIVETET_IMAGES
        if (series_.clamped > 0)
            return fmt::format(
                "clamped      {} voxels, whose values the source's pixels cannot hold\n",
                series_.clamped);
#endif
        return {};
    }

    const WarpInput& input_;
    const WarpJob& job_;
    const WarpArguments& a_;
    ThreadTeam& team_;
    const BodyMotion& motion_;
    WarpedFrame& out_;
    double empty_ = 0;
#ifdef LIVETET_IMAGES
    DerivedSeries series_;
#endif
};

}  // namespace

WarpInput::WarpInput(const fs::path& result, const WarpArguments& a) : file_(result) {
    Stopwatch watch;
    result_ = open_result(result);
    if (!a.output.empty() || a.grid.empty() || !a.registration.empty()) {
        source_ = read_source(*result_, result, a);
        for (const fs::path& written :
             {a.output, a.inverse_field, a.forward_field, a.registration, a.json})
            refuse_to_overwrite("warp", written, {source_->file});
    }
    if (a.grid.empty()) {
        grid_ = source_->grid();
    } else {
        const Volume like = read_volume(a.grid);
        grid_ = {like.size, like.ras_from_voxel};
    }
    if (source_) {
        check_dicom(a, *source_, grid_);
        note_ = check_place(source_->grid(), mesh().nodes, "the mesh at rest", source_->file);
    }
    cuts_ = text_on_cuts(*result_, result);
    rind_ =
        a.rind_mm ? 1e-3 * *a.rind_mm : (source_ ? source_->grid() : grid_).spacing().maxCoeff();
    read_s_ = watch.lap();
}

std::vector<Vector3> WarpInput::displacement(std::size_t frame) const {
    const std::lock_guard lock(hdf5_mutex());
    return result_->displacement(frame);
}

WarpedFrame warp_frame(const WarpInput& input, const WarpJob& job, const WarpArguments& a,
                       ThreadTeam& team) {
    WarpedFrame out;
    out.text = fmt::format("frame        {} at {:.3f} s, of {}\n{}", job.frame + 1,
                           input.time_s(job.frame), input.frame_count(), input.note());
    const BodyMotion motion =
        body_motion(input.mesh(), input.displacement(job.frame), input.rind());
    if (!a.grid.empty())
        out.text += check_place(input.grid(), motion.deformed, "the deformed mesh", a.grid);
    out.figures = {{"result", input.file().string()},   {"frame", job.frame + 1},
                   {"time_s", input.time_s(job.frame)}, {"size", input.grid().size},
                   {"rind_mm", 1e3 * input.rind()},     {"read_s", input.read_s()}};
    if (!input.cuts().empty()) {
        out.text += fmt::format("cuts         {}\n", input.cuts());
        out.figures["cuts"] = input.cuts();
    }
    FrameWriter writer(input, job, a, team, motion, out);
    if (!job.files.image.empty()) writer.write_image();
    writer.write_fields();
    if (!job.files.registration.empty()) writer.write_registration();
    return out;
}

}  // namespace livetet
