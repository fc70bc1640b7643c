#include "meshing/gmsh_volume.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <future>
#include <span>

#include "base/error.hpp"
#include "base/gmsh.hpp"
#include "mesh/packed_mesh.hpp"
#include "meshing/locality.hpp"
#include "meshing/mesh_pipe.hpp"
#include "meshing/shells.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {

namespace {

enum class Algorithm { hxt = 10, delaunay = 1 };

/// Gmsh works in mm, as its tolerances suit lengths near one.
constexpr double mm_per_m = 1e3;

void set_options(Algorithm algorithm, double edge_length_mm) {
    gmsh::set_number("General.Terminal", 1);
    gmsh::set_number("General.Verbosity", 2);  // errors and warnings
    // One thread: an OpenMP team of the parent does not exist in a fork, and the mesh must not
    // depend on the number of threads.
    gmsh::set_number("General.NumThreads", 1);
    gmsh::set_number("Mesh.MaxNumThreads3D", 1);
    gmsh::set_number("Mesh.Algorithm3D", static_cast<int>(algorithm));
    gmsh::set_number("Mesh.Renumber", 0);  // surface node i keeps the tag i + 1
    gmsh::set_number("Mesh.MeshSizeExtendFromBoundary", 1);
    gmsh::set_number("Mesh.MeshSizeMax", edge_length_mm);
    gmsh::set_number("Mesh.Optimize", 1);
    gmsh::set_number("Mesh.OptimizeThreshold", 0.4);
}

/// Adds a shell as the discrete entity `tag`; node i of the whole surface has the tag i + 1.
void add_shell(const TriangleMesh& surface, std::span<const Triangle> triangles, int tag) {
    gmsh::Nodes nodes;
    for (const std::int32_t n : nodes_of(triangles)) {
        nodes.tags.push_back(static_cast<std::size_t>(n) + 1);
        for (int d = 0; d < 3; ++d) nodes.coordinates.push_back(mm_per_m * surface.nodes[n][d]);
    }
    constexpr int three_node_triangle = 2;
    gmsh::Elements elements{three_node_triangle, {}};
    for (const Triangle& t : triangles)
        for (const std::int32_t n : t) elements.nodes.push_back(static_cast<std::size_t>(n) + 1);
    gmsh::add_discrete_entity(2, tag);
    gmsh::add_nodes(2, tag, nodes);
    gmsh::add_elements(tag, elements);
}

/// Adds a volume for each outer shell, with the cavities in it as holes.
void add_surface(const TriangleMesh& surface) {
    gmsh::add_model("body");
    const std::vector<std::vector<std::vector<Triangle>>> volumes = shells_by_piece(surface);
    int tag = 0, volume = 0;
    for (const auto& shells : volumes) {
        std::vector<int> loops;
        for (const std::vector<Triangle>& shell : shells) {
            add_shell(surface, shell, ++tag);
            loops.push_back(gmsh::add_surface_loop(tag));
        }
        gmsh::add_volume(std::move(loops), ++volume);
    }
    gmsh::synchronize();
}

/// Runs in the child process. Returns tets in metres; the surface's nodes come first, in their
/// order.
int mesh_and_write(const TriangleMesh& surface, double edge_length_m, Algorithm algorithm,
                   const GmshOptions& options, int out) {
    std::srand(1);  // independent of the parent's use of rand
    gmsh::initialize();
    set_options(algorithm, mm_per_m * edge_length_m);
    if (options.edge_length_at) {
        gmsh::set_number("Mesh.MeshSizeExtendFromBoundary", 0);
        gmsh::set_number("Mesh.MeshSizeMax", 1e22);
        gmsh::set_size_callback([&](double x, double y, double z) {
            return mm_per_m * options.edge_length_at(Vector3(x, y, z) / mm_per_m);
        });
    }
    add_surface(surface);
    gmsh::generate(3);
    for (int p = 0; p < options.optimise_passes; ++p) gmsh::optimize();

    const auto [tags, coordinates] = gmsh::nodes();
    constexpr int four_node_tet = 4;
    const gmsh::Tags corners = gmsh::elements_of_type(four_node_tet);

    const std::size_t fixed = surface.nodes.size();
    TetMesh mesh;
    mesh.nodes = surface.nodes;
    std::vector<std::int32_t> number(
        tags.empty() ? 0 : *std::max_element(tags.begin(), tags.end()) + 1, -1);
    for (std::size_t i = 0; i < tags.size(); ++i) {
        if (tags[i] <= fixed) {
            number[tags[i]] = static_cast<std::int32_t>(tags[i]) - 1;
            continue;
        }
        number[tags[i]] = static_cast<std::int32_t>(mesh.nodes.size());
        mesh.nodes.push_back(
            Vector3(coordinates[3 * i], coordinates[3 * i + 1], coordinates[3 * i + 2]) / mm_per_m);
    }
    for (std::size_t c = 0; c + 3 < corners.size(); c += 4)
        mesh.tets.push_back({number[corners[c]], number[corners[c + 1]], number[corners[c + 2]],
                             number[corners[c + 3]]});
    for (const Tet& t : mesh.tets)
        if (*std::min_element(t.begin(), t.end()) < 0) fail("a tet names a node that is not there");
    return write_mesh(out, mesh) ? 0 : 1;
}

/// Runs `work` on a new thread, for which glibc uses a new memory arena. The mesh of Gmsh's HXT
/// depends on the order of memory addresses, and the heap inherited from the parent differs between
/// calls.
int on_fresh_heap(const std::function<int()>& work) {
    return std::async(std::launch::async, work).get();
}

void orient(TetMesh& mesh) {
    for (Tet& t : mesh.tets)
        if (signed_volume(mesh, t) < 0) std::swap(t[2], t[3]);
}

/// Checks a filled surface: valid tets, and the boundary is the given surface. Returns the fault,
/// or an empty text.
std::string fault_of(const TetMesh& mesh, const TriangleMesh& surface) {
    try {
        check_tet_mesh(mesh, "Gmsh");
    } catch (const Error& error) {
        return error.what();
    }
    const auto ordered = [](std::vector<Triangle> triangles) {
        for (Triangle& t : triangles)
            std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
        std::sort(triangles.begin(), triangles.end());
        return triangles;
    };
    if (ordered(boundary_triangles(mesh.tets)) != ordered(surface.triangles))
        return "Gmsh: the boundary of its mesh is not the surface that it was given";
    return {};
}

}  // namespace

TetMesh fill_surface(const TriangleMesh& surface, double edge_length_m, const GmshOptions& options,
                     std::string* way) {
    const SurfaceTopology topology = check_topology(surface);
    if (!topology.closed())
        fail(
            "surface: it has {} border, {} non-manifold and {} misoriented edges, first at {}; "
            "expected none",
            topology.border_edges, topology.non_manifold_edges, topology.misoriented_edges,
            place_mm(topology.place));
    if (!(edge_length_m > 0))
        fail("Gmsh: an edge length of {} mm must be > 0", 1e3 * edge_length_m);
    gmsh::load();
    std::string faults;
    double time_left = options.time_limit_s;
    std::array<Algorithm, 2> ways{Algorithm::hxt, Algorithm::delaunay};
    if (options.edge_length_at)
        std::swap(ways[0], ways[1]);  // HXT of Gmsh 4.8 uses the sizes of the boundary only
    for (const Algorithm algorithm : ways) {
        const auto work = [&](int out) {
            return on_fresh_heap(
                [&] { return mesh_and_write(surface, edge_length_m, algorithm, options, out); });
        };
        const double limit =
            algorithm == ways[0]
                ? time_left / 2
                : time_left;  // leaves time for the second algorithm if the first hangs
        const ChildResult child = options.run(work, limit);
        const char* name = algorithm == Algorithm::hxt ? "HXT" : "Delaunay";
        std::string fault;
        if (child.end == ChildResult::End::returned) {
            TetMesh mesh = unpacked_mesh(child.result, "Gmsh");
            orient(mesh);
            drop_unused_nodes(mesh, surface.nodes.size());
            fault = mesh.tets.empty() ? "made no tets: " + last_error_lines(child.log)
                                      : fault_of(mesh, surface);
            if (fault.empty()) {
                sort_for_locality(mesh);
                if (way) *way = faults.empty() ? name : fmt::format("{} ({})", name, faults);
                return mesh;
            }
        } else {
            fault = describe_end(child, limit);
        }
        faults += fmt::format("{}{} {}", faults.empty() ? "" : "; ", name, fault);
        time_left -= child.seconds;
        if (time_left <= 0) break;
    }
    fail("Gmsh: no volume mesh of {:.2f} mm edges for the surface from {} ({} triangles): {}",
         1e3 * edge_length_m, box_mm(surface.nodes), surface.triangles.size(), faults);
}

std::string gmsh_version() { return gmsh::api_version(); }

}  // namespace livetet
