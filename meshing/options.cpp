#include "meshing/options.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"

namespace livetet {

namespace {

constexpr double coarsest_tets = 150;

void positive(const char* name, double value) {
    if (!(value > 0) || !std::isfinite(value)) fail("{} = {} must be > 0 and finite", name, value);
}

}  // namespace

int automatic_levels(std::int64_t finest_tets, double coarsening) {
    const double ratio = coarsening * coarsening * coarsening;
    int levels = 1;
    for (auto tets = static_cast<double>(finest_tets); tets > coarsest_tets && levels < max_levels;
         tets /= ratio)
        ++levels;
    return std::max(levels, 2);
}

std::int64_t tets_for_budget(double budget_s) {
    return std::llround(std::clamp<double>(budget_s / live_seconds_per_tet, min_tets, max_tets));
}

void check_options(const MeshingOptions& o) {
    if (o.wrap_mm) positive("mesh.wrap_mm", *o.wrap_mm);
    if (o.voxel_mm) positive("mesh.voxel_mm", *o.voxel_mm);
    if (o.smoothing_mm) positive("mesh.smoothing_mm", *o.smoothing_mm);
    if (o.body.speck_ml && !(*o.body.speck_ml >= 0))
        fail("mesh.speck_ml = {} must be >= 0", *o.body.speck_ml);
    if (o.levels < 0 || o.levels > max_levels)
        fail("mesh.levels = {} must be 1 to {}, or 0: automatic", o.levels, max_levels);
    if (o.target_tets < min_tets)
        fail("mesh.tets = {} must be at least {}", o.target_tets, min_tets);
    if (!(o.coarsening > 1)) fail("MeshingOptions::coarsening = {} must be > 1", o.coarsening);
    for (std::size_t l = 0; l < o.edge_lengths_mm.size(); ++l) {
        positive("mesh.edge_lengths_mm", o.edge_lengths_mm[l]);
        if (l > 0 && o.edge_lengths_mm[l] <= o.edge_lengths_mm[l - 1])
            fail("mesh.edge_lengths_mm[{}] = {} must be > {}: the finest level comes first", l,
                 o.edge_lengths_mm[l], o.edge_lengths_mm[l - 1]);
    }
    positive("MeshingOptions::target_tolerance", o.target_tolerance);
    positive("MeshingOptions::target_tries", o.target_tries);
    positive("MeshingOptions::remesh_iterations", o.remesh_iterations);
    positive("MeshingOptions::remesh_tries", o.remesh_tries);
    positive("--time-limit-s", o.gmsh_time_limit_s);
    if (o.optimise_passes < 0)
        fail("MeshingOptions::optimise_passes = {} must be >= 0", o.optimise_passes);
    if (o.inside_growth && !(*o.inside_growth >= 1 && *o.inside_growth <= 10))
        fail("--inside-growth = {} must be from 1 to 10", *o.inside_growth);
    for (const FineSphere& s : o.finer) {
        positive("--refine-sphere: radius in m", s.radius_m);
        positive("--refine-sphere: edge in m", s.edge_length_m);
    }
    if (!(o.finer_at_ratio >= 0.1 && o.finer_at_ratio <= 1))
        fail("--fix-edge-ratio = {} must be from 0.1 to 1", o.finer_at_ratio);
    for (const PatchGrading::Patch& p : o.grading.patches)
        positive("PatchGrading::Patch::radius_m", p.radius_m);
    if (!(o.grading.ratio >= 0.1 && o.grading.ratio <= 1))
        fail("PatchGrading::ratio = {} must be from 0.1 to 1", o.grading.ratio);
    if (!(o.grading.growth >= 0.05 && o.grading.growth <= 1))
        fail("PatchGrading::growth = {} must be from 0.05 to 1", o.grading.growth);
    if (!(o.min_dihedral_deg >= 0 && o.min_dihedral_deg <= 15))
        fail("--min-dihedral-deg = {} must be from 0 to 15", o.min_dihedral_deg);
}

}  // namespace livetet
