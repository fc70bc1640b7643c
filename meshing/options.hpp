#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// What users may ask for; a budget or a scene can say no more than these either.
constexpr int min_tets = 100, max_tets = 20'000'000, max_levels = 12;

/// Edges deep inside over those of the surface, where nothing else is asked for.
constexpr double default_inside_growth = 1.5;

/// A place where the finest level wants edges of this length or shorter; each coarser level has
/// them longer by the coarsening. Metres.
struct FineSphere {
    Vector3 centre = Vector3::Zero();
    double radius_m = 0, edge_length_m = 0;
};

/// The edge length wanted at a place; both in metres. Empty: the same everywhere.
using EdgeLengthField = std::function<double(const Vector3&)>;

/// How an image or a surface becomes a hierarchy of tet meshes. The defaults give a liver of about
/// 150 x 110 x 80 mm four levels of about 60,000, 7,500, 1,000 and 150 tets.
struct MeshingOptions {
    // Which voxels, and how smooth their surface.
    std::vector<std::int32_t>
        labels;  ///< labels that make the body, together; empty: every label but 0
    /// Spacing of the grid that an image's surface is cut from, and the standard deviation of the
    /// Gaussian that smooths its voxels (at least 0.6 of them along each axis), mm; none: see
    /// `surface_of_labels`.
    std::optional<double> voxel_mm, smoothing_mm;

    // How many levels, how fine.
    int levels =
        0;  ///< non-nested levels, where `edge_lengths_mm` is empty; 0: see automatic_levels
    std::int64_t target_tets =
        60000;                ///< tets wanted on the finest level, where `edge_lengths_mm` is empty
    double coarsening = 2.0;  ///< edge length of each level over that of the next finer one
    std::vector<double>
        edge_lengths_mm;  ///< edge length of each level, mm, the finest first; overrides the above
    double target_tolerance = 0.1;  ///< relative miss of `target_tets` that is good enough
    int target_tries = 5;           ///< finest meshes made, at most, on the way to `target_tets`
    /// Edges deep inside over those of the surface, 1 to 10; none: as they come, up to about twice
    /// as long.
    std::optional<double> inside_growth;
    std::vector<FineSphere>
        finer;              ///< where edges are shorter; away from it they grow by 0.3 of the way
    TriangleMesh finer_at;  ///< a surface at which edges are shorter, such as a mask's border;
                            ///< growing likewise
    double finer_at_ratio = 0.5;  ///< edges at it over those elsewhere, 0.1 to 1

    // Remeshing of the surface and filling of the volume.
    int remesh_iterations = 5;  ///< passes of split, collapse, flip and relax
    int remesh_tries = 6;  ///< tries with ever smaller edges where a coarse surface meets itself
    double gmsh_time_limit_s =
        300;                  ///< seconds for each level, after which Gmsh's process is killed
    int optimise_passes = 2;  ///< passes of Gmsh's optimiser over each volume; 0: none
    double min_dihedral_deg =
        5;  ///< no tet of an accepted level has a smaller dihedral angle, degrees; 0: any
};

/// What a tet costs in a frame of the live solver, s: 6 ms for 60,000, two cores of a 2.4 GHz EPYC,
/// one iteration at a Poisson's ratio of 0.45.
constexpr double live_seconds_per_tet = 1e-7;

/// How many tets a frame of `budget_s` seconds has time for; from `min_tets` to `max_tets`.
std::int64_t tets_for_budget(double budget_s);

/// As many levels as bring the coarsest to at most 150 tets where each has 1 / coarsening^3 of the
/// tets of the one before it: the live solver factors the coarsest densely whenever the time step
/// changes. At least 2, at most 12.
int automatic_levels(std::int64_t finest_tets, double coarsening);

/// Throws Error, naming the option or key that sets it (or else the member), if a value cannot be
/// used.
void check_options(const MeshingOptions& options);

}  // namespace livetet
