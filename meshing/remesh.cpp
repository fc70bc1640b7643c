#include "meshing/remesh.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/repair_self_intersections.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>

#include "base/error.hpp"
#include "geometry/triangle_area.hpp"
#include "meshing/shells.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {

namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;
using Face = Mesh::Face_index;

/// Largest hole to fill, relative to the diagonal of the surface's bounding box.
constexpr double widest_hole = 0.1;
constexpr unsigned max_mended_cuts = 1000;  ///< pairs of triangles that may intersect

Vector3 vector(const Point& p) { return {p.x(), p.y(), p.z()}; }

/// Precondition: manifold and consistently wound.
Mesh to_cgal(const TriangleMesh& surface) {
    Mesh mesh;
    for (const Vector3& x : surface.nodes) mesh.add_vertex({x.x(), x.y(), x.z()});
    for (const auto& [a, b, c] : surface.triangles)
        if (mesh.add_face(Mesh::Vertex_index(a), Mesh::Vertex_index(b), Mesh::Vertex_index(c)) ==
            Mesh::null_face())
            fail("surface: the triangle at {} makes a node or an edge non-manifold",
                 place_mm((surface.nodes[a] + surface.nodes[b] + surface.nodes[c]) / 3));
    return mesh;
}

TriangleMesh from_cgal(Mesh& mesh) {
    mesh.collect_garbage();
    TriangleMesh surface;
    for (const auto v : mesh.vertices()) surface.nodes.push_back(vector(mesh.point(v)));
    for (const Face f : mesh.faces()) {
        Triangle t;
        int k = 0;
        for (const auto v : mesh.vertices_around_face(mesh.halfedge(f)))
            t[k++] = static_cast<std::int32_t>(static_cast<Mesh::size_type>(v));
        surface.triangles.push_back(t);
    }
    return surface;
}

/// Merges nodes at the same position, drops degenerate and duplicate triangles, makes the winding
/// consistent.
TriangleMesh cleaned_soup(const TriangleMesh& surface) {
    std::vector<Point> points;
    std::vector<std::vector<std::size_t>> polygons;
    for (const Vector3& x : surface.nodes) points.emplace_back(x.x(), x.y(), x.z());
    for (const auto& [a, b, c] : surface.triangles)
        polygons.push_back({static_cast<std::size_t>(a), static_cast<std::size_t>(b),
                            static_cast<std::size_t>(c)});
    PMP::repair_polygon_soup(points, polygons);
    TriangleMesh clean;
    const auto take = [&] {
        clean = {};
        for (const Point& p : points) clean.nodes.push_back(vector(p));
        for (const auto& t : polygons)
            clean.triangles.push_back({static_cast<std::int32_t>(t[0]),
                                       static_cast<std::int32_t>(t[1]),
                                       static_cast<std::int32_t>(t[2])});
    };
    take();
    if (polygons.empty() || check_topology(clean).non_manifold_edges > 0) return clean;
    PMP::orient_polygon_soup(points, polygons);  // also duplicates the node where sheets touch
    take();
    return clean;
}

double diagonal(const TriangleMesh& surface) {
    Eigen::AlignedBox3d box;
    for (const Vector3& x : surface.nodes) box.extend(x);
    return box.diagonal().norm();
}

/// Fills small holes and notes them in one line.
void fill_small_holes(Mesh& mesh, double widest, std::vector<std::string>& notes) {
    std::vector<Mesh::Halfedge_index> holes;
    PMP::extract_boundary_cycles(mesh, std::back_inserter(holes));
    int filled = 0;
    Eigen::AlignedBox3d largest;
    for (const auto hole : holes) {
        Eigen::AlignedBox3d box;
        for (const auto h : CGAL::halfedges_around_face(hole, mesh))
            box.extend(vector(mesh.point(mesh.target(h))));
        if (box.diagonal().norm() > widest) continue;
        std::vector<Face> patch;
        PMP::triangulate_hole(mesh, hole, std::back_inserter(patch));
        if (filled++ == 0 || box.diagonal().norm() > largest.diagonal().norm()) largest = box;
    }
    if (filled > 0)
        notes.push_back(fmt::format("surface: {} hole{} filled, the widest of {:.2f} mm at {}",
                                    filled, filled == 1 ? "" : "s", 1e3 * largest.diagonal().norm(),
                                    place_mm(largest.center())));
}

double total_volume(std::span<const TriangleMesh> surfaces) {
    double sum = 0;
    for (const TriangleMesh& s : surfaces) sum += std::abs(signed_volume(s));
    return sum;
}

/// Notes shells that are left out or filled for their size.
void note_specks(std::span<const TriangleMesh> specks, double limit_m3,
                 std::vector<std::string>& notes) {
    if (specks.empty()) return;
    notes.push_back(fmt::format(
        "surface: {} shell{} of {:.3g} ml in all left out: each is smaller than {:.3g} ml "
        "(--speck-ml)",
        specks.size(), specks.size() == 1 ? "" : "s", 1e6 * total_volume(specks), 1e6 * limit_m3));
}

/// The shells that the choice keeps. Notes the others and the cavities.
TriangleMesh chosen_shells(const TriangleMesh& surface, const BodyChoice& choice,
                           std::vector<std::string>& notes) {
    std::vector<TriangleMesh> shells = parts_of(surface);
    double largest = 0;
    for (const TriangleMesh& shell : shells) largest = std::max(largest, signed_volume(shell));
    const double speck_m3 = choice.speck_m3(largest);
    const auto specks =
        std::stable_partition(shells.begin(), shells.end(), [&](const TriangleMesh& s) {
            const double volume = signed_volume(s);
            return volume == largest || std::abs(volume) >= speck_m3;
        });
    note_specks(std::span(specks, shells.end()), speck_m3, notes);
    shells.erase(specks, shells.end());
    std::vector<BodyPiece> pieces = pieces_of(joined(shells));
    if (choice.parts == Parts::largest && pieces.size() > 1) {
        double apart = 0;
        for (std::size_t p = 1; p < pieces.size(); ++p) apart += pieces[p].volume_m3();
        notes.push_back(fmt::format(
            "surface: of {} parts the largest is meshed, {:.4g} ml; {:.4g} ml in the others are "
            "left out, most of them from {}; --all-parts meshes them too",
            pieces.size(), 1e6 * pieces[0].volume_m3(), 1e6 * apart,
            box_mm(pieces[1].outer.nodes)));
        pieces.resize(1);
    } else if (pieces.size() > 1) {
        notes.push_back(fmt::format(
            "surface: {} parts are meshed: the sets \"part_1\" to \"part_{}\", the largest first",
            pieces.size(), pieces.size()));
    }
    for (BodyPiece& piece : pieces) {
        if (piece.cavities.empty()) continue;
        notes.push_back(fmt::format("surface: {} of {:.4g} ml {}",
                                    piece.cavities.size() == 1
                                        ? "1 cavity"
                                        : fmt::format("{} cavities", piece.cavities.size()),
                                    1e6 * total_volume(piece.cavities),
                                    choice.cavities == Cavities::fill
                                        ? "filled"
                                        : "kept: the set \"cavity\"; --fill-cavities fills them"));
        if (choice.cavities == Cavities::fill) piece.cavities.clear();
    }
    return joined(pieces);
}

[[noreturn]] void refuse(const SurfaceTopology& t) {
    fail(
        "surface: it is not closed and manifold: {} border edges, {} non-manifold edges, first at "
        "{}; expected none, and merging double nodes, dropping degenerate triangles and filling "
        "small holes did not mend it; --wrap encloses what it is (in a scene mesh.wrap_mm)",
        t.border_edges, t.non_manifold_edges, place_mm(t.place));
}

/// At most `max_pairs` are counted, as their number may grow with the square of the triangles'.
SelfIntersections self_intersections(const Mesh& mesh, unsigned max_pairs = 1'000'000) {
    std::vector<std::pair<Face, Face>> pairs;
    PMP::self_intersections(mesh, std::back_inserter(pairs),
                            CGAL::parameters::maximum_number(max_pairs));
    SelfIntersections result{static_cast<std::int64_t>(pairs.size()), Vector3::Zero()};
    if (pairs.empty()) return result;
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(pairs.front().first)))
        result.place += vector(mesh.point(v)) / 3;
    return result;
}

/// Remeshing mends a few cuts; on many it would not end.
void refuse_many_cuts(const Mesh& mesh) {
    const SelfIntersections cuts = self_intersections(mesh, 100 * max_mended_cuts);
    if (cuts.pairs > max_mended_cuts)
        fail(
            "surface: {}{} pairs of its {} triangles cut each other, first at {}; expected at most "
            "{}: --wrap encloses what it is (in a scene mesh.wrap_mm)",
            cuts.pairs, cuts.pairs >= 100 * max_mended_cuts ? " or more" : "",
            mesh.number_of_faces(), place_mm(cuts.place), max_mended_cuts);
}

/// Signed volumes of a surface's shells: outer ones first, and the larger ones first.
std::vector<double> shell_volumes(const TriangleMesh& surface) {
    std::vector<double> volumes;
    for (const TriangleMesh& shell : parts_of(surface)) volumes.push_back(signed_volume(shell));
    std::sort(volumes.begin(), volumes.end(), [](double a, double b) {
        return (a > 0) != (b > 0) ? a > 0 : std::abs(a) > std::abs(b);
    });
    return volumes;
}

/// The remaining fault of a remeshed surface; nothing if there is none.
std::optional<std::string> fault_of(const Mesh& mesh, const TriangleMesh& surface,
                                    std::span<const double> requested) {
    const SurfaceTopology topology = check_topology(surface);
    if (!topology.closed() || topology.degenerate_triangles > 0)
        return fmt::format(
            "{} border, {} non-manifold edges and {} degenerate triangles, first at {}",
            topology.border_edges, topology.non_manifold_edges, topology.degenerate_triangles,
            place_mm(topology.place));
    if (const SelfIntersections cuts = self_intersections(mesh); cuts.pairs > 0)
        return fmt::format("{} pairs of triangles that cut each other, first at {}", cuts.pairs,
                           place_mm(cuts.place));
    const std::vector<double> found = shell_volumes(surface);
    for (std::size_t s = 0; s < requested.size(); ++s)
        if (s >= found.size() || found[s] / requested[s] < 0.5)
            return fmt::format("a volume of {:.3g} ml where the surface has {:.3g} ml, from {}",
                               s < found.size() ? 1e6 * found[s] : 0.0, 1e6 * requested[s],
                               box_mm(surface.nodes));
    return {};
}

/// Remeshes the faces that need shorter edges again, step by step.
void refine(Mesh& mesh, double edge_length, int iterations, const EdgeLengthField& shorter_at) {
    constexpr double step = 0.7, min_factor = 0.01;
    for (double length = step * edge_length; length > min_factor * edge_length; length *= step) {
        std::vector<Face> faces;
        for (const Face f : mesh.faces()) {
            Vector3 centre = Vector3::Zero();
            for (const auto v : mesh.vertices_around_face(mesh.halfedge(f)))
                centre += vector(mesh.point(v)) / 3;
            if (shorter_at(centre) < length / std::sqrt(step)) faces.push_back(f);
        }
        if (faces.empty()) return;
        PMP::isotropic_remeshing(faces, length, mesh,
                                 CGAL::parameters::number_of_iterations(iterations));
    }
}

/// Shifts the nodes of each shell along their normals by the same distance until it encloses its
/// volume again: the chords of triangles on a convex surface lie inside. `volumes`: as
/// `shell_volumes` gives them. Three steps of at most a tenth of an edge.
void keep_volumes(Mesh& mesh, std::span<const double> volumes, double edge_length) {
    for (int step = 0; step < 3; ++step) {
        const TriangleMesh now = from_cgal(mesh);
        const std::vector<std::int32_t> part = connected_parts(now);
        std::vector<double> area(1 + *std::max_element(part.begin(), part.end()), 0), moment = area,
                                                                                      shift = area;
        std::vector<Vector3> area_normals(now.nodes.size(), Vector3::Zero());
        std::vector<std::int32_t> part_of_node(now.nodes.size(), 0);
        const Vector3 origin = now.nodes.front();
        for (std::size_t t = 0; t < part.size(); ++t) {
            const auto& [a, b, c] = now.triangles[t];
            const Vector3 n = area_vector(now.nodes, now.triangles[t]);
            area[part[t]] += n.norm();
            moment[part[t]] +=
                (now.nodes[a] - origin).dot((now.nodes[b] - origin).cross(now.nodes[c] - origin));
            for (const std::int32_t i : {a, b, c}) {
                area_normals[i] += n;
                part_of_node[i] = part[t];
            }
        }
        std::vector<std::size_t> order(area.size());  // of the volumes
        std::iota(order.begin(), order.end(), 0);
        std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
            return (moment[a] > 0) != (moment[b] > 0) ? moment[a] > 0
                                                      : std::abs(moment[a]) > std::abs(moment[b]);
        });
        for (std::size_t s = 0; s < std::min(order.size(), volumes.size()); ++s)
            shift[order[s]] = (volumes[s] - moment[order[s]] / 6) / area[order[s]];
        for (const auto v : mesh.vertices()) {
            const auto n = static_cast<Mesh::size_type>(v);
            const Vector3 x =
                vector(mesh.point(v)) +
                std::clamp(shift[part_of_node[n]], -edge_length / 10, edge_length / 10) *
                    area_normals[n].normalized();
            mesh.point(v) = {x.x(), x.y(), x.z()};
        }
    }
}

}  // namespace

SelfIntersections find_self_intersections(const TriangleMesh& surface) {
    return self_intersections(to_cgal(surface));
}

TriangleMesh repair_surface(const TriangleMesh& surface, const BodyChoice& choice,
                            std::vector<std::string>* notes) {
    std::vector<std::string> said;
    check_topology(surface);
    TriangleMesh clean = cleaned_soup(surface);
    if (clean.triangles.empty())
        fail("surface: all its {} triangles are degenerate", surface.triangles.size());
    SurfaceTopology topology = check_topology(clean);
    if (topology.non_manifold_edges > 0) refuse(topology);
    Mesh mesh = to_cgal(clean);
    fill_small_holes(mesh, widest_hole * diagonal(clean), said);
    refuse_many_cuts(mesh);
    if (CGAL::is_closed(mesh)) PMP::orient_to_bound_a_volume(mesh);
    clean = from_cgal(mesh);
    topology = check_topology(clean);
    if (!topology.closed()) refuse(topology);
    clean = chosen_shells(clean, choice, said);
    if (notes) notes->insert(notes->end(), said.begin(), said.end());
    if (clean.triangles.empty() || !(signed_volume(clean) > 0))
        fail("surface: it encloses no volume, expected the surface of a body");
    return clean;
}

TriangleMesh remesh_surface(const TriangleMesh& surface, double& edge_length_m, int iterations,
                            int tries, const EdgeLengthField& shorter_at) {
    const double requested_length = edge_length_m;
    const std::vector<double> requested = shell_volumes(surface);
    const ShellCount shells = count_shells(pieces_of(surface));
    const Mesh original = to_cgal(surface);
    std::optional<std::string> fault;
    for (int attempt = 0; attempt < tries; ++attempt) {
        edge_length_m = requested_length * std::pow(0.85, attempt);
        Mesh mesh = original;
        PMP::isotropic_remeshing(
            mesh.faces(), edge_length_m, mesh,
            CGAL::parameters::number_of_iterations(iterations).number_of_relaxation_steps(3));
        if (shorter_at) refine(mesh, edge_length_m, iterations, shorter_at);
        if (mesh.number_of_faces() > 0 && self_intersections(mesh).pairs > 0)
            PMP::experimental::remove_self_intersections(mesh);
        if (mesh.number_of_faces() == 0) continue;
        fault = fault_of(mesh, from_cgal(mesh), requested);
        if (fault) continue;
        const Mesh unshifted = mesh;
        keep_volumes(mesh, requested, edge_length_m);
        if (fault_of(mesh, from_cgal(mesh), requested))
            mesh = unshifted;  // a thin part intersected itself: accept the smaller volume
        return largest_shells(from_cgal(mesh), shells);
    }
    fail(
        "surface: remeshing it to {:.2f} mm (at last {:.2f} mm) leaves {}; expected a closed "
        "surface that does not cut itself: ask for smaller edges",
        1e3 * requested_length, 1e3 * edge_length_m,
        fault.value_or(fmt::format("nothing of the body from {}", box_mm(surface.nodes))));
}

}  // namespace livetet
