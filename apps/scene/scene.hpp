#pragma once

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/fields.hpp"
#include "io/surface_file.hpp"
#include "io/text.hpp"
#include "mechanics/material.hpp"
#include "mechanics/time_scheme.hpp"
#include "mesh/node_selection.hpp"
#include "meshing/options.hpp"
#include "solvers/linear/solver_options.hpp"
#include "tracking/sensor_drive.hpp"

namespace livetet {

class KeyPlaces;

enum class LengthUnit { millimetre, metre };
enum class Elements { p1, p2 };

/// A selection of nodes by exactly one of mask, group, box, sphere, half-space, nodes. Coordinates
/// are those of the mesh, RAS.
struct SelectionOptions {
    std::optional<std::filesystem::path> mask;
    std::optional<std::string> group;
    std::optional<std::vector<double>> box_mm, sphere_mm, half_space_mm;
    std::optional<std::vector<int>> nodes;
    NodeScope where = NodeScope::all;

    bool operator==(const SelectionOptions&) const = default;
};

struct MeshSource {
    std::filesystem::path file;
    LengthUnit unit = LengthUnit::millimetre;
    Space space = Space::ras;
    std::vector<int> labels;
    std::string threshold{};
    BodyChoice body{};
    std::optional<double> wrap_mm{};
    std::optional<double> voxel_mm{}, smoothing_mm{};
    std::vector<double> edge_lengths_mm;
    int tets = 60000;
    int levels = 0;
    int refine = 0;
};

struct FixOptions : SelectionOptions {
    std::string components = "xyz";
    std::optional<Uncertain> stiffness_N_per_m;
    double spread_mm = 0;  ///< of the border, one standard deviation

    bool operator==(const FixOptions&) const = default;
};

struct DriveOptions : SelectionOptions {
    Eigen::Vector3d displacement_mm = Eigen::Vector3d::Zero();
    Eigen::Vector3d rotation_deg = Eigen::Vector3d::Zero();
    std::optional<Eigen::Vector3d> centre_mm;
    std::string components = "xyz";
    std::optional<double> stiffness_N_per_m;
    double ramp_s = 0;
    double noise_mm = 0;
    int noise_seed = 1;
};

struct LoadOptions : SelectionOptions {
    Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
    Eigen::Vector3d traction_Pa = Eigen::Vector3d::Zero();
    double pressure_Pa = 0;
};

struct ProbeOptions {
    std::filesystem::path points;
    std::filesystem::path displacements = "probes.csv";
};

/// Parses a time such as "10 ms" or "0.02 s"; result in s. Empty unless it is positive.
std::optional<double> seconds_of(const std::string& text);

/// Parses a closed range of values such as "100:300", "100:" or ":300". Empty if it is invalid.
std::optional<std::pair<double, double>> range_of(const std::string& text);

enum class Pace { recorded, every_sample };

/// A deformation sensor.
struct SensorOptions {
    std::string tool = "Sensor";
    double patch_radius_mm = 15;
    std::optional<double> patch_spread_mm;
    DriveMotion motion = DriveMotion::translation;
    std::optional<double> stiffness_N_per_m;
    int placement = 1;
    bool may_slip = true;

    bool operator==(const SensorOptions&) const = default;
};

/// A tool shown in the image.
struct ToolOptions {
    std::string tool = "Stylus";
    std::filesystem::path tip;

    bool operator==(const ToolOptions&) const = default;
};

/// A target inside the organ, whose error each frame states: a point, points of a file, or a
/// region.
struct TargetOptions : SelectionOptions {
    std::string name;
    std::optional<Eigen::Vector3d> point_mm;
    std::filesystem::path points;

    bool operator==(const TargetOptions&) const = default;
};

/// OpenIGTLink server of the results.
struct PublishOptions {
    std::string address = "127.0.0.1";
    int port = 18945;
    double rate_Hz = 20;
    std::string surface = "Organ";
};

/// How a tracker drives the scene.
struct TrackOptions {
    std::string source;
    std::filesystem::path registration;
    std::string reference_tool = "Reference";
    std::vector<SensorOptions> sensors{SensorOptions{}};
    std::vector<ToolOptions> tools;
    std::vector<TargetOptions> targets;
    double base_window_s = 1;
    double hold_s = 0.5;
    double release_s = 1;
    double max_displacement_mm = 100;
    double position_noise_mm = 1.4;
    double rotation_noise_deg = 0.5;
    std::optional<double> smoothing_Hz{};    ///< of the one-euro filter; not given: the estimator
    std::optional<NumberOrAuto> ahead_ms{};  ///< not given: 40 with the one-euro filter, else 0
    double display_ms = 0;
    int newton_iterations = 1;
    std::string budget{};
    Pace pace = Pace::recorded;
    double speed = 1;
    std::optional<int> request_ms;
    std::optional<PublishOptions> publish;
};

struct OutputOptions {
    std::filesystem::path file = "result.h5";
    /// False for "none": nothing is kept.
    bool has_file() const { return file.filename() != "none"; }
    int every = 1;
    int checkpoint_every = 0;
    std::vector<std::string> fields;
};

/// A scene file: everything that a run needs. Paths are as in the file until `load_scene` resolves
/// them.
struct Scene {
    MeshSource mesh;
    std::filesystem::path image;
    std::vector<Material> materials{Material{}};
    ModelChoice strain = "corotated";
    Elements elements = Elements::p1;
    Formulation formulation = Formulation::automatic;
    TimeOptions time;
    Eigen::Vector3d gravity_m_per_s2 = Eigen::Vector3d::Zero();
    std::vector<FixOptions> fix;
    std::vector<DriveOptions> drive;
    std::vector<LoadOptions> loads;
    SolverOptions solver;
    std::optional<TrackOptions> track;
    std::optional<ProbeOptions> probes;
    OutputOptions output;
};

template <class Visitor>
void visit_selection(Visitor& v, SelectionOptions& s) {
    v.field("mask", s.mask, "",
            "nodes in the non-zero voxels of this mask image (NIfTI, NRRD, MetaImage)");
    v.field("group", s.group, "",
            "nodes of this named set: a Gmsh physical group, or one kept in the hierarchy file");
    v.field("box_mm", s.box_mm, "mm", "nodes in the box [x0, y0, z0, x1, y1, z1]");
    v.field("sphere_mm", s.sphere_mm, "mm", "nodes in the sphere [x, y, z, radius]");
    v.field("half_space_mm", s.half_space_mm, "mm",
            "nodes on the side of a plane that its normal points away from: [point x, y, z, normal "
            "x, y, z]");
    v.field("nodes", s.nodes, "", "these nodes of the finest mesh, counted from 0");
    v.choice("where", s.where, "which of those nodes",
             {{NodeScope::all, "all", "inside and surface"},
              {NodeScope::surface_only, "surface", "only those on the surface"}});
}

template <class Visitor>
void visit_fields(Visitor& v, MeshSource& m) {
    v.field(
        "file", m.file, "",
        "a hierarchy (.h5 of `livetet mesh`), a mesh (.msh, .vtu, .vtk), an image (.nii, .nii.gz, "
        ".nrrd, .nhdr, .mha, .mhd), "
        "or a surface (.stl, .obj, .ply, .vtk, .vtp, .off)");
    v.choice("unit", m.unit, "length unit of a surface, .msh or .vtu file",
             {{LengthUnit::millimetre, "mm", "millimetres"}, {LengthUnit::metre, "m", "metres"}});
    v.choice(
        "space", m.space,
        "directions of the axes of a surface, .msh or .vtu file, which the file does not state",
        {{Space::ras, "ras", "right, anterior, superior"},
         {Space::lps, "lps", "left, posterior, superior, as in models of 3D Slicer since 2020"}});
    v.field("labels", m.labels, "",
            "labels of the label map that make up the body; empty: all but 0");
    v.field(
        "threshold", m.threshold, "",
        "the body in a grey image: the voxels with values from LOW to HIGH, in its units, such as "
        "\"100:300\", \"100:\" or \":300\"",
        Check<std::string>{
            "LOW:HIGH, two numbers of which one may be left out, LOW not above HIGH",
            [](const std::string& text) { return text.empty() || range_of(text).has_value(); }});
    v.choice("cavities", m.body.cavities, "closed cavities of an image's or a surface's body",
             {{Cavities::keep, "keep", "kept: the set \"cavity\" is their surface"},
              {Cavities::fill, "fill", "filled"}});
    v.choice("parts", m.body.parts, "parts of an image's or a surface's body that do not touch",
             {{Parts::largest, "largest", "the largest is meshed"},
              {Parts::all, "all", "all are meshed: the sets \"part_1\", \"part_2\", ..."}});
    v.field("speck_ml", m.body.speck_ml, "ml",
            "smaller parts are left out and smaller cavities filled; default: a thousandth of the "
            "largest part",
            at_least<0>());
    v.field("wrap_mm", m.wrap_mm, "mm",
            "wraps an open, crossing or dirty surface by a closed one: gaps narrower than this are "
            "closed; default: the surface is taken as it is",
            greater_than<0>());
    v.field("voxel_mm", m.voxel_mm, "mm",
            "spacing of the grid from which an image's surface is extracted; default: from the "
            "size of the body and its voxels",
            greater_than<0>());
    v.field("smoothing_mm", m.smoothing_mm, "mm",
            "standard deviation of the Gaussian that smooths an image's voxels, at least 0.6 "
            "voxels; default: as voxel_mm, or less if a thin body would lose volume",
            greater_than<0>());
    v.field("edge_lengths_mm", m.edge_lengths_mm, "mm",
            "edge length of each level, finest first; empty: from tets and levels");
    v.field("tets", m.tets, "", "approximate number of tetrahedra of the finest level",
            Check<int>{"from 100 to 20000000",
                       [](const int& n) { return n >= min_tets && n <= max_tets; }});
    v.field("levels", m.levels, "",
            "number of levels; 0: as many as bring the coarsest to about 150 tets, but one for a "
            ".msh or .vtu",
            Check<int>{"from 0 to 12", [](const int& n) { return n >= 0 && n <= max_levels; }});
    v.field("refine", m.refine, "",
            "number of uniform refinements, each tet into eight and each a level more: for meshes "
            "larger than a mesher can write",
            Check<int>{"from 0 to 4", [](const int& n) { return n >= 0 && n <= 4; }});
}

inline Check<std::string> some_components() {
    return {"some of x, y, z, each once", [](const std::string& s) {
                if (s.empty() || s.size() > 3) return false;
                for (std::size_t i = 0; i < s.size(); ++i)
                    if (std::string("xyz").find(s[i]) == std::string::npos ||
                        s.find(s[i], i + 1) != std::string::npos)
                        return false;
                return true;
            }};
}

/// Whether output.fields may have this name.
inline bool is_result_field(const std::string& name) {
    return name == "stress" || name == "von_mises" || name == "strain_energy" ||
           name == "volume_change" || name == "reactions";
}

template <class Visitor>
void visit_fields(Visitor& v, FixOptions& f) {
    visit_selection(v, f);
    v.field("components", f.components, "", "components that are held", some_components());
    v.field(
        "stiffness_N_per_m", f.stiffness_N_per_m, "N/m",
        "held by springs of this total stiffness, shared evenly by the nodes; none: held rigidly; "
        "`500 +- 200` states its spread, for track.targets",
        Check<Uncertain>{"greater than 0", [](const Uncertain& x) { return x.lowest() > 0; }});
    v.field("spread_mm", f.spread_mm, "mm",
            "how far the border of these nodes may be off, one standard deviation, for "
            "track.targets",
            Check<double>{"from 0 to 100", [](const double& x) { return x >= 0 && x <= 100; }});
}

template <class Visitor>
void visit_fields(Visitor& v, DriveOptions& d) {
    visit_selection(v, d);
    v.field("displacement_mm", d.displacement_mm, "mm", "displacement of the nodes from rest");
    v.field("rotation_deg", d.rotation_deg, "deg",
            "rotation about centre_mm, as axis times angle, applied before the displacement");
    v.field("centre_mm", d.centre_mm, "mm",
            "centre of the rotation; default: the mean of the nodes");
    v.field("components", d.components, "", "components that are driven", some_components());
    v.field("stiffness_N_per_m", d.stiffness_N_per_m, "N/m",
            "driven by springs of this total stiffness, shared evenly by the nodes; none: driven "
            "rigidly",
            greater_than<0>());
    v.field("ramp_s", d.ramp_s, "s", "dynamic schemes: time in which the displacement is reached",
            at_least<0>());
    v.field("noise_mm", d.noise_mm, "mm",
            "RMS length of a random error of the displacement, the same for all nodes, normal on "
            "each axis: the noise of a tracked sensor",
            at_least<0>());
    v.field("noise_seed", d.noise_seed, "", "seed of that error", at_least<0, int>());
}

template <class Visitor>
void visit_fields(Visitor& v, LoadOptions& l) {
    visit_selection(v, l);
    v.field("force_N", l.force_N, "N", "total force, shared evenly by the nodes");
    v.field("traction_Pa", l.traction_Pa, "Pa", "dead traction on the surface between the nodes");
    v.field("pressure_Pa", l.pressure_Pa, "Pa",
            "pressure on the surface between the nodes, inwards along its normal at rest");
}

template <class Visitor>
void visit_fields(Visitor& v, ProbeOptions& p) {
    v.field("points", p.points, "", "CSV of points in the undeformed body: name,x_mm,y_mm,z_mm");
    v.field(
        "displacements", p.displacements, "",
        "CSV to which their displacements are written: "
        "name,x_mm,y_mm,z_mm,ux_mm,uy_mm,uz_mm; by `track` a line for each point and kept frame, "
        "with time_s in front",
        Check<std::filesystem::path>{
            "a file name", [](const std::filesystem::path& path) { return !path.empty(); }});
}

template <class Visitor>
void visit_fields(Visitor& v, SensorOptions& o) {
    v.field("tool", o.tool, "", "name of the sensor: Sensor for SensorToTracker");
    v.field("patch_radius_mm", o.patch_radius_mm, "mm",
            "radius about the sensor within which the surface follows it", greater_than<0>());
    v.field("patch_spread_mm", o.patch_spread_mm, "mm",
            "what that radius may be off by, one standard deviation; default: 15 % of it",
            greater_than<0>());
    v.choice(
        "motion", o.motion, "which part of the sensor's motion the patch follows",
        {{DriveMotion::translation, "translation",
          "translation only: for a sensor that rolls on the surface"},
         {DriveMotion::rigid, "rigid", "rotation, too: for a sensor that is fixed to the organ"}});
    v.field("stiffness_N_per_m", o.stiffness_N_per_m, "N/m",
            "the patch follows by springs of this total stiffness, which reduces noise; none: it "
            "follows rigidly",
            greater_than<0>());
    v.field("placement", o.placement, "",
            "increase it during a run after moving the sensor to another place on the organ: it is "
            "placed anew",
            at_least<0, int>());
    v.field("may_slip", o.may_slip, "",
            "whether the sensor lies loose: motion along the surface, where the organ would not go "
            "along, is a slip. Set it to false for a sensor that is sewn or glued on and pulls the "
            "organ sideways");
}

template <class Visitor>
void visit_fields(Visitor& v, ToolOptions& o) {
    v.field("tool", o.tool, "", "name of the tool: Stylus for StylusToTracker");
    v.field("tip", o.tip, "",
            "tip calibration that `livetet calibrate pivot -o FILE` wrote; none: the tool's sensor "
            "is shown");
}

template <class Visitor>
void visit_fields(Visitor& v, TargetOptions& o) {
    v.field("name", o.name, "", "name of the target; points of a file have their own");
    v.field("point_mm", o.point_mm, "mm", "a point of the image, RAS, inside the organ");
    v.field("points", o.points, "", "points of the image: a CSV of name,x_mm,y_mm,z_mm");
    visit_selection(v, o);
}

template <class Visitor>
void visit_fields(Visitor& v, PublishOptions& o) {
    v.field("address", o.address, "",
            "address to listen on: 127.0.0.1 for this machine only, 0.0.0.0 for all its networks");
    v.field("port", o.port, "",
            "TCP port; a tracker's own server usually has 18944; 0: any free port",
            Check<int>{"from 0 to 65535", [](const int& n) { return n >= 0 && n <= 65535; }});
    v.field("rate_Hz", o.rate_Hz, "Hz", "maximum frame rate; 0: every frame", at_least<0>());
    v.field("surface", o.surface, "", "name of the organ's surface");
}

template <class Visitor>
void visit_fields(Visitor& v, TrackOptions& t) {
    v.field("source", t.source, "",
            "openigtlink://host:port of a tracker server such as PLUS, a recording (PLUS sequence: "
            ".igs.mha, .seq.mha, .nrrd), or the script of a simulated tracker (.yaml)");
    v.field("registration", t.registration, "",
            "registration that `livetet register --reference TOOL -o FILE` wrote");
    v.field("reference_tool", t.reference_tool, "",
            "the reference sensor, fixed to the patient (Reference for ReferenceToTracker)");
    v.list("sensors", t.sensors,
           "the sensors that move the surface; where patches overlap, the mean is used. May be "
           "changed in the file during a run");
    v.list("tools", t.tools, "tools shown in the image. May be changed in the file during a run");
    v.list("targets", t.targets,
           "what each frame states the error of: each by point_mm, points, or a selection of nodes "
           "(of a region, the worst place counts); none: no error statement");
    v.field("base_window_s", t.base_window_s, "s",
            "time over which a sensor's position at rest is averaged", at_least<0>());
    v.field("hold_s", t.hold_s, "s", "time for which a lost sensor holds its patch", at_least<0>());
    v.field("release_s", t.release_s, "s",
            "time in which the patch is then released or, if the sensor is back, taken up again",
            at_least<0>());
    v.field("max_displacement_mm", t.max_displacement_mm, "mm",
            "a sensor farther than this from where it was placed counts as lost",
            greater_than<0>());
    v.field(
        "position_noise_mm", t.position_noise_mm, "mm",
        "the tracker's position error, RMS length, as its maker states it: what the pose "
        "estimator begins with; it learns if the noise is greater",
        Check<double>{"from 0.01 to 100", [](const double& x) { return x >= 0.01 && x <= 100; }});
    v.field(
        "rotation_noise_deg", t.rotation_noise_deg, "degrees",
        "the tracker's rotation error, RMS angle",
        Check<double>{"from 0.001 to 45", [](const double& x) { return x >= 0.001 && x <= 45; }});
    v.field("smoothing_Hz", t.smoothing_Hz, "Hz",
            "smooths poses by the one-euro filter with this cut-off frequency at rest, in place of "
            "the pose estimator; 0: no smoothing",
            at_least<0>());
    v.field("ahead_ms", t.ahead_ms, "ms",
            "time by which poses are extrapolated, to make up for the time until the frame is "
            "shown; auto: the measured time from a sample's arrival to its published frame, and "
            "display_ms, at most 100 together; default: 0, or 40 with a one-euro filter, for its "
            "lag",
            Check<NumberOrAuto>{"from 0 to 500, or auto", [](const NumberOrAuto& x) {
                                    return x.is_auto() || (*x.number >= 0 && *x.number <= 500);
                                }});
    v.field("display_ms", t.display_ms, "ms",
            "with ahead_ms: auto, the part of the latency that cannot be measured here: from the "
            "tracker's measurement to its arrival, and from the published frame to the screen",
            Check<double>{"from 0 to 100", [](const double& x) { return x >= 0 && x <= 100; }});
    v.field("linearisations", t.newton_iterations, "", "Newton iterations of a frame",
            Check<int>{"from 1 to 4", [](const int& n) { return n >= 1 && n <= 4; }});
    v.field("budget", t.budget, "",
            "time budget of a frame, such as 10 ms: as many solver iterations as fit, at least "
            "one; none: to the solver's relative_tolerance, however long it takes",
            Check<std::string>{"a positive time with its unit, ms or s: 10 ms",
                               [](const std::string& text) {
                                   return text.empty() || seconds_of(text).has_value();
                               }});
    v.choice("pace", t.pace, "which samples of a recording become frames",
             {{Pace::recorded, "recorded",
               "at its own pace: each frame takes the newest sample, others are missed"},
              {Pace::every_sample, "every-sample", "every sample in turn, however long it takes"}});
    v.field("speed", t.speed, "", "speed of a recording relative to its own pace",
            greater_than<0>());
    v.field("request_ms", t.request_ms, "ms",
            "interval at which TDATA is requested of the server (STT_TDATA); 0: as often as it "
            "can; for a server that sends none unasked",
            at_least<0, int>());
    v.group("publish", t.publish,
            "OpenIGTLink server, to which 3D Slicer can connect to show the deforming organ");
}

template <class Visitor>
void visit_fields(Visitor& v, OutputOptions& o) {
    v.field("file", o.file, "",
            "result file (.h5, with an .xdmf for ParaView beside it); none: nothing is kept",
            Check<std::filesystem::path>{"a file name that ends in .h5, or none",
                                         [](const std::filesystem::path& p) {
                                             return ending(p) == ".h5" || p.filename() == "none";
                                         }});
    v.field("every", o.every, "", "keep every n-th frame", at_least<1, int>());
    v.field("checkpoint_every", o.checkpoint_every, "",
            "dynamic `solve`: write a checkpoint for --restart every n-th step; 0: none",
            at_least<0, int>());
    v.field("fields", o.fields, "",
            "`solve`: fields kept beside displacements: stress, von_mises, strain_energy, "
            "volume_change (of each tet), reactions (of each node)",
            Check<std::vector<std::string>>{
                "some of stress, von_mises, strain_energy, volume_change, reactions",
                [](const std::vector<std::string>& names) {
                    return std::all_of(names.begin(), names.end(), is_result_field);
                }});
}

template <class Visitor>
void visit_fields(Visitor& v, Scene& s) {
    v.group("mesh", s.mesh, "the body's mesh");
    v.field("image", s.image, "",
            "the grey image of the organ, in the mesh's coordinates, which `livetet view` and "
            "`livetet warp` deform; none: the image that was meshed");
    v.list("materials", s.materials, "materials of the body");
    v.choice("strain", s.strain, "constitutive model of the materials that name none",
             models_without_keys());
    v.choice(
        "elements", s.elements, "tetrahedra of four nodes, or of ten on the same mesh",
        {{Elements::p1, "P1", "four nodes, linear displacement"},
         {Elements::p2, "P2",
          "ten nodes, quadratic displacement: accurate in bending and torsion on a coarse mesh"}});
    v.choice("formulation", s.formulation, "how the volumetric stress is computed",
             {{Formulation::automatic, "automatic",
               "mixed if a material has poisson >= 0.49, else displacement; `track`: displacement"},
              {Formulation::displacement, "displacement",
               "from the displacement: locks as poisson approaches 0.5"},
              {Formulation::mixed, "mixed",
               "from a pressure field of its own at the corners: accurate up to 0.4999"}});
    v.group("time", s.time, "time integration");
    v.field("gravity_m_per_s2", s.gravity_m_per_s2, "m/s^2", "acceleration on the whole body");
    v.list("fix", s.fix, "nodes that are held");
    v.list("drive", s.drive,
           "nodes that are moved; where rigid sets overlap, the last wins; fix takes precedence "
           "over drive");
    v.list("loads", s.loads, "forces");
    v.group("solver", s.solver, "how the equations are solved");
    v.group("track", s.track, "`livetet track`: the tracker and what it moves");
    v.group("probes", s.probes,
            "points whose displacements are written: by `solve` those at the end, by `track` those "
            "of each kept frame");
    v.group("output", s.output, "what is kept");
}

/// Checks keys against each other, and resolves relative paths against `folder`. Throws Error with
/// the place of a key.
void finish_scene(Scene& scene, const KeyPlaces& places, const std::filesystem::path& folder);

/// Reads and checks a scene file; relative paths are resolved against its folder. Throws Error.
Scene load_scene(const std::filesystem::path& path);

}  // namespace livetet
