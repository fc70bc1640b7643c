#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/scene/cut_options.hpp"
#include "apps/scene/deform_options.hpp"
#include "apps/scene/mesh_options.hpp"
#include "apps/scene/selection_options.hpp"
#include "apps/scene/track_options.hpp"
#include "config/fields.hpp"
#include "io/text.hpp"
#include "mechanics/material.hpp"
#include "mechanics/time_scheme.hpp"
#include "solvers/linear/solver_options.hpp"

namespace livetet {

class KeyPlaces;

enum class Elements { p1, p2 };

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
    std::vector<CutOptions> cuts;
    FreePieces free_pieces = FreePieces::refuse;
    SolverOptions solver;
    std::optional<TrackOptions> track;
    std::optional<DeformOptions> deform;
    std::optional<ProbeOptions> probes;
    OutputOptions output;
};

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

template <class Visitor>
void visit_fields(Visitor& v, FixOptions& f) {
    visit_selection(v, f);
    v.field("components", f.components, "", "components that are held", some_components());
    v.field("stiffness_N_per_m", f.stiffness_N_per_m, "N/m",
            "held by springs of this total stiffness, shared as force_N is; none: held rigidly; "
            "`500 +- 200` states its spread, for track.targets",
            greater_than<0, Uncertain>());
    v.field("spread_mm", f.spread_mm, "mm",
            "how far the border of these nodes may be off, one standard deviation, for "
            "track.targets",
            within({0, 100}));
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
            "driven by springs of this total stiffness, shared as force_N is; none: driven "
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
    v.field("force_N", l.force_N, "N",
            "total force, shared evenly by the nodes; on a grid of hexahedra in proportion to the "
            "tissue "
            "around each");
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
            some_of({"stress", "von_mises", "strain_energy", "volume_change", "reactions"}));
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
        "elements", s.elements,
        "tetrahedra of four nodes, or of ten on the same mesh; a grid's hexahedra of eight nodes, "
        "or of 27",
        {{Elements::p1, "P1", "four nodes, linear displacement"},
         {Elements::p2, "P2",
          "ten nodes, of hexahedra 27 (`solve` and `study`), quadratic displacement: accurate in "
          "bending and torsion on a coarse mesh"}});
    v.choice("formulation", s.formulation, "how the volumetric stress is computed",
             {{Formulation::automatic, "automatic",
               "mixed if a material has poisson >= 0.49, or, in `track` alone, if a sensor has a "
               "place_mm and a model is of finite strain, but not neohookean; else displacement"},
              {Formulation::displacement, "displacement",
               "from the displacement: locks as poisson approaches 0.5"},
              {Formulation::mixed, "mixed",
               "from pressures of its own, at the corners of tetrahedra, one in each hexahedron of "
               "eight nodes or four in one of 27: accurate up to 0.4999"}});
    v.group("time", s.time, "time integration");
    v.field("gravity_m_per_s2", s.gravity_m_per_s2, "m/s^2", "acceleration on the whole body");
    v.list("fix", s.fix, "nodes that are held");
    v.list("drive", s.drive,
           "nodes that are moved; where rigid sets overlap, the last wins; fix takes precedence "
           "over drive");
    v.list("loads", s.loads, "forces");
    v.list(
        "cuts", s.cuts,
        "cuts: of tetrahedra along the surface, of a grid of hexahedra along faces of its cells");
    v.choice("free_pieces", s.free_pieces, "pieces that neither fix nor drive holds after the cuts",
             {{FreePieces::refuse, "refuse", "an error that tells their places and volumes"},
              {FreePieces::leave_out, "leave_out", "they are left out of the mesh"},
              {FreePieces::keep, "keep",
               "in a static scene they keep their place at rest, whatever acts on them; in a "
               "dynamic one they move freely"}});
    v.group("solver", s.solver, "how the equations are solved");
    v.group("track", s.track, "`livetet track`: the tracker and what it moves");
    v.group("deform", s.deform,
            "`livetet register --deform`: the forces that are sought from points of the surface");
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
