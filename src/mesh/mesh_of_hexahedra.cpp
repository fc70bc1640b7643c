#include "mesh/mesh_of_hexahedra.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "mesh/hex_grid.hpp"
#include "mesh/quadratic_hexahedra.hpp"

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

/// Where nodes lie in a grid, by whole numbers of its cells.
struct PlacedCells {
    std::vector<Hexahedron> cells;      ///< corners in our order
    std::vector<HexPlace> places;       ///< of each cell
    std::vector<Vector3> of_nodes;      ///< the whole number of cells along each axis
    std::vector<std::uint8_t> is_used;  ///< one a node
};

/// Places a cell's corners along the axes of the grid. Returns false if they are not those of a
/// box of one cell, as far as single precision tells.
bool place(const TetMesh& mesh, const Hexahedron& cell, const Eigen::Matrix3d& in_cells,
           const Vector3& origin, PlacedCells& placed) {
    constexpr double tolerance = 0.05;  // the sum of errors of the first cell's edges
    std::array<Vector3, 8> at;
    Vector3 low = Vector3::Constant(INFINITY);
    for (int c = 0; c < 8; ++c) {
        const Vector3 exact = in_cells * (mesh.nodes[cell[c]] - origin);
        at[c] = exact.array().round();
        if (!((at[c] - exact).cwiseAbs().maxCoeff() < tolerance)) return false;
        if (!(at[c].cwiseAbs().maxCoeff() < 1e6)) return false;
        low = low.cwiseMin(at[c]);
        placed.of_nodes[cell[c]] = at[c];
        placed.is_used[cell[c]] = 1;
    }
    Hexahedron& ours = placed.cells.emplace_back();
    int taken = 0;
    for (int c = 0; c < 8; ++c) {
        const Vector3 offset = at[c] - low;
        if (offset.maxCoeff() > 1) return false;
        const int corner = (offset[0] == 1) | (offset[1] == 1) << 1 | (offset[2] == 1) << 2;
        ours[corner] = cell[c];
        taken |= 1 << corner;
    }
    HexPlace& at_low = placed.places.emplace_back();
    for (int d = 0; d < 3; ++d) at_low[d] = static_cast<std::int32_t>(low[d]);
    return taken == 0xff;
}

/// Moves nodes to the grid that fits them best, as files in single precision round them. Returns
/// the largest distance that one moved, in cells.
double fit(TetMesh& mesh, const PlacedCells& placed) {
    Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
    Eigen::Matrix<double, 3, 4> moments = Eigen::Matrix<double, 3, 4>::Zero();
    const auto row_of = [&](std::size_t n) -> Eigen::Vector4d {
        return placed.of_nodes[n].homogeneous();
    };
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
        if (!placed.is_used[n]) continue;
        sum += row_of(n) * row_of(n).transpose();
        moments += mesh.nodes[n] * row_of(n).transpose();
    }
    const Eigen::Matrix<double, 3, 4> grid = sum.ldlt().solve(moments.transpose()).transpose();
    const double cell = grid.leftCols<3>().colwise().norm().minCoeff();
    std::vector<Vector3> there = mesh.nodes;
    double farthest = 0;
    for (std::size_t n = 0; n < there.size(); ++n) {
        if (!placed.is_used[n]) continue;
        there[n] = grid * row_of(n);
        farthest = std::max(farthest, (there[n] - mesh.nodes[n]).norm() / cell);
    }
    constexpr double rounding = 1e-9;
    if (farthest > rounding) mesh.nodes = std::move(there);
    return farthest;
}

void check_places(std::vector<HexPlace> places, const std::string& where) {
    std::ranges::sort(places);
    if (std::ranges::adjacent_find(places) != places.end())
        fail("{}: two hexahedra are at one place, expected each place once", where);
}

/// The grid of cells of 8 nodes; none where these are not those of one. Throws Error for cells that
/// are no part of any mesh.
std::optional<PlacedCells> place_cells(const TetMesh& mesh, std::span<const Hexahedron> cells,
                                       const std::string& where) {
    const Eigen::Matrix3d axes = edges_of(mesh, cells[0]), in_cells = axes.inverse();
    const Vector3 origin = mesh.nodes[cells[0][0]];
    PlacedCells placed;
    placed.of_nodes.resize(mesh.nodes.size());
    placed.is_used.assign(mesh.nodes.size(), 0);
    bool is_grid = true;
    for (std::size_t e = 0; e < cells.size(); ++e) {
        const Eigen::Matrix3d edges = edges_of(mesh, cells[e]);
        const double volume = edges.determinant();
        const Vector3 at = 1e3 * mesh.nodes[cells[e][0]];
        if (!(volume > 1e-9 * edges.colwise().norm().prod()))
            fail(
                "{}: hexahedron {} at ({:.4g}, {:.4g}, {:.4g}) mm has a volume of {:.3g} mm^3 by "
                "the edges of its first corner, expected a positive one: corners round the lower "
                "face, then the upper one",
                where, e, at.x(), at.y(), at.z(), 1e9 * volume);
        is_grid = is_grid && place(mesh, cells[e], in_cells, origin, placed);
    }
    return is_grid ? std::optional(std::move(placed)) : std::nullopt;
}

bool has_corners_alone(const QuadraticHexahedron& cell) {
    return std::ranges::count_if(cell, [](std::int32_t n) { return n >= 0; }) == 8;
}

}  // namespace

TetMesh mesh_of_hexahedra(TetMesh mesh, std::vector<QuadraticHexahedron> cells,
                          std::span<const std::int32_t> regions, const std::string& where) {
    if (cells.empty()) fail("{}: has no hexahedra, expected at least one", where);
    if (!std::ranges::all_of(cells, has_corners_alone))
        return quadratic_hexahedra(std::move(mesh), std::move(cells), regions, where);
    std::vector<Hexahedron> corners;
    for (const QuadraticHexahedron& cell : cells)
        corners.push_back({cell[quadratic_corner(0)], cell[quadratic_corner(1)],
                           cell[quadratic_corner(3)], cell[quadratic_corner(2)],
                           cell[quadratic_corner(4)], cell[quadratic_corner(5)],
                           cell[quadratic_corner(7)], cell[quadratic_corner(6)]});
    std::optional<PlacedCells> placed = place_cells(mesh, corners, where);
    constexpr double max_off = 0.01;  // of an edge
    const std::vector<Vector3> as_read = mesh.nodes;
    if (!placed || fit(mesh, *placed) > max_off) {
        mesh.nodes = as_read;
        return quadratic_hexahedra(std::move(mesh), std::move(cells), regions, where);
    }
    check_places(std::move(placed->places), where);
    mesh.hexahedra = std::move(placed->cells);
    mesh.shares.assign(cells.size(), 1);
    mesh.triangle_sets.clear();  // of faces; a grid's surface is not where its faces are
    divide_hexahedra(mesh, where);
    for (const std::int32_t region : regions)
        mesh.regions.insert(mesh.regions.end(), tets_per_hexahedron, region);
    return mesh;
}

void divide_hexahedra(TetMesh& mesh, const std::string& where) {
    if (!mesh.hexahedra.empty() && !mesh.quadratic_hexahedra.empty())
        fail("{}: has hexahedra of 8 and of 27 nodes, expected one kind", where);
    if (!mesh.hexahedra.empty()) {
        (void)hex_level_of(mesh, where);  // throws unless it is a grid
        mesh.tets = tets_of_hexahedra(mesh.hexahedra);
    } else if (!mesh.quadratic_hexahedra.empty()) {
        check_quadratic_mesh(mesh, where);
        mesh.tets = tets_of_quadratic(mesh.quadratic_hexahedra);
    }
}

}  // namespace livetet
