#include <fmt/format.h>

#include <map>
#include <optional>

#include "apps/commands/commands.hpp"
#include "apps/scene/outputs.hpp"
#include "base/error.hpp"
#include "image/image_markers.hpp"
#include "io/fiducial_file.hpp"
#include "io/image_file.hpp"
#ifdef LIVETET_IMAGES
#include "apps/plots/pictures.hpp"
#endif

namespace livetet {

namespace {

struct FiducialsArguments {
    std::filesystem::path image, output, picture;
    double diameter_mm = 0;
    std::size_t count = 0;
    MarkerShade shade = MarkerShade::bright;
};

int find(const FiducialsArguments& a) {
    expect_ending("--output", a.output, ".mrk.json");
    expect_ending("--picture", a.picture, ".png");
    if (!a.picture.empty()) {
#ifdef LIVETET_IMAGES
        need_display(fmt::format("--picture {}", a.picture.string()));
#else
        fail("--picture {}: pictures are not in this build", a.picture.string());
#endif
    }
    const GreyImage image = read_grey_image(a.image);
    std::vector<ImageMarker> found = with_context(a.image.string(), [&] {
        return find_markers(image, {.diameter = a.diameter_mm / 1e3, .shade = a.shade});
    });
    if (found.size() < a.count)
        fail("{}: found {} {} balls of {:g} mm, expected {}: is it their diameter and shade?",
             a.image.string(), found.size(), a.shade == MarkerShade::bright ? "bright" : "dark",
             a.diameter_mm, a.count);
    const std::optional<ImageMarker> next =
        found.size() > a.count ? std::optional(found[a.count]) : std::nullopt;
    found.resize(a.count);
    std::vector<NamedPoint> points;
    fmt::print("{:<7} {:>9} {:>9} {:>9}   {:>8} {:>6} {:>6}\n", "marker", "x/mm", "y/mm", "z/mm",
               "contrast", "fit", "+-/mm");
    for (const ImageMarker& m : found) {
        points.push_back({fmt::format("M{}", points.size() + 1), m.centre});
        fmt::print("{:<7} {:9.3f} {:9.3f} {:9.3f}   {:8.1f} {:6.3f} {:6.3f}\n", points.back().name,
                   1e3 * m.centre.x(), 1e3 * m.centre.y(), 1e3 * m.centre.z(), m.contrast, m.fit,
                   1e3 * m.uncertainty);
    }
    if (next) {
        const Eigen::Vector3d mm = 1e3 * next->centre;
        const double share = next->score() / found.back().score();
        fmt::print("{}the next best, at ({:.1f}, {:.1f}, {:.1f}) mm, reaches {:.0f} % of M{}\n",
                   share > 0.5 ? "warning: " : "", mm.x(), mm.y(), mm.z(), 100 * share, a.count);
    }
#ifdef LIVETET_IMAGES
    if (!a.picture.empty()) {
        write_marker_picture(a.picture, image, found, a.diameter_mm / 1e3);
        fmt::print("picture  {}: confirm that each circle holds its marker\n", a.picture.string());
    }
#endif
    if (a.output.empty()) return 0;
    write_fiducials(a.output, points);
    fmt::print("written  {}: ranked, so register with --any-order\n", a.output.string());
    return 0;
}

}  // namespace

void add_fiducials_command(CLI::App& app, ExitStatus& status) {
    CLI::App* command = app.add_subcommand("fiducials",
                                           "Finds fiducial markers in an image, spheres of a known "
                                           "diameter, to a fraction of a voxel");
    auto a = std::make_shared<FiducialsArguments>();
    command
        ->add_option(
            "image", a->image,
            "grey image (.nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd; DICOM: a file or a folder)")
        ->required();
    command
        ->add_option("--diameter-mm", a->diameter_mm,
                     "diameter of the visible sphere: of a marker's filling, not its casing")
        ->required()
        ->check(CLI::PositiveNumber);
    command->add_option("--count", a->count, "number of markers; the best candidates are taken")
        ->required()
        ->check(CLI::Range(1, 100));
    command
        ->add_option("--shade", a->shade,
                     "whether they are brighter or darker than their surroundings")
        ->transform(CLI::CheckedTransformer(std::map<std::string, MarkerShade>{
            {"bright", MarkerShade::bright}, {"dark", MarkerShade::dark}}))
        ->default_str("bright");
    command->add_option("-o,--output", a->output,
                        "write them to this file (.mrk.json) for `livetet register --any-order`");
    command->add_option("--picture", a->picture,
                        "draw the slices through each marker (.png), for a visual check");
    command->callback([a, &status] { status.value = find(*a); });
}

}  // namespace livetet
