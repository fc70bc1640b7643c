#include "mesh/grid_of_cells.hpp"

#include <Eigen/Dense>

#include <cmath>

#include "base/error.hpp"
#include "mesh/hex_grid.hpp"

namespace livetet {

namespace {

/// The edges from corner 0, of a cell in VTK's order.
Eigen::Matrix3d edges_of(const TetMesh& mesh, const Hexahedron& cell) {
    Eigen::Matrix3d edges;
    const Vector3& corner = mesh.nodes[cell[0]];
    edges << mesh.nodes[cell[1]] - corner, mesh.nodes[cell[3]] - corner,
        mesh.nodes[cell[4]] - corner;
    return edges;
}

/// Places a cell's corners in our order along the axes of a grid. Returns false if the cell is not
/// spanned by them.
bool reorder(const TetMesh& mesh, const Hexahedron& cell, const Eigen::Matrix3d& in_cells,
             Hexahedron& ours) {
    constexpr double tolerance = 1e-3;  // of an edge
    std::array<Vector3, 8> places;
    Vector3 low = Vector3::Constant(INFINITY);
    for (int c = 0; c < 8; ++c) {
        places[c] = in_cells * mesh.nodes[cell[c]];
        low = low.cwiseMin(places[c]);
    }
    int taken = 0;
    for (int c = 0; c < 8; ++c) {
        int corner = 0;
        for (int d = 0; d < 3; ++d) {
            const double offset = places[c][d] - low[d], whole = std::round(offset);
            if (!(std::abs(offset - whole) < tolerance) || whole > 1) return false;
            corner |= (whole == 1) << d;
        }
        ours[corner] = cell[c];
        taken |= 1 << corner;
    }
    return taken == 0xff;
}

}  // namespace

TetMesh grid_of_cells(TetMesh mesh, std::span<const Hexahedron> cells,
                      std::span<const std::int32_t> regions, const std::string& where) {
    if (cells.empty()) fail("{}: has no hexahedra, expected at least one", where);
    const Eigen::Matrix3d axes = edges_of(mesh, cells[0]);
    const double least_volume = 1e-9 * std::abs(axes.colwise().norm().prod());
    for (std::size_t e = 0; e < cells.size(); ++e) {
        const Eigen::Matrix3d edges = edges_of(mesh, cells[e]);
        const double volume = edges.determinant();
        const Vector3 at = 1e3 * mesh.nodes[cells[e][0]];
        if (!(volume > least_volume))
            fail(
                "{}: hexahedron {} at ({:.4g}, {:.4g}, {:.4g}) mm has a volume of {:.3g} mm^3 by "
                "the edges of its first corner, expected a positive one: corners in VTK's order",
                where, e, at.x(), at.y(), at.z(), 1e9 * volume);
        if (!reorder(mesh, cells[e], axes.inverse(), mesh.hexahedra.emplace_back()))
            fail(
                "{}: hexahedron {} at ({:.4g}, {:.4g}, {:.4g}) mm has other edges than the first "
                "one, expected a grid of equal parallelepipeds",
                where, e, at.x(), at.y(), at.z());
    }
    mesh.shares.assign(cells.size(), 1);
    (void)hex_level_of(mesh, where);  // throws unless it is a grid
    mesh.tets = tets_of_hexahedra(mesh.hexahedra);
    for (const std::int32_t region : regions)
        mesh.regions.insert(mesh.regions.end(), tets_per_hexahedron, region);
    return mesh;
}

}  // namespace livetet
