#include "meshing/voxel_grid.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.hpp"
#include "mesh/hex_grid.hpp"
#include "meshing/body_mask.hpp"

namespace livetet {

namespace {

using Mask = Image<std::uint8_t>;

/// The body's voxels without the empty margin of BodyMask, in right-handed axes.
struct BodyVoxels {
    Mask mask;
    std::vector<std::int32_t> labels;  ///< of each voxel in the body; 0 elsewhere
};

BodyVoxels body_voxels(const LabelImage& image, const BodyMask& body) {
    BodyVoxels voxels;
    for (int d = 0; d < 3; ++d) voxels.mask.size[d] = body.mask.size[d] - 2;
    const auto [nx, ny, nz] = voxels.mask.size;
    Eigen::Matrix4d to_ras = body.mask.ras_from_voxel;
    to_ras.col(3) += to_ras.leftCols<3>().rowwise().sum();
    const bool mirrored = to_ras.topLeftCorner<3, 3>().determinant() < 0;
    if (mirrored) {
        to_ras.col(3) += (nx - 1) * to_ras.col(0);
        to_ras.col(0) *= -1;
    }
    voxels.mask.ras_from_voxel = to_ras;
    for (int k = 0; k < nz; ++k)
        for (int j = 0; j < ny; ++j)
            for (int i = 0; i < nx; ++i) {
                const int at = (mirrored ? nx - 1 - i : i) + 1;
                const std::uint8_t inside = body.mask.at(at, j + 1, k + 1);
                const int x = at + body.corner[0], y = j + 1 + body.corner[1],
                          z = k + 1 + body.corner[2];
                voxels.mask.values.push_back(inside);
                voxels.labels.push_back(inside && image.contains(x, y, z) ? image.at(x, y, z) : 0);
            }
    return voxels;
}

void check_axes(const Eigen::Matrix3d& axes) {
    const Eigen::Matrix3d unit = axes.colwise().normalized();
    const double most =
        std::max({std::abs(unit.col(0).dot(unit.col(1))), std::abs(unit.col(1).dot(unit.col(2))),
                  std::abs(unit.col(2).dot(unit.col(0)))});
    if (!(most < std::sin(std::numbers::pi / 180)))
        fail(
            "the voxels' axes are {:.2f} degrees off right angles, expected at most 1 for a grid "
            "of hexahedra",
            std::asin(std::min(most, 1.0)) * 180 / std::numbers::pi);
}

/// Number of the body's voxels in each cell of so many voxels, cells stored as voxels are.
Image<std::int32_t> count_voxels(const Mask& mask, const std::array<int, 3>& voxels_a_cell) {
    Image<std::int32_t> cells;
    for (int d = 0; d < 3; ++d)
        cells.size[d] = (mask.size[d] + voxels_a_cell[d] - 1) / voxels_a_cell[d];
    cells.values.assign(cells.index(0, 0, cells.size[2]), 0);
    std::size_t v = 0;
    for (int k = 0; k < mask.size[2]; ++k)
        for (int j = 0; j < mask.size[1]; ++j)
            for (int i = 0; i < mask.size[0]; ++i, ++v)
                cells.at(i / voxels_a_cell[0], j / voxels_a_cell[1], k / voxels_a_cell[2]) +=
                    mask.values[v];
    return cells;
}

std::int64_t used(const Image<std::int32_t>& cells) {
    return std::count_if(cells.values.begin(), cells.values.end(),
                         [](std::int32_t n) { return n > 0; });
}

Image<std::int32_t> choose_cells(const Mask& mask, std::int64_t max_cells,
                                 std::array<int, 3>& voxels_a_cell) {
    const Vector3 spacing = grid_of(mask).spacing();
    const auto edge = [&](int d) { return spacing[d] * voxels_a_cell[d]; };
    const auto ends = [&] { return std::minmax({edge(0), edge(1), edge(2)}); };
    for (int d = 0; d < 3; ++d)
        while (2 * edge(d) <= ends().second) voxels_a_cell[d] *= 2;
    for (;;) {
        Image<std::int32_t> cells = count_voxels(mask, voxels_a_cell);
        if (used(cells) <= max_cells || cells.values.size() <= 1) return cells;
        for (int& n : voxels_a_cell) n *= 2;
    }
}

/// For each cell with voxels the label that most of them have; of equal ones the smallest.
std::vector<std::int32_t> majority_labels(const BodyVoxels& voxels,
                                          const Image<std::int32_t>& number,
                                          const std::array<int, 3>& voxels_a_cell,
                                          std::size_t cells) {
    std::vector<std::vector<std::pair<std::int32_t, std::int32_t>>> counts(cells);
    std::size_t v = 0;
    for (int k = 0; k < voxels.mask.size[2]; ++k)
        for (int j = 0; j < voxels.mask.size[1]; ++j)
            for (int i = 0; i < voxels.mask.size[0]; ++i, ++v) {
                const std::int32_t label = voxels.labels[v];
                if (label == 0) continue;
                auto& of_cell = counts[number.at(i / voxels_a_cell[0], j / voxels_a_cell[1],
                                                 k / voxels_a_cell[2])];
                const auto found = std::find_if(of_cell.begin(), of_cell.end(),
                                                [&](const auto& c) { return c.first == label; });
                if (found == of_cell.end())
                    of_cell.emplace_back(label, 1);
                else
                    ++found->second;
            }
    std::vector<std::int32_t> labels(cells, 0);
    std::int32_t last = 0;
    for (std::size_t e = 0; e < cells; ++e) {
        std::int32_t most = 0;
        for (const auto& [label, count] : counts[e])
            if (count > most || (count == most && label < labels[e]))
                labels[e] = label, most = count;
        if (labels[e] == 0) labels[e] = last;  // a filled cavity alone: as the cell before it
        last = labels[e];
    }
    const auto first = std::find_if(labels.begin(), labels.end(), [](auto l) { return l != 0; });
    if (first != labels.end()) std::fill(labels.begin(), first, *first);
    return labels;
}

/// Links of cells across whose face voxels of the body touch.
std::vector<HexLink> touching_cells(const Mask& mask, const Image<std::int32_t>& number,
                                    const std::array<int, 3>& voxels_a_cell) {
    std::vector<HexLink> links;
    std::size_t v = 0;
    const std::size_t steps[3] = {1, static_cast<std::size_t>(mask.size[0]),
                                  static_cast<std::size_t>(mask.size[0]) * mask.size[1]};
    for (int k = 0; k < mask.size[2]; ++k)
        for (int j = 0; j < mask.size[1]; ++j)
            for (int i = 0; i < mask.size[0]; ++i, ++v) {
                if (!mask.values[v]) continue;
                const std::array<int, 3> at{i, j, k};
                for (int d = 0; d < 3; ++d) {
                    if (at[d] + 1 >= mask.size[d] || (at[d] + 1) % voxels_a_cell[d] != 0 ||
                        !mask.values[v + steps[d]])
                        continue;
                    std::array<int, 3> cell{};
                    for (int a = 0; a < 3; ++a) cell[a] = at[a] / voxels_a_cell[a];
                    const std::int32_t lower = number.at(cell[0], cell[1], cell[2]);
                    ++cell[d];
                    links.push_back({lower, number.at(cell[0], cell[1], cell[2]), d});
                }
            }
    std::sort(links.begin(), links.end());
    links.erase(std::unique(links.begin(), links.end()), links.end());
    return links;
}

void place_nodes(const HexLevel& level, const Mask& mask, const std::array<int, 3>& voxels_a_cell,
                 TetMesh& mesh) {
    mesh.nodes.resize(level.nodes);
    for (std::size_t e = 0; e < level.cells.size(); ++e)
        for (int c = 0; c < 8; ++c) {
            Vector3 voxel;
            for (int d = 0; d < 3; ++d)
                voxel[d] = (level.places[e][d] + (c >> d & 1)) * voxels_a_cell[d] - 0.5;
            mesh.nodes[level.cells[e][c]] = (mask.ras_from_voxel * voxel.homogeneous()).head<3>();
        }
}

void note_left_out(const BodyMask& body, double voxel_m3, std::vector<std::string>& notes) {
    for (const auto& [label, count] : body.left_out)
        notes.push_back(fmt::format(
            "label {}: {:.4g} ml do not hang together with the largest part and are left out; "
            "--all-parts (in a scene mesh.parts: all) takes them too",
            label, 1e6 * voxel_m3 * static_cast<double>(count)));
    if (body.specks.count > 0)
        notes.push_back(fmt::format("{} part{} smaller than a speck left out, {:.4g} ml",
                                    body.specks.count, body.specks.count == 1 ? "" : "s",
                                    1e6 * voxel_m3 * static_cast<double>(body.specks.voxels)));
    if (body.filled.count > 0)
        notes.push_back(fmt::format("{} cavit{} filled, {:.4g} ml", body.filled.count,
                                    body.filled.count == 1 ? "y" : "ies",
                                    1e6 * voxel_m3 * static_cast<double>(body.filled.voxels)));
}

}  // namespace

VoxelGrid voxel_grid(const LabelImage& image, const std::vector<std::int32_t>& labels,
                     const BodyChoice& choice, std::int64_t max_cells) {
    const BodyMask body = body_mask(image, labels, choice);
    check_axes(image.ras_from_voxel.topLeftCorner<3, 3>());
    const BodyVoxels voxels = body_voxels(image, body);
    VoxelGrid grid;
    Image<std::int32_t> cells = choose_cells(voxels.mask, max_cells, grid.voxels_a_cell);
    const double voxel_m3 = std::abs(image.ras_from_voxel.topLeftCorner<3, 3>().determinant());
    grid.body_m3 = voxel_m3 * static_cast<double>(body.body_voxels);
    const double per_cell =
        static_cast<double>(grid.voxels_a_cell[0]) * grid.voxels_a_cell[1] * grid.voxels_a_cell[2];
    std::vector<HexPlace> places;
    std::size_t v = 0;
    for (int k = 0; k < cells.size[2]; ++k)
        for (int j = 0; j < cells.size[1]; ++j)
            for (int i = 0; i < cells.size[0]; ++i, ++v) {
                std::int32_t& count = cells.values[v];
                if (count == 0) continue;
                grid.mesh.shares.push_back(count / per_cell);
                count = static_cast<std::int32_t>(places.size());  // from now on: its number
                places.push_back({i, j, k});
            }
    const std::vector<std::int32_t> regions =
        majority_labels(voxels, cells, grid.voxels_a_cell, places.size());
    HexLevel level =
        make_hex_level(std::move(places), touching_cells(voxels.mask, cells, grid.voxels_a_cell));
    place_nodes(level, voxels.mask, grid.voxels_a_cell, grid.mesh);
    for (const std::int32_t region : regions)
        grid.mesh.regions.insert(grid.mesh.regions.end(), tets_per_hexahedron, region);
    grid.mesh.hexahedra = std::move(level.cells);
    grid.mesh.tets = tets_of_hexahedra(grid.mesh.hexahedra);
    note_left_out(body, voxel_m3, grid.notes);
    return grid;
}

}  // namespace livetet
