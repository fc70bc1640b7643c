#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Limits of user options, budgets and scenes.
constexpr int min_tets = 100, max_tets = 20'000'000, max_levels = 12;

/// Default ratio of edges deep inside to those at the surface.
constexpr double default_inside_growth = 1.5;

/// A sphere in which the finest level has edges of at most this length (metres); coarser levels
/// scale it by the coarsening.
struct FineSphere {
    Vector3 centre = Vector3::Zero();
    double radius_m = 0, edge_length_m = 0;
};

/// The wanted edge length at a position, both in metres. Empty: uniform.
using EdgeLengthField = std::function<double(const Vector3&)>;

/// Shorter edges on patches of the surface and near them, relative to those of the level: the
/// number of tets is kept, and coarser levels are graded alike. With h the level's edge length and
/// d the distance from the nearest patch, edges are min(h, ratio h + growth d).
struct PatchGrading {
    /// The part of the body's surface within a sphere, metres.
    struct Patch {
        Vector3 centre = Vector3::Zero();
        double radius_m = 0;
    };
    std::vector<Patch> patches;
    double ratio = 0.25;  ///< of edges at a patch to those elsewhere, 0.1 to 1
    double growth = 0.3;  ///< of the edge length with the distance from a patch, 0.05 to 1
};

/// What becomes of a body's closed cavities.
enum class Cavities { keep, fill };

/// Which of a body's separate parts are meshed.
enum class Parts { largest, all };

/// What of an input is the body.
struct BodyChoice {
    Cavities cavities = Cavities::keep;
    Parts parts = Parts::largest;
    /// Smaller parts are left out and smaller cavities filled; none: a thousandth of the largest
    /// part.
    std::optional<double> speck_ml{};

    /// Volume of a speck, m^3, of a body whose largest part has the volume `largest_m3`.
    double speck_m3(double largest_m3) const {
        return speck_ml ? 1e-6 * *speck_ml : 1e-3 * largest_m3;
    }
};

/// Options for meshing an image or a surface. The defaults give a liver of about 150 x 110 x 80 mm
/// four levels of about 60,000, 7,500, 1,000 and 150 tets.
struct MeshingOptions {
    // Choice of voxels, smoothing of their surface.
    /// Labels that together form the body; empty: all but 0.
    std::vector<std::int32_t> labels;
    BodyChoice body;
    /// Wraps the surface: gaps narrower than this are closed, mm; none: it is taken as it is.
    std::optional<double> wrap_mm;
    /// Spacing of the grid of an image's iso-surface, and standard deviation of the Gaussian that
    /// smooths the voxels (at least 0.6 voxels along each axis), mm; none: see `surface_of_labels`.
    std::optional<double> voxel_mm, smoothing_mm;

    /// Called with the repaired surface before minutes of meshing; may throw.
    std::function<void(const TriangleMesh&)> check_surface;

    // Number and resolution of the levels.
    /// Number of levels if `edge_lengths_mm` is empty; 0: see automatic_levels.
    int levels = 0;
    /// Number of tets of the finest level if `edge_lengths_mm` is empty.
    std::int64_t target_tets = 60000;
    double coarsening = 2.0;  ///< ratio of a level's edge length to that of the next finer one
    /// Edge length of each level, mm, finest first; overrides the above.
    std::vector<double> edge_lengths_mm;
    double target_tolerance = 0.1;  ///< accepted relative error of `target_tets`
    int target_tries = 5;           ///< maximum number of attempts to reach `target_tets`
    /// Ratio of edges deep inside to those at the surface, 1 to 10; none: unconstrained, up to
    /// about 2.
    std::optional<double> inside_growth;
    /// Spheres with shorter edges; outside, edges grow by 0.3 times the distance.
    std::vector<FineSphere> finer;
    /// A surface with shorter edges near it, such as a mask's border; with the same growth.
    TriangleMesh finer_at;
    double finer_at_ratio = 0.5;  ///< ratio of edges there to those elsewhere, 0.1 to 1

    // Remeshing of the surface, filling of the volume.
    int remesh_iterations = 5;  ///< passes of split, collapse, flip and relax
    int remesh_tries =
        6;  ///< attempts with ever smaller edges if a coarse surface intersects itself
    /// Seconds for each level; then Gmsh's process is killed.
    double gmsh_time_limit_s = 300;
    int optimise_passes = 2;  ///< passes of Gmsh's optimiser over each volume; 0: none
    /// Smallest accepted dihedral angle, degrees; 0: any.
    double min_dihedral_deg = 5;

    PatchGrading grading;  ///< patches of the surface with shorter edges
};

/// Cost of a tet in a frame of the live solver, s: 6 ms for 60,000 tets on two cores of a 2.4 GHz
/// EPYC, with one iteration at a Poisson's ratio of 0.45.
constexpr double live_seconds_per_tet = 1e-7;

/// Number of tets that a frame of `budget_s` seconds can compute, clamped to `min_tets` to
/// `max_tets`.
std::int64_t tets_for_budget(double budget_s);

/// Number of levels, 2 to 12, for a coarsest level of at most 150 tets if each level has 1 /
/// coarsening^3 of the tets of the one before: the live solver factors the coarsest matrix densely
/// whenever the time step changes.
int automatic_levels(std::int64_t finest_tets, double coarsening);

/// Throws Error for an invalid value, naming the option or key (or else the member).
void check_options(const MeshingOptions& options);

}  // namespace livetet
