#include "apps/scene/cuts.hpp"

#include <fmt/ranges.h>

#include <Eigen/Dense>

#include <algorithm>

#include "apps/scene/mesh_source.hpp"
#include "apps/scene/node_selection.hpp"
#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/log.hpp"
#include "config/yaml.hpp"
#include "geometry/bounding_box.hpp"
#include "mesh/cut_hierarchy.hpp"
#include "mesh/grid_border.hpp"
#include "mesh/hex_cut.hpp"
#include "mesh/mesh_pieces.hpp"

namespace livetet {

namespace {

/// Beside the bits of prescribed components: pulled by a spring.
constexpr std::uint8_t all_components = 7, has_spring = 8;

/// For each node what fix and drive hold of it.
std::vector<std::uint8_t> held_components(const Scene& scene, const TetMesh& mesh) {
    std::vector<std::uint8_t> held(mesh.nodes.size(), 0);
    const auto add = [&](const auto& list, const char* name) {
        for (std::size_t i = 0; i < list.size(); ++i) {
            std::uint8_t bits = 0;
            for (const char c : list[i].components) bits |= 1 << (c - 'x');
            if (list[i].stiffness_N_per_m) bits = has_spring;
            for (const std::int32_t n : select_nodes(mesh, list[i], fmt::format("{}[{}]", name, i)))
                held[n] |= bits;
        }
    };
    add(scene.fix, "fix");
    add(scene.drive, "drive");
    return held;
}

template <class Rule>
bool any_node(const MeshPiece& piece, const TetMesh& mesh, const Rule& rule) {
    return std::ranges::any_of(piece.cells, [&](std::int32_t e) {
        return std::ranges::any_of(corners_of_cell(mesh, static_cast<std::size_t>(e)), rule);
    });
}

/// Throws Error if pieces are left out and a selection lists nodes, which are then numbered anew.
void refuse_listed_nodes(const Scene& scene) {
    if (scene.free_pieces != FreePieces::leave_out) return;
    const auto check = [](const auto& list, const char* name) {
        for (std::size_t i = 0; i < list.size(); ++i)
            if (list[i].nodes)
                fail(
                    "{}[{}].nodes: found with free_pieces: leave_out, which numbers nodes anew, "
                    "expected a selection by place, mask or group",
                    name, i);
    };
    check(scene.fix, "fix");
    check(scene.drive, "drive");
    check(scene.loads, "loads");
}

/// Warns of loads that act on pieces that are left out, too: what is left takes all of a force.
/// Throws Error if nothing is left of what one acts on.
void check_loads_left_out(const Scene& scene, const TetMesh& mesh,
                          const std::vector<MeshPiece>& left_out) {
    const std::vector<std::int32_t> lost_nodes = nodes_of_pieces(left_out, mesh);
    for (std::size_t i = 0; i < scene.loads.size(); ++i) {
        const std::string key = fmt::format("loads[{}]", i);
        const auto nodes = select_nodes(mesh, scene.loads[i], key);
        const auto lost = std::ranges::count_if(
            nodes, [&](std::int32_t n) { return std::ranges::binary_search(lost_nodes, n); });
        if (lost == 0) continue;
        const std::string all = counted(nodes.size(), "node");
        if (static_cast<std::size_t>(lost) == nodes.size())
            fail(
                "{}: found all of its {} on pieces that are left out, expected a load on what is "
                "held, or free_pieces: keep in a dynamic scene",
                key, all);
        log_warning(fmt::format(
            "cuts: {} of the {} of {} are on pieces that are left out{}", lost, all, key,
            scene.loads[i].force_N.isZero() ? "" : "; its force acts as a whole on the others"));
    }
}

/// The pieces of which no node is held.
std::vector<MeshPiece> free_pieces(const TetMesh& mesh, const std::vector<std::uint8_t>& held) {
    std::vector<MeshPiece> pieces = mesh_pieces(mesh);
    std::erase_if(pieces, [&](const MeshPiece& piece) {
        return any_node(piece, mesh, [&](std::int32_t n) { return held[n] != 0; });
    });
    return pieces;
}

std::string place_text(const Vector3& x) {
    return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", 1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z());
}

CutSurface surface_of(const CutOptions& cut) {
    if (!cut.file.empty()) {
#ifdef LIVETET_IMAGES
        return read_surface(cut.file, cut.space);
#else
        fail("cuts: this build of livetet reads no surfaces, found {}, expected planes",
             cut.file.string());
#endif
    }
    PlanePatch patch;
    patch.point = *cut.point_mm / 1e3;
    if (cut.edges_mm) {
        const auto& e = *cut.edges_mm;
        patch.edges = {Vector3(e[0], e[1], e[2]) / 1e3, Vector3(e[3], e[4], e[5]) / 1e3};
        patch.normal = (*patch.edges)[0].cross((*patch.edges)[1]);
    } else {
        patch.normal = *cut.normal / cut.normal->lpNorm<Eigen::Infinity>();
    }
    if (cut.radius_mm) patch.radius = *cut.radius_mm / 1e3;
    return patch;
}

/// "which spans (0.0, 0.0, 0.0) mm to (9.0, 9.0, 9.0) mm".
std::string extent_text(const TetMesh& mesh) {
    const Eigen::AlignedBox3d box = box_of(mesh.nodes);
    return fmt::format("which spans {} to {}", place_text(box.min()), place_text(box.max()));
}

/// For a cut that parts nothing.
std::string expected_text(const CutSurface& surface, const TetMesh& mesh) {
    const Eigen::AlignedBox3d box = box_of(mesh.nodes);
    bool is_near = false;
    if (const auto* patch = std::get_if<PlanePatch>(&surface)) {
        is_near = (patch->radius || patch->edges) && box.contains(patch->point);
    } else {
        is_near = std::ranges::any_of(std::get<TriangleMesh>(surface).nodes,
                                      [&](const Vector3& x) { return box.contains(x); });
    }
    return fmt::format("expected {} the body, {}",
                       is_near ? "more than a cell's width of it within" : "a cut through",
                       extent_text(mesh));
}

/// "2.0 x 2.0 x 2.5 mm".
std::string cell_text(const GridFrame& frame) {
    const Eigen::RowVector3d edge = 1e3 * frame.axes.colwise().norm();
    return fmt::format("{:.3g} x {:.3g} x {:.3g} mm", edge[0], edge[1], edge[2]);
}

std::string key_of(std::size_t cut) { return fmt::format("cuts[{}]", cut); }

/// A hierarchy's levels with the scene's cuts, and a text on how much was cut.
struct CutLevels {
    std::vector<TetMesh> levels;
    std::string text;
};

CutLevels cut_grid(const Scene& scene, const TetMesh& mesh) {
    const HexLevel level = hex_level_of(mesh, scene.mesh.file.string());
    const GridFrame frame = grid_frame(mesh, level);
    std::vector<std::uint8_t> cut(level.links.size(), 0);
    for (std::size_t i = 0; i < scene.cuts.size(); ++i) {
        const CutSurface surface = surface_of(scene.cuts[i]);
        const auto crossed = crossed_links(level, frame, surface, key_of(i));
        if (std::ranges::count(crossed, 1) == 0)
            fail("{}: crosses no pair of neighbouring cells, {} in cells of {}", key_of(i),
                 expected_text(surface, mesh), cell_text(frame));
        for (std::size_t l = 0; l < cut.size(); ++l) cut[l] |= crossed[l];
    }
    TetMesh made = without_links(mesh, level, cut);
    const std::size_t doubled = made.nodes.size() - mesh.nodes.size();
    if (doubled == 0)
        fail(
            "cuts: separate only {} of neighbouring cells, too few to open a gap, expected larger "
            "cuts of the body, {} in cells of {}",
            counted(static_cast<std::size_t>(std::ranges::count(cut, 1)), "pair"),
            extent_text(mesh), cell_text(frame));
    return {{std::move(made)}, counted(doubled, "node") + " doubled"};
}

bool is_same(const CutOptions& a, const CutOptions& b) {
    return a.point_mm == b.point_mm && a.normal == b.normal && a.radius_mm == b.radius_mm &&
           a.edges_mm == b.edges_mm && a.file == b.file && a.space == b.space;
}

/// A cut that is listed again cuts nothing: nodes that moved onto it once are not to move further.
CutLevels cut_tet_levels(const Scene& scene, std::vector<TetMesh> levels) {
    CutCounts all;
    const std::string extent = extent_text(levels.front());
    for (std::size_t i = 0; i < scene.cuts.size(); ++i) {
        const auto listed_before = std::span(scene.cuts).first(i);
        if (std::ranges::any_of(listed_before,
                                [&](const CutOptions& c) { return is_same(c, scene.cuts[i]); }))
            continue;
        const CutSurface surface = surface_of(scene.cuts[i]);
        const CutCounts counts = cut_levels(levels, surface, key_of(i));
        if (counts.parted == 0)
            fail("{}: parts no tetrahedron, {}", key_of(i), expected_text(surface, levels.front()));
        all.parted += counts.parted;
        all.added += counts.added;
        all.doubled += counts.doubled;
    }
    if (all.doubled == 0)
        fail(
            "cuts: part {}, but open no gap: they are too small, or lie along the body's surface; "
            "expected larger cuts through the body, {}",
            all.parted == 1 ? "1 tetrahedron" : fmt::format("{} tetrahedra", all.parted), extent);
    return {std::move(levels),
            fmt::format("{} doubled, {} new ones", counted(all.doubled, "node"), all.added)};
}

/// How much of a mesh was cut.
void log_cut(const std::string& text, const TetMesh& after) {
    const std::size_t pieces = mesh_pieces(after).size();
    log_info(fmt::format("note         cuts: {}; {}", text,
                         pieces == 1 ? "the body still hangs together"
                                     : fmt::format("the body is in {} pieces", pieces)));
}

bool is_anything_held(const std::vector<std::uint8_t>& held) {
    return std::ranges::any_of(held, [](std::uint8_t bits) { return bits != 0; });
}

/// Throws Error unless a piece is held and can deform.
void check_something_is_left(const TetMesh& mesh, const std::vector<std::uint8_t>& held) {
    const auto pieces = mesh_pieces(mesh);
    const bool any = std::ranges::any_of(pieces, [&](const MeshPiece& piece) {
        return any_node(piece, mesh, [&](std::int32_t n) { return held[n] != 0; }) &&
               any_node(piece, mesh, [&](std::int32_t n) {
                   return (held[n] & all_components) != all_components;
               });
    });
    if (!any)
        fail(
            "cuts: free the whole body: of its {} none is both held by fix or drive and able to "
            "deform, expected cuts that leave such a piece",
            counted(pieces.size(), "piece"));
}

}  // namespace

std::string pieces_text(const std::vector<MeshPiece>& pieces) {
    constexpr std::size_t most = 4;
    std::string text = counted(pieces.size(), "piece") + " that neither fix nor drive holds: ";
    for (std::size_t i = 0; i < std::min(pieces.size(), most); ++i)
        text += fmt::format("{}{:.4g} ml at {}", i ? ", " : "", 1e6 * pieces[i].volume,
                            place_text(pieces[i].centroid));
    if (pieces.size() > most) {
        double rest = 0;
        for (std::size_t i = most; i < pieces.size(); ++i) rest += 1e6 * pieces[i].volume;
        text += fmt::format(" and {} more of {:.4g} ml together", pieces.size() - most, rest);
    }
    return text;
}

void refuse_blade_in_mixed_form() {
    fail(
        "elements = P2: found with a blade (track.tools: blade_mm, or track.cut_by_hand_mm) in the "
        "mixed form, expected P1, or formulation: displacement");
}

void check_can_be_cut(const Scene& scene) {
    const bool has_blade = scene.track && has_blades(*scene.track);
    if (has_blade || !scene.cuts.empty()) refuse_listed_nodes(scene);
    if (has_blade && scene.elements == Elements::p2 && scene.formulation == Formulation::mixed)
        refuse_blade_in_mixed_form();
}

namespace {

/// Names the surface for selections. New nodes, of finer meshes and of order two, follow its
/// triangles.
void note_surface(TetMesh& mesh) {
    if (mesh.node_sets.contains(surface_before_cuts)) return;  // it was cut before
    mesh.node_sets[surface_before_cuts] = selectable_surface(mesh);
    mesh.triangle_sets[surface_before_cuts] = body_surface(mesh);
}

/// The levels without free pieces of the finest one.
std::vector<TetMesh> without_pieces(std::vector<TetMesh> levels,
                                    const std::vector<MeshPiece>& free) {
    std::vector<std::uint8_t> left_out(cell_count(levels.front()), 0);
    for (const MeshPiece& piece : free)
        for (const std::int32_t e : piece.cells) left_out[e] = 1;
    if (levels.front().hexahedra.empty()) return without_tets(std::move(levels), left_out);
    return {without_cells(levels.front(), left_out)};
}

/// Throws Error if a material is of a region that the mesh has nowhere: after the cuts, one that is
/// gone went with a piece that is left out.
void check_regions(const Scene& scene, const TetMesh& mesh) {
    for (std::size_t i = 0; i < scene.materials.size(); ++i)
        if (const int region = scene.materials[i].region;
            region != 0 && std::ranges::find(mesh.regions, region) == mesh.regions.end())
            fail("materials[{}].region = {}: the mesh has no cell of that region", i, region);
}

}  // namespace

MeshHierarchy with_cuts(const Scene& scene, MeshHierarchy hierarchy) {
    check_regions(scene, hierarchy.levels.front());
    const std::string provenance =
        fmt::format("{}; {}", hierarchy.provenance, counted(scene.cuts.size(), "cut"));
    const bool is_grid = !hierarchy.levels.front().hexahedra.empty();
    if (!hierarchy.levels.front().quadratic_hexahedra.empty())
        fail("cuts: found hexahedra that are no grid, expected tetrahedra or a grid");
    note_surface(hierarchy.levels.front());
    CutLevels cut = is_grid ? cut_grid(scene, hierarchy.levels.front())
                            : cut_tet_levels(scene, std::move(hierarchy.levels));
    const TetMesh& mesh = cut.levels.front();
    const std::vector<std::uint8_t> held = held_components(scene, mesh);
    const bool is_held = is_anything_held(held);  // else cuts free nothing
    const std::vector<MeshPiece> free =
        is_held ? free_pieces(mesh, held) : std::vector<MeshPiece>{};
    const bool may_move = scene.time.is_dynamic() && scene.free_pieces == FreePieces::keep;
    if (!may_move && is_held) check_something_is_left(mesh, held);
    if (!free.empty() && scene.free_pieces == FreePieces::refuse)
        fail("cuts: free {}; expected fix or drive to hold them, or free_pieces: leave_out or keep",
             pieces_text(free));
    if (is_held || scene.time.is_dynamic())  // else the body is refused for that
        log_cut(cut.text, mesh);
    if (!free.empty()) {
        const bool leaves_out = scene.free_pieces == FreePieces::leave_out;
        log_info(fmt::format("note         cuts: free {}; {}", pieces_text(free),
                             leaves_out ? "left out"
                             : may_move ? "they move freely"
                                        : "they keep their place at rest"));
        if (leaves_out) {
            check_loads_left_out(scene, mesh, free);
            const std::size_t levels = cut.levels.size();
            cut.levels = without_pieces(std::move(cut.levels), free);
            if (!is_grid && cut.levels.size() < levels)
                log_info(fmt::format("note         cuts: {} left out, too fine for what is left",
                                     counted(levels - cut.levels.size(), "coarse level")));
        }
    }
    return is_grid ? make_hierarchy(std::move(cut.levels), provenance)
                   : with_cut_transfers(std::move(cut.levels), provenance);
}

std::vector<std::int32_t> resting_nodes(const Scene& scene, const TetMesh& mesh) {
    if (scene.cuts.empty() || scene.time.is_dynamic() || scene.free_pieces != FreePieces::keep)
        return {};
    const std::vector<std::uint8_t> held = held_components(scene, mesh);
    if (!is_anything_held(held)) return {};  // check_no_free_motion refuses the body
    return nodes_of_pieces(free_pieces(mesh, held), mesh);
}

std::string cuts_text(const Scene& scene, const TetMesh& mesh) {
    if (scene.cuts.empty()) return {};
    constexpr std::size_t most = 4;
    std::vector<std::string> volumes;
    for (const MeshPiece& piece : mesh_pieces(mesh))
        volumes.push_back(fmt::format("{:.4g} ml", 1e6 * piece.volume));
    std::string text = counted(scene.cuts.size(), "cut") + "; the body is in ";
    if (volumes.size() == 1) {
        text += "one piece";
    } else {
        text += fmt::format(
            "{} pieces: {}", volumes.size(),
            fmt::join(volumes.begin(), volumes.begin() + std::min(most, volumes.size()), ", "));
        if (volumes.size() > most) text += ", ...";
    }
    if (scene.free_pieces == FreePieces::leave_out)
        text += "; pieces that nothing holds are left out";
    return text;
}

std::string mesh_identity(const Scene& scene) {
    if (scene.cuts.empty()) return to_yaml(scene.mesh);
    Scene of_mesh;  // free pieces depend on what is held, too
    of_mesh.mesh = scene.mesh;
    of_mesh.cuts = scene.cuts;
    of_mesh.free_pieces = scene.free_pieces;
    of_mesh.time.scheme = scene.time.scheme;
    of_mesh.fix = scene.fix;
    for (const DriveOptions& drive : scene.drive) {
        DriveOptions& selection = of_mesh.drive.emplace_back();
        static_cast<SelectionOptions&>(selection) = drive;
        selection.components = drive.components;
        selection.stiffness_N_per_m = drive.stiffness_N_per_m;
    }
    return to_yaml(of_mesh);
}

}  // namespace livetet
