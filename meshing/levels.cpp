#include "meshing/levels.hpp"

#include <fmt/ranges.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <optional>

#include "base/child_process.hpp"
#include "base/error.hpp"
#include "base/stopwatch.hpp"
#include "mesh/packed_mesh.hpp"
#include "meshing/interfaces.hpp"
#include "meshing/label_volume.hpp"
#include "meshing/locality.hpp"
#include "meshing/mesh_pipe.hpp"
#include "meshing/remesh.hpp"
#include "meshing/shells.hpp"
#include "meshing/surface_check.hpp"
#include "meshing/wrap.hpp"

namespace livetet {

namespace {

using Clock = std::chrono::steady_clock;

/// Constant c of tets = c V / h^3, with h the edge length of remeshing; used for the first guess
/// only. Less than the 6 sqrt(2) of regular tets, as edges grow towards the inside.
constexpr double tets_per_cubed_edge = 4.98;
/// The same for tets made from labels.
constexpr double tets_per_cubed_edge_of_labels = 5.6;

/// A coarser level must have at most this fraction of the tets of the one before it.
constexpr double coarser = 0.75;

/// A bad level is tried again with slightly different edge lengths. Sharp creases of the remeshed
/// surface, which the filling must keep, then mostly move.
constexpr int shape_tries = 4;
constexpr double other_edges = 0.93;

/// If labels are available, a level's surface is abandoned after this many attempts or seconds.
constexpr int surface_tries = 2;
constexpr double surface_time_limit_s = 20;
constexpr int remesh_tries_with_labels = 3;
constexpr int volume_steps = 4;

/// The optimiser's target exceeds the smallest accepted angle by this.
constexpr double aim_over_bound_deg = 5;

/// Relative error of the finest level's volume, and the error of a coarser one that is worth a
/// note.
constexpr double volume_limit = 0.01, volume_worth_a_note = 0.1;

/// Smallest shell that a level represents: cube root of its volume, in edge lengths.
constexpr double smallest_shell = 0.8;

/// Growth of the edge length with the distance from a refined place.
constexpr double gradation = 0.3;

struct Level {
    TetMesh mesh;
    LevelReport report;
};

TriangleMesh boundary_surface(const TetMesh& mesh) {
    return joined(parts_of({mesh.nodes, boundary_triangles(mesh.tets)}));
}

double size_of(const TriangleMesh& shell) { return std::cbrt(std::abs(signed_volume(shell))); }

/// The shells that edges of this length can represent. The largest one always.
TriangleMesh without_small_shells(const TriangleMesh& surface, double edge_length_m) {
    std::vector<BodyPiece> pieces = pieces_of(surface);
    for (BodyPiece& piece : pieces)
        std::erase_if(piece.cavities, [&](const TriangleMesh& cavity) {
            return size_of(cavity) < smallest_shell * edge_length_m;
        });
    for (std::size_t p = pieces.size(); p-- > 1;)
        if (size_of(pieces[p].outer) < smallest_shell * edge_length_m)
            pieces.erase(pieces.begin() + static_cast<std::ptrdiff_t>(p));
    return joined(pieces);
}

/// `remesh_surface` in a child process: CGAL's removal of self-intersections may not terminate.
/// Reduces `seconds_left` by the time taken.
TriangleMesh remesh_in_child(const TriangleMesh& from, double& edge_length_m, int iterations,
                             int tries, const EdgeLengthField& shorter_at, double& seconds_left) {
    const ChildResult child = run_in_child(
        [&](int out) {
            const TriangleMesh surface =
                remesh_surface(from, edge_length_m, iterations, tries, shorter_at);
            TetMesh carrier;  // a surface is sent as a mesh without tets
            carrier.nodes = surface.nodes;
            carrier.triangle_sets["surface"] = surface.triangles;
            return write_all(out, &edge_length_m, sizeof edge_length_m) && write_mesh(out, carrier)
                       ? 0
                       : 1;
        },
        seconds_left);
    if (child.end == ChildResult::End::failed) {
        const std::string words = last_error_lines(child.log),
                          mark = "Error   : ";  // as `run_in_child` reports an exception
        fail("{}", words.starts_with(mark) ? words.substr(mark.size()) : words);
    }
    if (child.end != ChildResult::End::returned || child.result.size() < sizeof edge_length_m)
        fail("surface: remeshing it from {} to edges of {:.2f} mm {}", box_mm(from.nodes),
             1e3 * edge_length_m, describe_end(child, seconds_left));
    seconds_left -= child.seconds;
    std::memcpy(&edge_length_m, child.result.data(), sizeof edge_length_m);
    TetMesh carrier = unpacked_mesh(std::span(child.result).subspan(sizeof edge_length_m),
                                    "the remeshed surface");
    return {std::move(carrier.nodes), std::move(carrier.triangle_sets.at("surface"))};
}

/// The inputs common to all levels.
struct Maker {
    const TriangleMesh& surface;
    const MeshingOptions& options;
    const GmshOptions& gmsh;
    const Materials& materials;
    NearestTriangle body{surface.nodes, surface.triangles};
    ShellCount shells = count_shells(pieces_of(surface));
    double body_volume = materials.volume_m3.value_or(signed_volume(surface));
    /// The finest level's surface; coarser levels are remeshed from it, which is faster.
    TriangleMesh finest{};
    std::optional<NearestTriangle> finer_at{};
    mutable std::optional<LabelField> labels{};

    const LabelField& field() const {
        if (!labels) labels = materials.field();
        return *labels;
    }

    /// The first of at most `shape_tries` attempts that is good enough. `scale`: ratio of the edge
    /// length to that of the finest level.
    Level make(double edge_length_m, double scale) const {
        const auto start = Clock::now();
        std::vector<std::string> dropped;
        TriangleMesh tried = surface;
        const auto passed = [&] { return seconds_since(start); };
        int tries_of_labels = 0;
        for (int tries = 0;
             tries < shape_tries && (tries == 0 || passed() < options.gmsh_time_limit_s); ++tries) {
            const bool from_labels =
                materials.several ||
                (materials.field && (tries >= surface_tries || passed() > surface_time_limit_s));
            const double edge =
                edge_length_m * std::pow(other_edges, from_labels ? tries_of_labels++ : tries);
            const double time_left = options.gmsh_time_limit_s - passed();
            try {
                Level level = from_labels ? make_from_labels(edge, scale, time_left, tried)
                                          : make_from_surface(edge, scale, time_left, tried);
                level.report.dropped = std::move(dropped);
                level.report.fillings = tries + 1;
                level.report.requested_edge_length_m = edge_length_m;
                level.report.seconds = passed();
                return level;
            } catch (const Error& error) {
                dropped.push_back(fmt::format("edges of {:.2f} mm: {}", 1e3 * edge, error.what()));
            }
        }
        throw MeshingFailure(fmt::format("no mesh in {} tries; {}", dropped.size(), dropped.back()),
                             std::move(tried));
    }

    /// The edge length as a function of position on the surface; empty if it is uniform.
    EdgeLengthField on_surface(double edge_length_m, double scale) const {
        if (options.finer.empty() && !finer_at && options.grading.patches.empty()) return {};
        return [=, this](const Vector3& x) {
            double length = edge_length_m;
            if (finer_at)
                length = std::min(length, options.finer_at_ratio * edge_length_m +
                                              gradation * finer_at->find(x).distance);
            for (const FineSphere& s : options.finer)
                length = std::min(
                    length, scale * s.edge_length_m +
                                gradation * std::max((x - s.centre).norm() - s.radius_m, 0.0));
            for (const PatchGrading::Patch& p : options.grading.patches)
                length = near_patch(p, x, edge_length_m, length);
            return length;
        };
    }

    /// The smaller of `length` and the edge length that a patch asks for at x. The distance from
    /// the patch is that of the sphere and that of the surface, as if they met at a right angle;
    /// the search for the surface is left out where the first suffices.
    double near_patch(const PatchGrading::Patch& patch, const Vector3& x, double edge_length_m,
                      double length) const {
        const auto& [patches, ratio, growth] = options.grading;
        const double aside = std::max((x - patch.centre).norm() - patch.radius_m, 0.0);
        if (ratio * edge_length_m + growth * aside >= length) return length;
        const double distance = std::hypot(aside, body.find(x).distance);
        return std::min(length, ratio * edge_length_m + growth * distance);
    }

    /// Throws Error, with the position, if the level is not good enough. `tried` receives its
    /// surface.
    Level make_from_surface(double edge_length_m, double scale, double time_limit_s,
                            TriangleMesh& tried) const {
        Level level;
        LevelReport& report = level.report;
        const TriangleMesh from =
            finest.nodes.empty() ? surface : without_small_shells(finest, edge_length_m);
        const EdgeLengthField shorter_at = on_surface(edge_length_m, scale);
        tried = from;
        const int tries =
            std::min(options.remesh_tries, materials.field ? remesh_tries_with_labels : 1 << 30);
        double edge = edge_length_m;
        tried =
            remesh_in_child(from, edge, options.remesh_iterations, tries, shorter_at, time_limit_s);
        report.edge_length_m = edge;
        GmshOptions filling = gmsh;
        filling.time_limit_s = time_limit_s;
        filling.optimise_passes = options.optimise_passes;
        std::optional<NearestTriangle> tree;
        if (options.inside_growth || shorter_at) {
            tree.emplace(tried.nodes, tried.triangles);
            filling.edge_length_at = [&](const Vector3& x) {
                if (const double near = shorter_at ? shorter_at(x) : edge; near < edge) return near;
                return std::min(edge + gradation * tree->find(x).distance,
                                edge * options.inside_growth.value_or(default_inside_growth));
            };
        }
        level.mesh = fill_surface(tried, edge, filling, &report.filled_by);
        if (options.min_dihedral_deg > 0) {
            TetMesh filled = level.mesh;
            report.optimise = raise_dihedral_angles(level.mesh, body,
                                                    options.min_dihedral_deg + aim_over_bound_deg);
            // In very thin plates better angles cost volume: keep the mesh that was good enough.
            if (std::abs(volume(level.mesh) / volume(filled) - 1) > volume_limit / 2 &&
                measure_quality(filled).min_dihedral_deg >= options.min_dihedral_deg) {
                level.mesh = std::move(filled);
                report.optimise = {};
            }
        }
        finish(level, scale, tried);
        return level;
    }

    /// The same from the labels; tets share the interfaces.
    Level make_from_labels(double edge_length_m, double scale, double time_limit_s,
                           TriangleMesh& tried) const {
        Level level;
        LevelReport& report = level.report;
        const double bound = options.min_dihedral_deg, aim = bound + aim_over_bound_deg;
        LabelVolumeOptions filling;
        filling.time_limit_s = time_limit_s;
        filling.min_dihedral_deg = aim;
        filling.shorter_at = on_surface(edge_length_m, scale);
        if (options.inside_growth) filling.inside_growth = *options.inside_growth;
        level.mesh = fill_labels(field(), edge_length_m, filling);
        report.edge_length_m = edge_length_m;
        report.filled_by = "CGAL from the labels";
        const auto improve = [&] {
            if (bound == 0) return;
            const OptimiseReport more = raise_dihedral_angles(level.mesh, aim);
            report.optimise.moves += more.moves;
            report.optimise.flips += more.flips;
            report.optimise.collapses += more.collapses;
            report.optimise.peeled_tets += more.peeled_tets;
        };
        improve();
        std::map<std::int32_t, double> wanted;
        for (const LabelField::Material& m : field().materials()) wanted[m.label] = m.voxels_m3;
        keep_region_volumes(level.mesh, wanted, bound + 1, volume_steps);
        improve();
        finish(level, scale, tried);
        return level;
    }

    /// Measures the level and throws Error if it is not good enough. `tried` receives its surface.
    void finish(Level& level, double scale, TriangleMesh& tried) const {
        LevelReport& report = level.report;
        check_tet_mesh(level.mesh, "the level");
        report.quality = measure_quality(level.mesh);
        tried = boundary_surface(level.mesh);
        if (const auto& worst = report.quality.worst.front();
            worst.min_dihedral_deg < options.min_dihedral_deg)
            fail("the tet at {} has a dihedral angle of {:.2f} degrees, expected {:.1f} at least",
                 place_mm(worst.place), worst.min_dihedral_deg, options.min_dihedral_deg);
        if (const SelfIntersections cuts = find_self_intersections(tried); cuts.pairs > 0)
            fail("the boundary cuts itself at {}", place_mm(cuts.place));
        report.shells = count_shells(pieces_of(tried));
        if (scale == 1 && !(report.shells == shells))
            fail("it has {} of the body's {} parts and {} of its {} cavities", report.shells.pieces,
                 shells.pieces, report.shells.cavities, shells.cavities);
        report.volume_ratio = report.quality.volume_m3 / body_volume;
        report.distance = hausdorff_distance(tried, surface, body);
        if (scale == 1 && !(std::abs(report.volume_ratio - 1) <= volume_limit))
            fail(
                "it holds {:.4g} ml of the body's {:.4g} ml, expected within 1 %; farthest from "
                "it, by {:.2f} mm, at {}",
                1e6 * report.quality.volume_m3, 1e6 * body_volume,
                1e3 * report.distance.from_body.max_m,
                place_mm(report.distance.from_body.farthest));
        sort_for_locality(level.mesh);
    }
};

/// The finest level, with the edge length that gives about the requested number of tets.
Level find_finest(const Maker& maker, std::vector<std::string>& notes,
                  const std::function<void(int)>& report_progress) {
    const MeshingOptions& o = maker.options;
    const double target = static_cast<double>(o.target_tets);
    const auto miss = [&](const Level& level) {
        return std::abs(std::log(static_cast<double>(level.report.quality.tets) / target));
    };
    const double density =
        maker.materials.several ? tets_per_cubed_edge_of_labels : tets_per_cubed_edge;
    double edge_length = std::cbrt(density * maker.body_volume / target);
    Level best;
    double seconds = 0;
    int fillings = 0;
    std::vector<std::string> dropped;
    for (int mesh = 0; mesh < o.target_tries; ++mesh) {
        report_progress(mesh);
        Level level;
        try {
            level = maker.make(edge_length, 1);
        } catch (const MeshingFailure& failure) {
            if (mesh == 0) throw;
            notes.push_back(fmt::format("level 0, mesh {}: {}", mesh + 1, failure.what()));
            break;
        }
        const auto tets = static_cast<double>(level.report.quality.tets);
        fillings += level.report.fillings;
        seconds += level.report.seconds;
        dropped.insert(dropped.end(), level.report.dropped.begin(), level.report.dropped.end());
        edge_length *= std::cbrt(tets / target);
        if (mesh == 0 || miss(level) < miss(best)) best = std::move(level);
        if (miss(best) <= std::log1p(o.target_tolerance) * 0.95) break;
    }
    best.report.fillings = fillings;
    best.report.seconds = seconds;
    best.report.dropped = std::move(dropped);
    if (miss(best) > std::log1p(o.target_tolerance))
        notes.push_back(fmt::format("level 0: of the meshes tried the nearest to {} tets has {}",
                                    o.target_tets, best.report.quality.tets));
    return best;
}

std::size_t level_count(const MeshingOptions& o, std::int64_t finest_tets) {
    if (!o.edge_lengths_mm.empty()) return o.edge_lengths_mm.size();
    return static_cast<std::size_t>(o.levels > 0 ? o.levels
                                                 : automatic_levels(finest_tets, o.coarsening));
}

std::string provenance_of(const MeshingOptions& o, const HierarchyResult& result) {
    std::vector<std::string> edges;
    for (const LevelReport& level : result.levels)
        edges.push_back(fmt::format("{:.3f}", 1e3 * level.edge_length_m));
    const std::string way =
        result.materials.empty()
            ? fmt::format("remeshed from one surface to edges of {} mm, filled by Gmsh (API {})",
                          fmt::join(edges, ", "), gmsh_version())
            : fmt::format("made from {} labels with edges of {} mm by CGAL {}",
                          result.materials.size(), fmt::join(edges, ", "), cgal_version());
    std::string text = fmt::format(
        "levels {}; target_tets {}, coarsening {}, optimise_passes {}, min_dihedral_deg {}", way,
        o.target_tets, o.coarsening, o.optimise_passes, o.min_dihedral_deg);
    if (o.inside_growth) text += fmt::format(", inside_growth {}", *o.inside_growth);
    for (const FineSphere& s : o.finer)
        text += fmt::format(", edges of {:.3f} mm within {:.3f} mm of {}", 1e3 * s.edge_length_m,
                            1e3 * s.radius_m, place_mm(s.centre));
    if (!o.finer_at.triangles.empty())
        text += fmt::format(", edges at the mask's border times {}", o.finer_at_ratio);
    for (const PatchGrading::Patch& p : o.grading.patches)
        text += fmt::format(
            ", edges times {} on the surface within {:.3f} mm of {}, growing by {} of the distance",
            o.grading.ratio, 1e3 * p.radius_m, place_mm(p.centre), o.grading.growth);
    return text;
}

TriangleMesh noted_wrap(const TriangleMesh& surface, double gap_m,
                        std::vector<std::string>& notes) {
    check_topology(surface);
    WrappedSurface wrap = wrap_surface(surface, gap_m);
    notes.push_back(fmt::format(
        "surface: wrapped, gaps of {:.3g} mm closed: the wrap is {:.3g} mm from the surface in the "
        "mean and {:.3g} mm at most, the surface {:.3g} mm at most from the wrap, at {}",
        1e3 * gap_m, 1e3 * wrap.distance.to_body.mean_m, 1e3 * wrap.distance.to_body.max_m,
        1e3 * wrap.distance.from_body.max_m, place_mm(wrap.distance.from_body.farthest)));
    return std::move(wrap.surface);
}

/// Materials without tets in the finest level.
void note_missing(HierarchyResult& result, const TetMesh& finest) {
    const auto volumes = region_volumes(finest);
    for (const LabelField::Material& m : result.materials)
        if (!volumes.contains(m.label))
            result.notes.push_back(fmt::format(
                "label {}: its {:.3g} ml are too small or thin for level 0: its place is "
                "its neighbours'",
                m.label, 1e6 * m.voxels_m3));
}

/// Notes what a level is not as it was asked for. `number`: of the level.
void note_level(HierarchyResult& result, const Level& level, std::size_t number,
                const Maker& maker) {
    std::vector<std::string>& notes = result.notes;
    for (const std::string& line : level.report.dropped)
        notes.push_back(fmt::format("level {}: not taken: {}", number, line));
    if (level.report.filled_by.find('(') != std::string::npos)
        notes.push_back(fmt::format("level {}: filled by {}", number, level.report.filled_by));
    if (!maker.materials.several && !level.mesh.regions.empty())
        notes.push_back(fmt::format("level {}: made by {}, not from their surface", number,
                                    level.report.filled_by));
    if (!(std::abs(level.report.volume_ratio - 1) <= volume_worth_a_note))
        notes.push_back(fmt::format("level {}: holds {:.0f} % of the body's volume", number,
                                    100 * level.report.volume_ratio));
    if (!(level.report.shells == maker.shells))
        notes.push_back(fmt::format(
            "level {}: has {} of the body's {} parts and {} of its {} cavities: the others are "
            "too small for its edges",
            number, level.report.shells.pieces, maker.shells.pieces, level.report.shells.cavities,
            maker.shells.cavities));
}

}  // namespace

HierarchyResult build_hierarchy(const TriangleMesh& surface, const MeshingOptions& options,
                                const ProgressCallback& progress, const GmshOptions& gmsh,
                                const Materials& materials) {
    check_options(options);
    const auto report_progress = [&](double fraction, const std::string& what) {
        if (progress) progress(fraction, what);
    };
    report_progress(0, "checking the surface");
    HierarchyResult result;
    const TriangleMesh repaired = repair_surface(
        options.wrap_mm ? noted_wrap(surface, 1e-3 * *options.wrap_mm, result.notes) : surface,
        options.body, &result.notes);
    if (options.check_surface) options.check_surface(repaired);
    Maker maker{repaired, options, gmsh, materials};
    if (!options.finer_at.triangles.empty() && options.finer_at_ratio < 1)
        maker.finer_at.emplace(options.finer_at.nodes, options.finer_at.triangles);

    // The finest level takes most of the time and usually needs two meshes.
    if (materials.several) {
        report_progress(0.02, "smoothing the labels");
        result.materials = maker.field().materials();
    }
    std::vector<TetMesh> meshes;
    const auto& edges = options.edge_lengths_mm;
    const auto take = [&](Level level) {
        note_level(result, level, meshes.size(), maker);
        name_shells(level.mesh);
        meshes.push_back(std::move(level.mesh));
        result.levels.push_back(std::move(level.report));
    };
    if (edges.empty()) {
        take(find_finest(maker, result.notes, [&](int done) {
            report_progress(0.05 + 0.75 * done / (done + 1),
                            fmt::format("level 0, mesh {}", done + 1));
        }));
    } else {
        report_progress(0.05, "level 0");
        take(maker.make(1e-3 * edges[0], 1));
    }
    maker.finest = boundary_surface(meshes.front());
    note_missing(result, meshes.front());
    const std::size_t count = level_count(options, result.levels.front().quality.tets);
    for (std::size_t l = 1; l < count; ++l) {
        report_progress(0.8 + 0.15 * static_cast<double>(l) / static_cast<double>(count),
                        fmt::format("level {}", l));
        const double edge = edges.empty() ? result.levels.front().requested_edge_length_m *
                                                std::pow(options.coarsening, l)
                                          : 1e-3 * edges[l];
        Level level;
        try {
            level = maker.make(edge, std::pow(options.coarsening, l));
        } catch (const MeshingFailure& failure) {
            result.notes.push_back(
                fmt::format("level {} of {:.2f} mm edges: left out, and what would be coarser: {}",
                            l, 1e3 * edge, failure.what()));
            break;
        }
        const auto finer = static_cast<double>(meshes.back().tets.size());
        if (static_cast<double>(level.mesh.tets.size()) > coarser * finer) {
            result.notes.push_back(fmt::format(
                "level {} of {:.2f} mm edges has {} tets, not fewer than {:.0f} % of the {} "
                "before it: left out, and what would be coarser",
                l, 1e3 * edge, level.mesh.tets.size(), 100 * coarser, finer));
            break;
        }
        take(std::move(level));
    }
    report_progress(0.95, "transfers between levels");
    result.hierarchy = make_hierarchy(std::move(meshes), provenance_of(options, result));
    report_progress(1, "meshed");
    return result;
}

std::string level_table(std::span<const LevelReport> levels, std::size_t first) {
    std::string text =
        fmt::format("{:>5} {:>8} {:>9} {:>24} {:>24} {:>33} {:>9} {:>6}\n", "level", "edges/mm",
                    "volume/%", "to the surface mean/max/mm", "from it mean/max/mm",
                    "moves/flips/collapses/peeled", "fillings", "s");
    for (std::size_t l = 0; l < levels.size(); ++l) {
        const LevelReport& r = levels[l];
        const OptimiseReport& o = r.optimise;
        text += fmt::format(
            "{:>5} {:>8.3g} {:>9.2f} {:>15.3g} / {:>8.3g} {:>13.3g} / {:>8.3g} {:>9} / {:>5} / "
            "{:>5} / {:>5} {:>9} "
            "{:>6.1f}\n",
            first + l, 1e3 * r.edge_length_m, 100 * (r.volume_ratio - 1),
            1e3 * r.distance.to_body.mean_m, 1e3 * r.distance.to_body.max_m,
            1e3 * r.distance.from_body.mean_m, 1e3 * r.distance.from_body.max_m, o.moves, o.flips,
            o.collapses, o.peeled_tets, r.fillings, r.seconds);
    }
    return text;
}

}  // namespace livetet
