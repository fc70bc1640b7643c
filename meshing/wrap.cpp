#include "meshing/wrap.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

#include "base/error.hpp"
#include "meshing/remesh.hpp"
#include "meshing/shells.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {

namespace {

using WrapKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using WrapMesh = CGAL::Surface_mesh<WrapKernel::Point_3>;

constexpr double offset_share = 1. / 30;  ///< of the gap

TriangleMesh wrapped(const TriangleMesh& surface, double gap_m) {
    std::vector<WrapKernel::Point_3> points;
    for (const Vector3& x : surface.nodes) points.emplace_back(x.x(), x.y(), x.z());
    std::vector<std::array<std::size_t, 3>> faces;
    for (const auto& [a, b, c] : surface.triangles)
        faces.push_back({static_cast<std::size_t>(a), static_cast<std::size_t>(b),
                         static_cast<std::size_t>(c)});
    WrapMesh wrap;
    CGAL::alpha_wrap_3(points, faces, gap_m, offset_share * gap_m, wrap);
    TriangleMesh result;
    for (const auto v : wrap.vertices()) {
        const auto& p = wrap.point(v);
        result.nodes.emplace_back(p.x(), p.y(), p.z());
    }
    for (const auto f : wrap.faces()) {
        Triangle t{};
        int k = 0;
        for (const auto v : wrap.vertices_around_face(wrap.halfedge(f)))
            t[k++] = static_cast<std::int32_t>(static_cast<WrapMesh::size_type>(v));
        result.triangles.push_back(t);
    }
    return result;
}

double area_of(const TriangleMesh& surface) {
    double area = 0;
    for (const auto& [a, b, c] : surface.triangles)
        area += (surface.nodes[b] - surface.nodes[a])
                    .cross(surface.nodes[c] - surface.nodes[a])
                    .norm() /
                2;
    return area;
}

}  // namespace

WrappedSurface wrap_surface(const TriangleMesh& surface, double gap_m) {
    if (!(gap_m > 0)) fail("wrap: a gap of {} mm must be > 0", 1e3 * gap_m);
    WrappedSurface result;
    result.surface = wrapped(surface, gap_m);
    if (result.surface.triangles.empty() || !(signed_volume(result.surface) > 0))
        fail("surface: a wrap that closes gaps of {:.3g} mm encloses nothing", 1e3 * gap_m);
    TriangleMesh shifted = result.surface;
    shift_to_volume(shifted, signed_volume(shifted) - area_of(shifted) * offset_share * gap_m);
    if (find_self_intersections(shifted).pairs == 0) result.surface = std::move(shifted);
    const NearestTriangle tree(surface.nodes, surface.triangles);
    result.distance = hausdorff_distance(result.surface, surface, tree);
    return result;
}

}  // namespace livetet
