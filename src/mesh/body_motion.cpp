#include "mesh/body_motion.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "base/error.hpp"
#include "geometry/triangle_area.hpp"
#include "mesh/clipped_grid.hpp"

namespace livetet {

namespace {

double oriented_volume(std::span<const Vector3> nodes, const Tet& t) {
    return (nodes[t[1]] - nodes[t[0]])
        .cross(nodes[t[2]] - nodes[t[0]])
        .dot(nodes[t[3]] - nodes[t[0]]);
}

/// Splits each ten-node tet into eight linear tets: four at its corners, and four around the
/// diagonal between the midpoints of edges 0-1 and 2-3, in the order of the other midpoints around
/// it.
std::vector<Tet> linear_tets(const TetMesh& mesh) {
    if (mesh.edge_nodes.empty()) return mesh.tets;
    std::vector<Tet> tets;
    tets.reserve(8 * mesh.tets.size());
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
        const Tet& t = mesh.tets[e];
        const auto& [m01, m12, m20, m03, m13, m23] = mesh.edge_nodes[e];
        tets.insert(tets.end(), {{t[0], m01, m20, m03},
                                 {m01, t[1], m12, m13},
                                 {m20, m12, t[2], m23},
                                 {m03, m13, m23, t[3]}});
        const std::int32_t ring[] = {m12, m20, m03, m13};
        for (int i = 0; i < 4; ++i) {
            Tet inner{m01, m23, ring[i], ring[(i + 1) % 4]};
            if (oriented_volume(mesh.nodes, inner) < 0) std::swap(inner[2], inner[3]);
            tets.push_back(inner);
        }
    }
    return tets;
}

/// Splits the prism over an outwards wound triangle of inner nodes into three tets. On each side
/// face the diagonal starts at the lower inner node, so neighbouring prisms match.
void add_prism(std::vector<Tet>& tets, Triangle inner, const std::vector<std::int32_t>& outer_of) {
    const auto lowest = std::min_element(inner.begin(), inner.end());
    std::rotate(inner.begin(), lowest, inner.end());
    const auto [a, b, c] = inner;
    const std::int32_t A = outer_of[a], B = outer_of[b], C = outer_of[c];
    tets.push_back({a, A, B, C});
    if (b < c) {
        tets.push_back({a, b, c, C});
        tets.push_back({a, B, b, C});
    } else {
        tets.push_back({a, b, c, B});
        tets.push_back({a, c, C, B});
    }
}

/// Appends the outer nodes, `thickness` away from the inner ones along the area-weighted vertex
/// normals.
void add_outer_nodes(std::vector<Vector3>& nodes, std::span<const Triangle> surface,
                     std::span<const std::int32_t> inner, double thickness) {
    std::vector<Vector3> normals(nodes.size(), Vector3::Zero());
    for (const Triangle& t : surface)
        for (const std::int32_t n : t) normals[n] += area_vector(nodes, t);
    for (const std::int32_t n : inner)
        nodes.push_back(nodes[n] + thickness * normals[n].normalized());
}

/// Removes triangles that lie on another one at rest: the two sides of a cut. Beyond them is the
/// body itself, which a rind would draw into the gap.
void remove_cut_faces(std::span<const Vector3> nodes, std::vector<Triangle>& surface) {
    using Place = std::array<double, 3>;
    using Face = std::array<Place, 3>;
    std::vector<std::pair<Face, std::size_t>> faces;
    faces.reserve(surface.size());
    for (std::size_t t = 0; t < surface.size(); ++t) {
        Face face;
        for (int i = 0; i < 3; ++i) {
            const Vector3& x = nodes[surface[t][i]];
            face[i] = {x[0], x[1], x[2]};
        }
        std::sort(face.begin(), face.end());
        faces.emplace_back(face, t);
    }
    std::sort(faces.begin(), faces.end());
    std::vector<std::uint8_t> is_cut(surface.size(), 0);
    for (std::size_t i = 1; i < faces.size(); ++i)
        if (faces[i].first == faces[i - 1].first)
            is_cut[faces[i].second] = is_cut[faces[i - 1].second] = 1;
    std::vector<Triangle> kept;
    for (std::size_t t = 0; t < surface.size(); ++t)
        if (!is_cut[t]) kept.push_back(surface[t]);
    surface = std::move(kept);
}

/// Without a rind.
BodyMotion motion_of_tets(const TetMesh& mesh, std::span<const Vector3> displacement) {
    BodyMotion motion{{}, 0, mesh.nodes, mesh.nodes};
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) motion.deformed[n] += displacement[n];
    if (mesh.shares.empty()) {
        motion.tets = linear_tets(mesh);
    } else {
        ClippedTets clipped = clipped_grid(mesh);
        motion.tets = std::move(clipped.tets);
        motion.rest = clipped.at_nodes(std::move(motion.rest));
        motion.deformed = clipped.at_nodes(std::move(motion.deformed));
    }
    motion.own = motion.tets.size();
    return motion;
}

}  // namespace

BodyMotion body_motion(const TetMesh& mesh, std::span<const Vector3> displacement, double rind) {
    if (displacement.size() != mesh.nodes.size())
        fail("a motion has {} displacements, expected one for each of {} nodes",
             displacement.size(), mesh.nodes.size());
    BodyMotion motion = motion_of_tets(mesh, displacement);
    if (rind <= 0) return motion;
    std::vector<Triangle> surface = boundary_triangles(motion.tets);
    remove_cut_faces(motion.rest, surface);
    const std::vector<std::int32_t> inner = nodes_of(surface);
    const std::size_t nodes = motion.rest.size();
    std::vector<std::int32_t> outer_of(nodes, -1);
    for (std::size_t i = 0; i < inner.size(); ++i)
        outer_of[inner[i]] = static_cast<std::int32_t>(nodes + i);
    for (const Triangle& t : surface) add_prism(motion.tets, t, outer_of);
    add_outer_nodes(motion.rest, surface, inner, rind);
    add_outer_nodes(motion.deformed, surface, inner, rind);
    return motion;
}

std::vector<Vector3> differences(std::span<const Vector3> a, std::span<const Vector3> b) {
    std::vector<Vector3> d(b.begin(), b.end());
    for (std::size_t n = 0; n < d.size(); ++n) d[n] -= a[n];
    return d;
}

}  // namespace livetet
