#pragma once

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/fields.hpp"
#include "io/surface_file.hpp"
#include "mechanics/material.hpp"
#include "mechanics/time_scheme.hpp"
#include "mesh/node_selection.hpp"
#include "meshing/options.hpp"
#include "solvers/linear/solver_options.hpp"
#include "tracking/sensor_drive.hpp"

namespace livetet {

enum class LengthUnit { millimetre, metre };
enum class Elements { p1, p2 };

/// Which nodes: exactly one of mask, group, box, sphere, half-space, nodes. Places are in the
/// mesh's world, RAS.
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
    std::optional<double> voxel_mm{}, smoothing_mm{};
    std::vector<double> edge_lengths_mm;
    int tets = 60000;
    int levels = 0;
    int refine = 0;
};

struct FixOptions : SelectionOptions {
    std::string components = "xyz";
    std::optional<double> stiffness_N_per_m;

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

/// The time that a text such as "10 ms" or "0.02 s" means, s; nothing where it means none above 0.
std::optional<double> seconds_of(const std::string& text);

/// The range of values that a text such as "100:300", "100:" or ":300" means, both ends in it;
/// nothing where it means none.
std::optional<std::pair<double, double>> range_of(const std::string& text);

enum class Pace { recorded, every_sample };

/// One deformation sensor.
struct SensorOptions {
    std::string tool = "Sensor";
    double patch_radius_mm = 15;
    DriveMotion motion = DriveMotion::translation;
    std::optional<double> stiffness_N_per_m;
    int placement = 1;

    bool operator==(const SensorOptions&) const = default;
};

/// A tool that is shown in the image.
struct ToolOptions {
    std::string tool = "Stylus";
    std::filesystem::path tip;

    bool operator==(const ToolOptions&) const = default;
};

/// Who is told what the run computes, by OpenIGTLink.
struct PublishOptions {
    std::string address = "127.0.0.1";
    int port = 18945;
    double rate_Hz = 20;
    std::string surface = "Organ";
};

/// What drives the scene from a tracker.
struct TrackOptions {
    std::string source;
    std::filesystem::path registration;
    std::string reference_tool = "Reference";
    std::vector<SensorOptions> sensors{SensorOptions{}};
    std::vector<ToolOptions> tools;
    double base_window_s = 1;
    double hold_s = 0.5;
    double release_s = 1;
    double max_displacement_mm = 100;
    double smoothing_Hz = 1;
    double ahead_ms = 0;
    int linearisations = 1;
    std::string budget{};
    Pace pace = Pace::recorded;
    double speed = 1;
    std::optional<int> request_ms;
    std::optional<PublishOptions> publish;
};

struct OutputOptions {
    std::filesystem::path file = "result.h5";
    /// Whether anything is to be kept: "none" says no.
    bool has_file() const { return file.filename() != "none"; }
    int every = 1;
    int checkpoint_every = 0;
    std::vector<std::string> fields;
};

/// A scene file: everything that one run needs. Paths are relative to the scene file until
/// `load_scene` has made them absolute.
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
    v.field(
        "half_space_mm", s.half_space_mm, "mm",
        "nodes behind a plane, where its normal does not point: [point x, y, z, normal x, y, z]");
    v.field("nodes", s.nodes, "", "these nodes of the finest mesh, counted from 0");
    v.choice("where", s.where, "of those nodes, which",
             {{NodeScope::all, "all", "inside and surface"},
              {NodeScope::surface_only, "surface", "only those on the surface"}});
}

template <class Visitor>
void visit_fields(Visitor& v, MeshSource& m) {
    v.field("file", m.file, "",
            "a hierarchy (.h5 of `livetet mesh`), a mesh (.msh, .vtu), an image (.nii, .nii.gz, "
            ".nrrd, .nhdr, .mha, .mhd), "
            "or a surface (.stl, .obj, .ply, .vtk, .vtp, .off)");
    v.choice("unit", m.unit, "length unit of a surface, .msh or .vtu file",
             {{LengthUnit::millimetre, "mm", "millimetres"}, {LengthUnit::metre, "m", "metres"}});
    v.choice("space", m.space,
             "which way the axes of a surface, .msh or .vtu file point, which it does not say",
             {{Space::ras, "ras", "right, anterior, superior"},
              {Space::lps, "lps", "left, posterior, superior: Slicer's models since 2020"}});
    v.field("labels", m.labels, "",
            "labels of the label map that make up the body; empty: all but 0");
    v.field("threshold", m.threshold, "",
            "the body in a grey image: the voxels with values from LOW to HIGH, in its units, such "
            "as \"100:300\", \"100:\" "
            "or \":300\"",
            Check<std::string>{"LOW:HIGH, numbers of which one may be left out, LOW not above HIGH",
                               [](const std::string& text) {
                                   return text.empty() || range_of(text).has_value();
                               }});
    v.field("voxel_mm", m.voxel_mm, "mm",
            "spacing of the grid that an image's surface is cut from; not given: from the body's "
            "size and its voxels",
            greater_than<0>());
    v.field("smoothing_mm", m.smoothing_mm, "mm",
            "standard deviation of the Gaussian that smooths an image's voxels, at least 0.6 of "
            "them; not given: as voxel_mm, or "
            "less where a thin body would lose volume",
            greater_than<0>());
    v.field("edge_lengths_mm", m.edge_lengths_mm, "mm",
            "edge length of each level, the finest first; empty: from tets and levels");
    v.field("tets", m.tets, "", "about how many tetrahedra the finest level gets",
            Check<int>{"from 100 to 20000000",
                       [](const int& n) { return n >= min_tets && n <= max_tets; }});
    v.field("levels", m.levels, "",
            "how many levels; 0: as many as bring the coarsest to about 150 tets",
            Check<int>{"from 0 to 12", [](const int& n) { return n >= 0 && n <= max_levels; }});
    v.field("refine", m.refine, "",
            "cut each tet of the finest level into eight, so many times over: sizes that no mesher "
            "should write; each a "
            "level more",
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

/// The names that output.fields knows.
inline bool is_result_field(const std::string& name) {
    return name == "stress" || name == "von_mises" || name == "strain_energy" ||
           name == "volume_change" || name == "reactions";
}

template <class Visitor>
void visit_fields(Visitor& v, FixOptions& f) {
    visit_selection(v, f);
    v.field("components", f.components, "", "which components are held", some_components());
    v.field("stiffness_N_per_m", f.stiffness_N_per_m, "N/m",
            "held softly, by springs of this stiffness in all, shared evenly by the nodes",
            greater_than<0>());
}

template <class Visitor>
void visit_fields(Visitor& v, DriveOptions& d) {
    visit_selection(v, d);
    v.field("displacement_mm", d.displacement_mm, "mm", "where the nodes are moved to, from rest");
    v.field("rotation_deg", d.rotation_deg, "deg",
            "and turned by: axis times angle, about centre_mm, before the displacement");
    v.field("centre_mm", d.centre_mm, "mm",
            "centre of the turn; the mean of the nodes where it is not given");
    v.field("components", d.components, "", "which components are driven", some_components());
    v.field("stiffness_N_per_m", d.stiffness_N_per_m, "N/m",
            "driven softly, by springs of this stiffness in all, shared evenly by the nodes",
            greater_than<0>());
    v.field("ramp_s", d.ramp_s, "s", "dynamic schemes: reached after this time", at_least<0>());
    v.field("noise_mm", d.noise_mm, "mm",
            "RMS length of an error of the displacement, one for all of the nodes, normal on each "
            "axis: as of the tracked sensor "
            "that drives them",
            at_least<0>());
    v.field("noise_seed", d.noise_seed, "", "the same seed, the same error", at_least<0, int>());
}

template <class Visitor>
void visit_fields(Visitor& v, LoadOptions& l) {
    visit_selection(v, l);
    v.field("force_N", l.force_N, "N", "total force, shared evenly by the nodes");
    v.field("traction_Pa", l.traction_Pa, "Pa",
            "force per area of the surface between the nodes, dead");
    v.field("pressure_Pa", l.pressure_Pa, "Pa",
            "pressure on the surface between the nodes, along its rest normal, inwards");
}

template <class Visitor>
void visit_fields(Visitor& v, ProbeOptions& p) {
    v.field("points", p.points, "", "CSV of points in the rest shape: name,x_mm,y_mm,z_mm");
    v.field("displacements", p.displacements, "", "CSV that their displacements are written to");
}

template <class Visitor>
void visit_fields(Visitor& v, SensorOptions& o) {
    v.field("tool", o.tool, "", "its name: Sensor for SensorToTracker");
    v.field("patch_radius_mm", o.patch_radius_mm, "mm",
            "the surface within this distance of the sensor's place follows it", greater_than<0>());
    v.choice("motion", o.motion, "what of the sensor's motion the patch follows",
             {{DriveMotion::translation, "translation",
               "its way alone: right for a sensor that rolls on the surface"},
              {DriveMotion::rigid, "rigid",
               "its turn too: right for a sensor that is fixed to the organ"}});
    v.field("stiffness_N_per_m", o.stiffness_N_per_m, "N/m",
            "the patch follows softly, by springs of this stiffness in all: tames noise; none: it "
            "goes where the sensor goes",
            greater_than<0>());
    v.field("placement", o.placement, "",
            "counted up while running: the sensor was moved to another place on the organ and is "
            "placed anew",
            at_least<0, int>());
}

template <class Visitor>
void visit_fields(Visitor& v, ToolOptions& o) {
    v.field("tool", o.tool, "", "its name: Stylus for StylusToTracker");
    v.field("tip", o.tip, "",
            "what `livetet calibrate pivot -o FILE` wrote; none: the tool's sensor is shown");
}

template <class Visitor>
void visit_fields(Visitor& v, PublishOptions& o) {
    v.field("address", o.address, "",
            "who can connect: 127.0.0.1 this machine alone, 0.0.0.0 every network that it is in");
    v.field("port", o.port, "",
            "of TCP; a tracker's own server mostly has 18944; 0: any that is free",
            Check<int>{"from 0 to 65535", [](const int& n) { return n >= 0 && n <= 65535; }});
    v.field("rate_Hz", o.rate_Hz, "Hz", "frames a second at most; 0: every frame", at_least<0>());
    v.field("surface", o.surface, "", "name of the organ's surface");
}

template <class Visitor>
void visit_fields(Visitor& v, TrackOptions& t) {
    v.field("source", t.source, "",
            "openigtlink://host:port of a tracker server such as PLUS, a recording (PLUS sequence: "
            ".igs.mha, .seq.mha, "
            ".nrrd), or a simulated tracker's script (.yaml)");
    v.field("registration", t.registration, "",
            "what `livetet register --reference TOOL -o FILE` wrote");
    v.field("reference_tool", t.reference_tool, "",
            "the sensor that keeps the registration alive (ReferenceToTracker: Reference)");
    v.list("sensors", t.sensors,
           "the sensors that move the surface; where patches overlap, by the mean. May be changed "
           "in the file while it runs");
    v.list("tools", t.tools,
           "tools that are shown in the image. May be changed in the file while it runs");
    v.field("base_window_s", t.base_window_s, "s",
            "a sensor's place at rest is the mean over this first time", at_least<0>());
    v.field("hold_s", t.hold_s, "s", "so long does a sensor that is lost hold its patch",
            at_least<0>());
    v.field("release_s", t.release_s, "s",
            "then its patch is let go, or, when it is back, taken hold of, in this time",
            at_least<0>());
    v.field("max_displacement_mm", t.max_displacement_mm, "mm",
            "a sensor that is farther than this from where it was placed counts as lost",
            greater_than<0>());
    v.field("smoothing_Hz", t.smoothing_Hz, "Hz",
            "cut-off of the pose filter at rest (one-euro); 0: no filter", at_least<0>());
    v.field(
        "ahead_ms", t.ahead_ms, "ms",
        "poses are carried on by the filter's speeds for so long, to make up for latency; 0: not",
        Check<double>{"from 0 to 1000", [](const double& x) { return x >= 0 && x <= 1000; }});
    v.field("linearisations", t.linearisations, "", "Newton steps a frame",
            Check<int>{"from 1 to 4", [](const int& n) { return n >= 1 && n <= 4; }});
    v.field("budget", t.budget, "",
            "what a frame may take, such as 10 ms: as many solver iterations as fit, one at least; "
            "none: to the solver's "
            "relative_tolerance, however long it takes",
            Check<std::string>{"a time above 0 with its unit, ms or s: 10 ms",
                               [](const std::string& text) {
                                   return text.empty() || seconds_of(text).has_value();
                               }});
    v.choice("pace", t.pace, "which samples of a recording become frames",
             {{Pace::recorded, "recorded",
               "played at its own pace: the newest sample when a frame begins, others are missed"},
              {Pace::every_sample, "every-sample",
               "each sample, one after the other, however long it takes"}});
    v.field("speed", t.speed, "", "a recording is played at so many times its own pace",
            greater_than<0>());
    v.field("request_ms", t.request_ms, "ms",
            "asks the server for TDATA so often (STT_TDATA), 0 for as often as it can: for one "
            "that sends none unasked",
            at_least<0, int>());
    v.group("publish", t.publish,
            "OpenIGTLink server: 3D Slicer shows the organ deform by connecting to it");
}

template <class Visitor>
void visit_fields(Visitor& v, OutputOptions& o) {
    v.field("file", o.file, "",
            "result (.h5, with an .xdmf for ParaView beside it); none: nothing is kept");
    v.field("every", o.every, "", "keep every n-th frame", at_least<1, int>());
    v.field(
        "checkpoint_every", o.checkpoint_every, "",
        "dynamic `solve`: keep every n-th step all that is needed to go on with --restart; 0: not",
        at_least<0, int>());
    v.field("fields", o.fields, "",
            "`solve`: what is kept beside displacements: stress, von_mises, strain_energy, "
            "volume_change (of each tet), "
            "reactions (of each node)",
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
            "the grey image of the organ, in the mesh's world: what `livetet view` and `livetet "
            "warp` deform; none: the image that was meshed");
    v.list("materials", s.materials, "what it is made of");
    v.choice("strain", s.strain, "constitutive model of the materials that name none",
             models_without_keys());
    v.choice("elements", s.elements, "tetrahedra of four nodes, or of ten on the same mesh",
             {{Elements::p1, "P1", "four nodes, linear displacement"},
              {Elements::p2, "P2",
               "ten nodes, quadratic displacement: bends and twists right on a coarse mesh"}});
    v.choice("formulation", s.formulation, "where the volumetric stress comes from",
             {{Formulation::automatic, "automatic",
               "mixed where a material has poisson >= 0.49, else displacement; "
               "`track`: displacement"},
              {Formulation::displacement, "displacement",
               "the displacement alone: locks as poisson nears 0.5"},
              {Formulation::mixed, "mixed",
               "a pressure of its own at the corners: right up to 0.4999"}});
    v.group("time", s.time, "how it moves in time");
    v.field("gravity_m_per_s2", s.gravity_m_per_s2, "m/s^2", "acceleration on the whole body");
    v.list("fix", s.fix, "nodes that are held");
    v.list("drive", s.drive,
           "nodes that are moved; where hard sets overlap the last wins, and fix wins over drive");
    v.list("loads", s.loads, "forces");
    v.group("solver", s.solver, "how the equations are solved");
    v.group("track", s.track, "`livetet track`: the tracker, and what it moves");
    v.group("probes", s.probes, "points of which the displacement is wanted");
    v.group("output", s.output, "what is kept");
}

/// Checks what goes together in a scene, and makes its relative paths relative to `folder`. Throws
/// Error, naming `file`.
void finish_scene(Scene& scene, const std::string& file, const std::filesystem::path& folder);

/// Reads and checks a scene file; relative paths become relative to the file's folder. Throws
/// Error.
Scene load_scene(const std::filesystem::path& path);

}  // namespace livetet
