#include "meshing/levels.hpp"

#include <fmt/ranges.h>

#include <chrono>
#include <cmath>

#include "base/error.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {

namespace {

using Clock = std::chrono::steady_clock;

/// tets = c V / h^3 for the edge length h that remeshing is asked for: 5.1 to 5.7 on livers of 60,000 to 1,000 tets. It
/// is less than the 6 sqrt(2) of regular tets since edges inside grow. Only the first guess depends on it.
constexpr double tets_per_cubed_edge = 5.1;

/// A level is coarser than the one before it if it has at most this part of its tets.
constexpr double coarser = 0.75;

/// A level with a tet worse than this (radius ratio) is tried again with slightly other edges: a sharp crease of the
/// remeshed surface, which the filling has to keep, mostly lies otherwise then.
constexpr double poor_radius_ratio = 0.05;
constexpr int shape_tries = 4;
constexpr double other_edges = 0.95;

struct Level {
    TetMesh mesh;
    LevelReport report;
};

/// What stays the same from level to level.
struct Maker {
    const TriangleMesh& surface;
    const MeshingOptions& options;
    const GmshOptions& gmsh;

    /// The best of at most `shape_tries` tries.
    Level make(double edge_length_m) const {
        const auto start = Clock::now();
        Level best = make_once(edge_length_m);
        const auto worst = [](const Level& level) { return level.report.quality.min_radius_ratio; };
        for (int tries = 1; tries < shape_tries && worst(best) < poor_radius_ratio; ++tries) {
            Level other = make_once(edge_length_m * std::pow(other_edges, tries));
            if (worst(other) > worst(best)) best = std::move(other);
        }
        best.report.asked_edge_length_m = edge_length_m;
        best.report.seconds = std::chrono::duration<double>(Clock::now() - start).count();
        return best;
    }

    Level make_once(double edge_length_m) const {
        Level level;
        const TriangleMesh remeshed = remesh_surface(surface, edge_length_m, options.remesh_iterations,
                                                     options.remesh_tries, level.report.remesh);
        level.mesh = fill_surface(remeshed, level.report.remesh.edge_length_m, gmsh);
        level.report.quality = measure_quality(level.mesh);
        level.report.fillings = 1;
        return level;
    }
};

/// The finest level, at the edge length that gives about the number of tets asked for.
Level find_finest(const Maker& maker, std::vector<std::string>& notes, const std::function<void(int)>& tell) {
    const MeshingOptions& o = maker.options;
    const double target = static_cast<double>(o.target_tets);
    const auto miss = [&](const Level& level) {
        return std::abs(std::log(static_cast<double>(level.report.quality.tets) / target));
    };
    double edge_length = std::cbrt(tets_per_cubed_edge * signed_volume(maker.surface) / target);
    Level best;
    double seconds = 0;
    int fillings = 0;
    while (fillings < o.target_tries) {
        tell(fillings);
        Level level = maker.make(edge_length);
        const auto tets = static_cast<double>(level.report.quality.tets);
        ++fillings;
        seconds += level.report.seconds;
        edge_length *= std::cbrt(tets / target);
        if (fillings == 1 || miss(level) < miss(best)) best = std::move(level);
        if (miss(best) <= std::log1p(o.target_tolerance) * 0.95) break;
    }
    best.report.fillings = fillings;
    best.report.seconds = seconds;
    if (miss(best) > std::log1p(o.target_tolerance))
        notes.push_back(fmt::format("meshing.target_tets = {}: the nearest of {} tries has {} tets", o.target_tets,
                                    fillings, best.report.quality.tets));
    return best;
}

std::size_t level_count(const MeshingOptions& o, std::int64_t finest_tets) {
    if (!o.edge_lengths_mm.empty()) return o.edge_lengths_mm.size();
    return static_cast<std::size_t>(o.levels > 0 ? o.levels : automatic_levels(finest_tets, o.coarsening));
}

std::string provenance_of(const MeshingOptions& o, const std::vector<LevelReport>& levels) {
    std::vector<std::string> edges;
    for (const LevelReport& level : levels) edges.push_back(fmt::format("{:.3f}", 1e3 * level.remesh.edge_length_m));
    return fmt::format(
        "levels remeshed from one surface to edges of {} mm, filled by Gmsh (API {}); target_tets {}, "
        "coarsening {}, voxel_mm {}, smoothing_mm {}, optimise_passes {}",
        fmt::join(edges, ", "), gmsh_version(), o.target_tets, o.coarsening, o.voxel_mm, o.smoothing_mm,
        o.optimise_passes);
}

}  // namespace

HierarchyResult build_hierarchy(const TriangleMesh& surface, const MeshingOptions& options,
                                const ProgressCallback& progress, const GmshOptions& gmsh) {
    check_options(options);
    const auto tell = [&](double fraction, const std::string& what) {
        if (progress) progress(fraction, what);
    };
    tell(0, "checking the surface");
    const TriangleMesh repaired = repair_surface(surface);
    GmshOptions own_gmsh = gmsh;
    own_gmsh.time_limit_s = options.gmsh_time_limit_s;
    own_gmsh.optimise_passes = options.optimise_passes;
    const Maker maker{repaired, options, own_gmsh};

    // The finest level takes nearly all of the time, and most tries need two meshes of it.
    HierarchyResult result;
    std::vector<TetMesh> meshes;
    const auto& edges = options.edge_lengths_mm;
    const auto take = [&](Level level) {
        if (const MeshQuality& q = level.report.quality; q.min_radius_ratio < poor_radius_ratio)
            result.notes.push_back(
                fmt::format("level {}: the tet at {} is nearly flat (radius ratio {:.4f}): the surface "
                            "has a sharp crease there, smooth it",
                            meshes.size(), place_mm(q.worst_place), q.min_radius_ratio));
        meshes.push_back(std::move(level.mesh));
        result.levels.push_back(std::move(level.report));
    };
    if (edges.empty()) {
        take(find_finest(maker, result.notes, [&](int done) {
            tell(0.05 + 0.75 * done / (done + 1), fmt::format("level 0, mesh {}", done + 1));
        }));
    } else {
        tell(0.05, "level 0");
        take(maker.make(1e-3 * edges[0]));
    }
    const std::size_t count = level_count(options, result.levels.front().quality.tets);
    for (std::size_t l = 1; l < count; ++l) {
        tell(0.8 + 0.15 * static_cast<double>(l) / static_cast<double>(count), fmt::format("level {}", l));
        const double edge = edges.empty() ? result.levels.front().asked_edge_length_m * std::pow(options.coarsening, l)
                                          : 1e-3 * edges[l];
        Level level = maker.make(edge);
        const auto finer = static_cast<double>(meshes.back().tets.size());
        if (static_cast<double>(level.mesh.tets.size()) > coarser * finer) {
            result.notes.push_back(
                fmt::format("level {} of {:.2f} mm edges has {} tets, not fewer than {:.0f} % of the {} "
                            "before it: left out, and what would be coarser",
                            l, 1e3 * edge, level.mesh.tets.size(), 100 * coarser, finer));
            break;
        }
        take(std::move(level));
    }
    tell(0.95, "transfers between levels");
    result.hierarchy = make_hierarchy(std::move(meshes), provenance_of(options, result.levels));
    tell(1, "meshed");
    return result;
}

}  // namespace livetet
