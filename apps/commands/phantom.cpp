#include <fmt/format.h>

#include "apps/commands/commands.hpp"
#include "apps/phantom/phantom.hpp"
#include "base/error.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace livetet {

namespace {

constexpr const char* contents = R"(What it makes in DIR:
  image.nii.gz               grey values as of an MR scanner, with shading and noise
  labels.nii.gz              1 in the organ
  fixed_mask.nii.gz          1 over its lower surface, which the scenes hold
  image_fiducials.mrk.json   five fiducials on the container, balls of 10 mm in the image (the
                             format of 3D Slicer)
  pivot.igs.mha              tracker recording: the tool Stylus pivoting (PLUS's format)
  fiducials.igs.mha          Stylus touching the five fiducials in order; Reference
  press.igs.mha              Reference, and Sensor pressed in 15 mm three times while all moves
                             and turns
  sweep.igs.mha              Reference, and Stylus led over the organ while a thin plate presses it
  targets.csv                eight places in the organ, whose error `livetet track` states
  scene.yaml, solve.yaml     ready for `livetet track` and `livetet solve`
  resection.igs.mha          Reference, Scalpel that cuts the organ, and Sensor pressed in twice
  resection.yaml             ready for `livetet track`, on a grid of voxels that Scalpel cuts
  sweep.yaml                 ready for `livetet register --deform`
  truth/truth.json           what a report measures errors against; nothing else reads it)";

constexpr const char* next_commands = R"(
next, in {0}:
  livetet mesh labels.nii.gz --fix fixed_mask.nii.gz --tets 6000 -o liver.h5
  livetet calibrate pivot pivot.igs.mha --tool Stylus -o tip.json
  livetet register --tracker fiducials.igs.mha --tip tip.json --reference Reference \
      --image image_fiducials.mrk.json -o registration.json
  livetet track scene.yaml
  livetet report result.h5 --truth truth/truth.json
  livetet register --deform sweep.yaml --live --surface-points sweep.igs.mha --tip tip.json \
      --registration registration.json
  livetet track resection.yaml
)";

struct PhantomArguments {
    std::filesystem::path output;
    PhantomOptions options;
};

void run(const PhantomArguments& arguments) {
    check_options(arguments.options);
    PetscSession session("livetet", {});
    if (session.ranks() > 1)
        fail("phantom runs on one rank, found {}: start it without mpirun", session.ranks());
    std::vector<std::filesystem::path> names;
    {
        ProgressLine progress("phantom");
        names = write_phantom(arguments.output, arguments.options, progress.callback());
    }
    for (const auto& name : names)
        fmt::print("written      {}\n", (arguments.output / name).string());
    fmt::print(next_commands, arguments.output.string());
}

}  // namespace

void add_phantom_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "phantom",
        "Makes a synthetic liver phantom: image, labels, fiducials, tracker recordings, truth");
    command->footer(contents);
    auto a = std::make_shared<PhantomArguments>();
    PhantomOptions& o = a->options;
    command
        ->add_option("-o,--output", a->output,
                     "output folder; created if missing, other files in it are kept")
        ->required()
        ->type_name("DIR");
    command
        ->add_option("--seed", o.seed,
                     "seed of all noise: the same seed gives the same images and recordings")
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
    command->add_option("--spacing-mm", o.spacing_mm, "edge length of the image's voxels")
        ->capture_default_str();
    command
        ->add_option("--position-noise-mm", o.position_noise_mm, "RMS error of a tracked position")
        ->capture_default_str();
    command
        ->add_option("--rotation-noise-deg", o.rotation_noise_deg,
                     "RMS error of a tracked rotation")
        ->capture_default_str();
    command->add_option("--rate-Hz", o.rate_Hz, "tracker samples a second")->capture_default_str();
    command
        ->add_option("--truth-tets", o.truth_tets,
                     "approximate number of ten-node tetrahedra of the true organ, which is "
                     "neo-Hookean")
        ->capture_default_str();
    command->callback([a] { run(*a); });
}

}  // namespace livetet
