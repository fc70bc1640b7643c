#include "meshing/label_volume.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/make_mesh_3.h>

#include <unordered_map>

#include "base/error.hpp"
#include "mesh/packed_mesh.hpp"
#include "meshing/interfaces.hpp"
#include "meshing/mesh_pipe.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using LabelledDomain = CGAL::Labeled_mesh_domain_3<Kernel>;

/// CGAL works in mm, as some of its tolerances are absolute.
constexpr double mm_per_m = 1e3;

/// Maximum circumradius of interface triangles, in edge lengths.
constexpr double surface_radius = 0.65;
constexpr double inside_radius = 0.65;  ///< maximum circumradius of tets, in edge lengths
/// Maximum distance from interface triangles to the interface, in edge lengths.
constexpr double surface_distance = 0.12;
constexpr double min_angle_deg = 25;  ///< of interface triangles
constexpr double radius_edge_ratio = 2.2;
constexpr double place_error = 0.01;  ///< of interface nodes, in edge lengths
constexpr std::size_t seeds_a_piece = 30;

Vector3 metres(const Point& p) { return Vector3(p.x(), p.y(), p.z()) / mm_per_m; }

/// A labelled domain with given initial points on the interface of every piece. CGAL's own initial
/// points come from random rays, which miss small pieces.
class SeededDomain : public LabelledDomain {
  public:
    SeededDomain(const LabelledDomain& domain, std::vector<Point> seeds)
        : LabelledDomain(domain), seeds_(std::move(seeds)) {}

    struct Construct_initial_points {
        const SeededDomain& domain;
        template <class Output>
        Output operator()(Output out, int = 0) const {
            for (const Point& p : domain.seeds_)
                *out++ = std::make_pair(p, domain.index_from_surface_patch_index({0, 1}));
            return out;
        }
    };
    Construct_initial_points construct_initial_points_object() const { return {*this}; }

  private:
    std::vector<Point> seeds_;
};

using Triangulation =
    CGAL::Mesh_triangulation_3<SeededDomain, CGAL::Default, CGAL::Sequential_tag>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

/// `factor` times the wanted edge length at a position, mm.
struct SizeField {
    using FT = double;
    using Point_3 = Point;
    using Index = SeededDomain::Index;
    double edge_length_m, factor, growth;
    const EdgeLengthField* shorter_at;

    double operator()(const Point& p, int, const Index&) const {
        double edge = growth * edge_length_m;
        if (*shorter_at)
            if (const double near = (*shorter_at)(metres(p)); near < edge_length_m) edge = near;
        return mm_per_m * factor * edge;
    }
};

/// All tets of the triangulation in metres; those outside have region 0.
TetMesh all_tets(const Complex& complex) {
    const auto& triangulation = complex.triangulation();
    TetMesh mesh;
    std::unordered_map<Triangulation::Vertex_handle, std::int32_t> number;
    for (const auto v : triangulation.finite_vertex_handles()) {
        number[v] = static_cast<std::int32_t>(mesh.nodes.size());
        mesh.nodes.push_back(metres(v->point().point()));
    }
    for (const auto c : triangulation.finite_cell_handles()) {
        Tet tet;
        for (int i = 0; i < 4; ++i) tet[i] = number[c->vertex(i)];
        mesh.tets.push_back(tet);
        mesh.regions.push_back(complex.is_in_complex(c) ? complex.subdomain_index(c) : 0);
    }
    return mesh;
}

int mesh_and_write(const LabelField& field, double edge_length_m, const LabelVolumeOptions& options,
                   int out) {
    CGAL::get_default_random() = CGAL::Random(1);  // the default seed is the time
    const auto [low, high] = field.bounds();
    const Vector3 a = mm_per_m * low, b = mm_per_m * high;
    const double edge = mm_per_m * edge_length_m;
    const auto label_at = [&](const Point& p) { return field.label_at(metres(p)); };
    namespace p = CGAL::parameters;
    const LabelledDomain labelled(
        p::function = label_at,
        p::bounding_object = CGAL::Bbox_3(a[0], a[1], a[2], b[0], b[1], b[2]),
        p::relative_error_bound = place_error * edge / ((b - a).norm() / 2));
    std::vector<Point> seeds;
    for (const Vector3& x : field.interface_places(
             edge_length_m, seeds_a_piece, edge_length_m * edge_length_m * edge_length_m / 8))
        seeds.emplace_back(mm_per_m * x[0], mm_per_m * x[1], mm_per_m * x[2]);
    const SeededDomain domain(labelled, std::move(seeds));
    const SizeField on_surface{edge_length_m, surface_radius, 1, &options.shorter_at};
    const SizeField distance{edge_length_m, surface_distance, 1, &options.shorter_at};
    const SizeField inside{edge_length_m, inside_radius, options.inside_growth,
                           &options.shorter_at};
    const Criteria criteria(p::facet_angle = min_angle_deg, p::facet_size = on_surface,
                            p::facet_distance = distance,
                            p::cell_radius_edge_ratio = radius_edge_ratio, p::cell_size = inside);
    Complex complex = CGAL::make_mesh_3<Complex>(domain, criteria, p::no_perturb(), p::no_exude());
    const double seconds = options.time_limit_s / 4, bound = options.min_dihedral_deg;
    CGAL::perturb_mesh_3(complex, domain, p::time_limit = seconds, p::sliver_bound = bound);
    CGAL::exude_mesh_3(complex, p::time_limit = seconds, p::sliver_bound = bound);
    return write_mesh(out, all_tets(complex)) ? 0 : 1;
}

}  // namespace

TetMesh fill_labels(const LabelField& field, double edge_length_m,
                    const LabelVolumeOptions& options) {
    if (!(edge_length_m > 0))
        fail("CGAL: an edge length of {} mm must be > 0", 1e3 * edge_length_m);
    const ChildResult child =
        options.run([&](int out) { return mesh_and_write(field, edge_length_m, options, out); },
                    options.time_limit_s);
    if (child.end != ChildResult::End::returned)
        fail("CGAL: no mesh of the labels from {} with edges of {:.2f} mm: {}",
             box_mm(field.bounds()), 1e3 * edge_length_m,
             describe_end(child, options.time_limit_s));
    TetMesh mesh = unpacked_mesh(child.result, "CGAL");
    make_one_body(mesh, field.kept());
    return mesh;
}

std::string cgal_version() { return CGAL_STR(CGAL_VERSION); }

}  // namespace livetet
