#include "apps/phantom/phantom.hpp"
#include "base/error.hpp"

namespace livetet {

namespace {

constexpr const char* mesh_text = R"(mesh:
  file: liver.h5             # of `livetet mesh labels.nii.gz --fix fixed_mask.nii.gz --tets 6000 -o liver.h5`
)";

constexpr const char* material_text =
    R"(image: image.nii.gz          # the grey image, for `livetet view` and `livetet warp`

materials:                   # one for each region of the mesh; a liver is one region
  - young_Pa: 3000           # Young's modulus: soft tissue is 1 to 10 kPa
    poisson: 0.45            # nearly incompressible
    density_kg_per_m3: 1060

strain: neohookean           # keeps its volume as tissue does, at large strain and rotation
)";

constexpr const char* fix_text = R"(
fix:
  - group: fixed             # the nodes under fixed_mask.nii.gz: the lower surface stays where it is
)";

constexpr const char* elements_text =
    "elements: P2                 # ten nodes: a tenth of the tetrahedra that four-node ones need "
    "for the same error\n";

/// What a scene of a recording has of its own.
struct TrackedParts {
    std::string_view first_line, mesh, body;
    std::string_view source, tools = {};  ///< of the section track
    std::string_view result;
};

std::string tracked(const Truth& truth, const TrackedParts& parts) {
    return fmt::format(R"(# {}
# `livetet scene` lists every key, its unit and its default; paths are relative to this file.
{}{}{}
time:
  scheme: newmark            # each step lasts from one tracker sample to the next
  rayleigh_alpha: 10         # damping C = alpha M + beta K: the organ comes to rest, as tissue does
  rayleigh_beta: 0.01

solver:
  kind: live                 # conjugate gradients over the levels, in single precision, on two cores or more
  relative_tolerance: 0.01   # of each frame's linear solve: far below the tracker's noise

track:
  source: {:<19}# PLUS's sequence format; openigtlink://localhost:18944 is a running PLUS server
  registration: registration.json   # what `livetet register` wrote
  reference_tool: Reference  # on the organ: the registration follows it
  sensors:
    - tool: Sensor           # rests on the organ, then is pressed in
      patch_radius_mm: {:<6.4g}# the surface this near to the sensor moves with it
{}  targets:
    - points: targets.csv    # places in the organ: each frame says how far off they may be
  base_window_s: 1           # the sensor's place at rest is the mean over this first time
  budget: 30 ms              # what a frame may take: on a busy machine accuracy gives way, and the report says how often

output:
  file: {:<21}# with .xdmf beside it, for ParaView
)",
                       parts.first_line, parts.mesh, material_text, parts.body, parts.source,
                       1e3 * truth.patch_radius, parts.tools, parts.result);
}

}  // namespace

std::string phantom_track_scene(const Truth& truth) {
    const std::string body = fmt::format("{}{}", elements_text, fix_text);
    return tracked(
        truth,
        {.first_line = "The liver phantom, followed in real time:   livetet track scene.yaml",
         .mesh = mesh_text,
         .body = body,
         .source = "press.igs.mha",
         .result = "result.h5"});
}

std::string phantom_resection_scene(const Truth& truth) {
    const std::string tools = fmt::format(
        R"(  tools:
    - tool: Scalpel          # what its edge sweeps is cut: from the tool's sensor down
      blade_mm: [0, 0, 0, 0, 0, {:.4g}]
  cut_interval_s: 1          # the cut opens within a second, prepared between frames
)",
        -1e3 * scalpel_edge);
    return tracked(
        truth, {.first_line = "An organ that is cut, then pressed beside the cut:   livetet track "
                              "resection.yaml",
                .mesh = R"(mesh:
  file: labels.nii.gz        # meshed when the scene is loaded, within a second
  cells: hexahedra           # a grid of voxels; a blade cuts tetrahedra, too
  tets: 30000                # at most so many cells
)",
                .body = R"(
fix:
  - mask: fixed_mask.nii.gz  # the lower surface stays where it is
)",
                .source = "resection.igs.mha",
                .tools = tools,
                .result = "resection.h5"});
}

std::string phantom_sweep_scene(const Truth& truth) {
    const Eigen::Vector3d place = 1e3 * truth.sensor_rest;
    return fmt::format(
        R"(# The pressed liver phantom, found from a stylus that is led over it, without a sensor on the organ:
#     livetet register --deform sweep.yaml --live --surface-points sweep.igs.mha --tip tip.json --registration registration.json
# `livetet scene` lists every key, its unit and its default; paths are relative to this file.
{}{}{}
deform:
  forces:                    # the surgeon sees about where the organ is pressed
    - sphere_mm: [{:.0f}, {:.0f}, {:.0f}, 25]     # centre (RAS) and radius
  point_error_mm: 1.5        # of a swept point along the normal: tracker and mesh
  targets:
    - points: targets.csv    # places in the organ: each fit says how far off they may be

solver:
  kind: direct               # a factorisation serves all patterns of forces at once

output:
  file: swept.h5             # a frame a fit: the last one is that of all points
)",
        mesh_text, material_text, fix_text, place.x(), place.y(), place.z());
}

std::string phantom_solve_scene(const Truth& truth) {
    const Eigen::Vector3d place = 1e3 * truth.sensor_rest,
                          way = 1e3 * truth.depths.back() * truth.press_direction;
    return fmt::format(
        R"(# The liver phantom pressed once, without a tracker:   livetet solve solve.yaml
# `livetet scene` lists every key, its unit and its default; paths are relative to this file.
{}{}{}{}
drive:
  - sphere_mm: [{:.2f}, {:.2f}, {:.2f}, {:.4g}]   # centre (RAS) and radius: about the sensor's place
    where: surface
    displacement_mm: [{:.3f}, {:.3f}, {:.3f}]     # {:.0f} mm inwards

time:
  scheme: static             # equilibrium: no mass, no velocities
  load_steps: 3              # the press is applied in thirds, so that Newton's method keeps up

solver:
  kind: multigrid
  newton_tolerance: 1.0e-6   # force out of balance, relative to the forces at work

output:
  file: solved.h5            # with solved.xdmf beside it, for ParaView
)",
        mesh_text, material_text, elements_text, fix_text, place.x(), place.y(), place.z(),
        1e3 * truth.patch_radius, way.x(), way.y(), way.z(), 1e3 * truth.depths.back());
}

}  // namespace livetet
