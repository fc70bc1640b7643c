#include "mesh/hex_cut.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

#include "mesh/link_crossings.hpp"
#include "mesh/node_copies.hpp"

namespace livetet {

namespace {

std::vector<std::uint8_t> crossed_by(const HexLevel& level, const GridFrame& frame,
                                     const PlanePatch& patch) {
    Vector3 normal = patch.normal.normalized();
    // Centres that lie in the plane but for rounding are on one side: whatever the rounding, and
    // whichever way the normal points.
    const auto first = std::ranges::find_if(normal, [](double c) { return c != 0; });
    if (*first < 0) normal = -normal;
    const double rounding = 1e-9 * frame.axes.colwise().norm().minCoeff();
    const auto height = [&](std::int32_t cell) {
        return (frame.centre(level.places[cell]) - patch.point).dot(normal) + rounding;
    };
    std::vector<std::uint8_t> cut;
    cut.reserve(level.links.size());
    for (const HexLink& link : level.links) {
        const double below = height(link.lower), above = height(link.upper);
        bool crosses = (below >= 0) != (above >= 0);
        if (crosses) {
            const Vector3 from = frame.centre(level.places[link.lower]),
                          to = frame.centre(level.places[link.upper]);
            crosses =
                is_in_patch(patch, from + below / (below - above) * (to - from), 4 * rounding);
        }
        cut.push_back(crosses);
    }
    return cut;
}

}  // namespace

std::vector<std::uint8_t> crossed_links(const HexLevel& level, const GridFrame& frame,
                                        const CutSurface& surface, const std::string& where) {
    if (const auto* patch = std::get_if<PlanePatch>(&surface))
        return crossed_by(level, frame, *patch);
    std::vector<std::uint8_t> cut(level.links.size(), 0);
    LinkCrossings(level, frame).mark(std::get<TriangleMesh>(surface), cut, where);
    return cut;
}

OpenedGrid open_links(const TetMesh& mesh, const HexLevel& level,
                      std::span<const std::uint8_t> cut) {
    std::vector<HexLink> links;
    for (std::size_t l = 0; l < level.links.size(); ++l)
        if (!cut[l]) links.push_back(level.links[l]);
    const HexLevel opened = make_hex_level(level.places, std::move(links));
    TetMesh made = mesh;
    NodeCopies copies(mesh.nodes.size(), static_cast<std::size_t>(opened.nodes));
    for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e)
        for (int c = 0; c < 8; ++c)
            made.hexahedra[e][c] = copies.number(mesh.hexahedra[e][c], opened.cells[e][c]);
    std::vector<std::int32_t> originals = copies.take_originals();
    append_copies(made, originals);
    made.tets = tets_of_hexahedra(made.hexahedra);
    made.triangle_sets = moved_sets(mesh, made.tets);
    return {std::move(made), std::move(originals)};
}

}  // namespace livetet
