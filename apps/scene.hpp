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
#include "solvers/options.hpp"
#include "tracking/sensor_drive.hpp"

namespace livetet {

enum class LengthUnit { millimetre, metre };
enum class Elements { p1, p2 };

/// Which nodes: exactly one of mask, group, box, sphere, half-space, nodes. Places are in the mesh's world, RAS.
struct SelectionOptions {
    std::optional<std::filesystem::path> mask;
    std::optional<std::string> group;
    std::optional<std::vector<double>> box_mm, sphere_mm, half_space_mm;
    std::optional<std::vector<int>> nodes;
    NodeScope where = NodeScope::all;
};

struct MeshSource {
    std::filesystem::path file;
    LengthUnit unit = LengthUnit::millimetre;
    Space space = Space::ras;
    std::vector<int> labels;
    std::string threshold{};
    std::vector<double> edge_lengths_mm;
    int tets = 60000;
    int levels = 0;
};

struct FixOptions : SelectionOptions {
    std::string components = "xyz";
    std::optional<double> stiffness_N_per_m;
};

struct DriveOptions : SelectionOptions {
    Eigen::Vector3d displacement_mm = Eigen::Vector3d::Zero();
    Eigen::Vector3d rotation_deg = Eigen::Vector3d::Zero();
    std::optional<Eigen::Vector3d> centre_mm;
    std::string components = "xyz";
    std::optional<double> stiffness_N_per_m;
    double ramp_s = 0;
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

/// The range of values that a text such as "100:300", "100:" or ":300" means, both ends in it; nothing where it means none.
std::optional<std::pair<double, double>> range_of(const std::string& text);

enum class Pace { recorded, every_sample };

/// What drives the scene from a tracker.
struct TrackOptions {
    std::filesystem::path recording;
    std::filesystem::path registration;
    std::string reference_tool = "Reference";
    std::string sensor_tool = "Sensor";
    double patch_radius_mm = 15;
    DriveMotion motion = DriveMotion::translation;
    double base_window_s = 1;
    double smoothing_Hz = 1;
    int linearisations = 1;
    std::string budget{};
    Pace pace = Pace::recorded;
};

struct OutputOptions {
    std::filesystem::path file = "result.h5";
    int every = 1;
    std::vector<std::string> fields;
};

/// A scene file: everything that one run needs. Paths are relative to the scene file until `load_scene` has made them
/// absolute.
struct Scene {
    MeshSource mesh;
    std::vector<Material> materials{Material{}};
    StrainModel strain = StrainModel::corotated;
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
    v.field("mask", s.mask, "", "nodes in the non-zero voxels of this mask image (NIfTI, NRRD, MetaImage)");
    v.field("group", s.group, "", "nodes of this named set: a Gmsh physical group, or one kept in the hierarchy file");
    v.field("box_mm", s.box_mm, "mm", "nodes in the box [x0, y0, z0, x1, y1, z1]");
    v.field("sphere_mm", s.sphere_mm, "mm", "nodes in the sphere [x, y, z, radius]");
    v.field("half_space_mm", s.half_space_mm, "mm",
            "nodes behind a plane, where its normal does not point: [point x, y, z, normal x, y, z]");
    v.field("nodes", s.nodes, "", "these nodes of the finest mesh, counted from 0");
    v.choice("where", s.where, "of those nodes, which",
             {{NodeScope::all, "all", "inside and surface"},
              {NodeScope::surface_only, "surface", "only those on the surface"}});
}

template <class Visitor>
void visit_fields(Visitor& v, MeshSource& m) {
    v.field("file", m.file, "",
            "a hierarchy (.h5 of `livetet mesh`), a mesh (.msh, .vtu), an image (.nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd), "
            "or a surface (.stl, .obj, .ply, .vtk, .vtp, .off)");
    v.choice("unit", m.unit, "length unit of a .msh or .vtu file",
             {{LengthUnit::millimetre, "mm", "millimetres"}, {LengthUnit::metre, "m", "metres"}});
    v.choice("space", m.space, "which way the axes of a surface, .msh or .vtu file point, which it does not say",
             {{Space::ras, "ras", "right, anterior, superior"},
              {Space::lps, "lps", "left, posterior, superior: Slicer's models since 2020"}});
    v.field("labels", m.labels, "", "labels of the label map that make up the body; empty: all but 0");
    v.field("threshold", m.threshold, "",
            "the body in a grey image: the voxels with values from LOW to HIGH, in its units, such as \"100:300\", \"100:\" "
            "or \":300\"",
            Check<std::string>{"LOW:HIGH, numbers of which one may be left out, LOW not above HIGH",
                               [](const std::string& text) { return text.empty() || range_of(text).has_value(); }});
    v.field("edge_lengths_mm", m.edge_lengths_mm, "mm",
            "edge length of each level, the finest first; empty: from tets and levels");
    v.field("tets", m.tets, "", "about how many tetrahedra the finest level gets",
            Check<int>{"from 100 to 20000000", [](const int& n) { return n >= 100 && n <= 20000000; }});
    v.field("levels", m.levels, "", "how many levels; 0: as many as bring the coarsest to about 150 tets",
            Check<int>{"from 0 to 8", [](const int& n) { return n >= 0 && n <= 8; }});
}

inline Check<std::string> some_components() {
    return {"some of x, y, z, each once", [](const std::string& s) {
                if (s.empty() || s.size() > 3) return false;
                for (std::size_t i = 0; i < s.size(); ++i)
                    if (std::string("xyz").find(s[i]) == std::string::npos || s.find(s[i], i + 1) != std::string::npos)
                        return false;
                return true;
            }};
}

/// The names that output.fields knows.
inline bool is_result_field(const std::string& name) {
    return name == "stress" || name == "von_mises" || name == "strain_energy" || name == "volume_change" ||
           name == "reactions";
}

template <class Visitor>
void visit_fields(Visitor& v, FixOptions& f) {
    visit_selection(v, f);
    v.field("components", f.components, "", "which components are held", some_components());
    v.field("stiffness_N_per_m", f.stiffness_N_per_m, "N/m",
            "held softly, by springs of this stiffness in all, shared evenly by the nodes", greater_than<0>());
}

template <class Visitor>
void visit_fields(Visitor& v, DriveOptions& d) {
    visit_selection(v, d);
    v.field("displacement_mm", d.displacement_mm, "mm", "where the nodes are moved to, from rest");
    v.field("rotation_deg", d.rotation_deg, "deg",
            "and turned by: axis times angle, about centre_mm, before the displacement");
    v.field("centre_mm", d.centre_mm, "mm", "centre of the turn; the mean of the nodes where it is not given");
    v.field("components", d.components, "", "which components are driven", some_components());
    v.field("stiffness_N_per_m", d.stiffness_N_per_m, "N/m",
            "driven softly, by springs of this stiffness in all, shared evenly by the nodes", greater_than<0>());
    v.field("ramp_s", d.ramp_s, "s", "dynamic schemes: reached after this time", at_least<0>());
}

template <class Visitor>
void visit_fields(Visitor& v, LoadOptions& l) {
    visit_selection(v, l);
    v.field("force_N", l.force_N, "N", "total force, shared evenly by the nodes");
    v.field("traction_Pa", l.traction_Pa, "Pa", "force per area of the surface between the nodes, dead");
    v.field("pressure_Pa", l.pressure_Pa, "Pa",
            "pressure on the surface between the nodes, along its rest normal, inwards");
}

template <class Visitor>
void visit_fields(Visitor& v, ProbeOptions& p) {
    v.field("points", p.points, "", "CSV of points in the rest shape: name,x_mm,y_mm,z_mm");
    v.field("displacements", p.displacements, "", "CSV that their displacements are written to");
}

template <class Visitor>
void visit_fields(Visitor& v, TrackOptions& t) {
    v.field("recording", t.recording, "", "tracker recording (PLUS sequence: .igs.mha, .seq.mha, .nrrd)");
    v.field("registration", t.registration, "", "what `livetet register --reference TOOL -o FILE` wrote");
    v.field("reference_tool", t.reference_tool, "",
            "the sensor that keeps the registration alive (ReferenceToTracker: Reference)");
    v.field("sensor_tool", t.sensor_tool, "", "the sensor that moves the patch");
    v.field("patch_radius_mm", t.patch_radius_mm, "mm",
            "the surface within this distance of the sensor's place follows it", greater_than<0>());
    v.choice("motion", t.motion, "what of the sensor's motion the patch follows",
             {{DriveMotion::translation, "translation", "its way alone: right for a sensor that rolls on the surface"},
              {DriveMotion::rigid, "rigid", "its turn too: right for a sensor that is fixed to the organ"}});
    v.field("base_window_s", t.base_window_s, "s", "the sensor's place at rest is the mean over this first time",
            at_least<0>());
    v.field("smoothing_Hz", t.smoothing_Hz, "Hz", "cut-off of the pose filter at rest (one-euro); 0: no filter",
            at_least<0>());
    v.field("linearisations", t.linearisations, "", "Newton steps a frame", at_least<1, int>());
    v.field("budget", t.budget, "",
            "what a frame may take, such as 10 ms: as many solver iterations as fit, one at least; none: to the solver's "
            "relative_tolerance, however long it takes",
            Check<std::string>{"a time above 0 with its unit, ms or s: 10 ms",
                               [](const std::string& text) { return text.empty() || seconds_of(text).has_value(); }});
    v.choice("pace", t.pace, "which samples of the recording become frames",
             {{Pace::recorded, "recorded",
               "played at its own pace: the newest sample when a frame begins, others are missed"},
              {Pace::every_sample, "every-sample", "each sample, one after the other, however long it takes"}});
}

template <class Visitor>
void visit_fields(Visitor& v, OutputOptions& o) {
    v.field("file", o.file, "", "result (.h5, with an .xdmf for ParaView beside it)");
    v.field("every", o.every, "", "keep every n-th frame", at_least<1, int>());
    v.field("fields", o.fields, "",
            "`solve`: what is kept beside displacements: stress, von_mises, strain_energy, volume_change (of each tet), "
            "reactions (of each node)",
            Check<std::vector<std::string>>{"some of stress, von_mises, strain_energy, volume_change, reactions",
                                            [](const std::vector<std::string>& names) {
                                                return std::all_of(names.begin(), names.end(), is_result_field);
                                            }});
}

template <class Visitor>
void visit_fields(Visitor& v, Scene& s) {
    v.group("mesh", s.mesh, "the body's mesh");
    v.list("materials", s.materials, "what it is made of");
    v.choice("strain", s.strain, "strain model of the elements",
             {{StrainModel::corotated, "corotated", "small strain, any rotation"},
              {StrainModel::linear, "linear", "small strain, small rotation: cheapest"},
              {StrainModel::green, "green", "Green's strain (St Venant-Kirchhoff): large rotation, tension; softens and "
                                            "collapses in compression"},
              {StrainModel::neohookean, "neohookean", "rubber, tissue: large strain, through inversion too"}});
    v.choice("elements", s.elements, "tetrahedra of four nodes, or of ten on the same mesh",
             {{Elements::p1, "P1", "four nodes, linear displacement"},
              {Elements::p2, "P2", "ten nodes, quadratic displacement: bends and twists right on a coarse mesh"}});
    v.choice("formulation", s.formulation, "where the volumetric stress comes from",
             {{Formulation::automatic, "automatic", "mixed where a material has poisson >= 0.49, else displacement; "
                                                    "`track`: displacement"},
              {Formulation::displacement, "displacement", "the displacement alone: locks as poisson nears 0.5"},
              {Formulation::mixed, "mixed", "a pressure of its own at the corners: right up to 0.4999"}});
    v.group("time", s.time, "how it moves in time");
    v.field("gravity_m_per_s2", s.gravity_m_per_s2, "m/s^2", "acceleration on the whole body");
    v.list("fix", s.fix, "nodes that are held");
    v.list("drive", s.drive, "nodes that are moved; where hard sets overlap the last wins, and fix wins over drive");
    v.list("loads", s.loads, "forces");
    v.group("solver", s.solver, "how the equations are solved");
    v.group("track", s.track, "`livetet track`: the tracker, and what it moves");
    v.group("probes", s.probes, "points of which the displacement is wanted");
    v.group("output", s.output, "what is kept");
}

/// Reads and checks a scene file; relative paths become relative to the file's folder. Throws Error.
Scene load_scene(const std::filesystem::path& path);

}  // namespace livetet
