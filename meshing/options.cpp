#include "meshing/options.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"

namespace livetet {

namespace {

constexpr double coarsest_tets = 150;

void positive(const char* name, double value) {
    if (!(value > 0) || !std::isfinite(value)) fail("meshing.{} = {} must be > 0 and finite", name, value);
}

}  // namespace

int automatic_levels(std::int64_t finest_tets, double coarsening) {
    const double ratio = coarsening * coarsening * coarsening;
    int levels = 1;
    for (auto tets = static_cast<double>(finest_tets); tets > coarsest_tets && levels < most_levels; tets /= ratio)
        ++levels;
    return std::max(levels, 2);
}

std::int64_t tets_for_budget(double budget_s) {
    return std::llround(std::clamp<double>(budget_s / live_seconds_per_tet, least_tets, most_tets));
}

void check_options(const MeshingOptions& o) {
    positive("voxel_mm", o.voxel_mm);
    if (!(o.smoothing_mm >= 0)) fail("meshing.smoothing_mm = {} must be >= 0", o.smoothing_mm);
    if (o.levels < 0 || o.levels > most_levels)
        fail("meshing.levels = {} must be 1 to {}, or 0: automatic", o.levels, most_levels);
    if (o.target_tets < 50) fail("meshing.target_tets = {} must be at least 50", o.target_tets);
    if (!(o.coarsening > 1)) fail("meshing.coarsening = {} must be > 1", o.coarsening);
    for (std::size_t l = 0; l < o.edge_lengths_mm.size(); ++l) {
        positive("edge_lengths_mm", o.edge_lengths_mm[l]);
        if (l > 0 && o.edge_lengths_mm[l] <= o.edge_lengths_mm[l - 1])
            fail("meshing.edge_lengths_mm[{}] = {} must be > {}: the finest level comes first", l, o.edge_lengths_mm[l],
                 o.edge_lengths_mm[l - 1]);
    }
    positive("target_tolerance", o.target_tolerance);
    positive("target_tries", o.target_tries);
    positive("remesh_iterations", o.remesh_iterations);
    positive("remesh_tries", o.remesh_tries);
    positive("gmsh_time_limit_s", o.gmsh_time_limit_s);
    if (o.optimise_passes < 0) fail("meshing.optimise_passes = {} must be >= 0", o.optimise_passes);
    if (o.inside_growth && !(*o.inside_growth >= 1 && *o.inside_growth <= 10))
        fail("meshing.inside_growth = {} must be from 1 to 10", *o.inside_growth);
    for (const FineSphere& s : o.finer) {
        positive("finer.radius_m", s.radius_m);
        positive("finer.edge_length_m", s.edge_length_m);
    }
    if (!(o.finer_at_ratio >= 0.1 && o.finer_at_ratio <= 1))
        fail("meshing.finer_at_ratio = {} must be from 0.1 to 1", o.finer_at_ratio);
    if (!(o.min_dihedral_deg >= 0 && o.min_dihedral_deg <= 15))
        fail("meshing.min_dihedral_deg = {} must be from 0 to 15", o.min_dihedral_deg);
}

}  // namespace livetet
