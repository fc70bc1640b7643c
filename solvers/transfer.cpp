#include "solvers/transfer.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <optional>

#include "mechanics/rigid_motions.hpp"

namespace livetet {

CoarseBody::CoarseBody(const TetMesh& mesh) : places(mesh.nodes), piece_of(connected_pieces(mesh)) {}

std::vector<std::uint8_t> coarse_components(const BarycentricMap& fine_in_coarse, std::span<const std::uint8_t> fine, const CoarseBody& coarse) {
    constexpr double total_of_one = 1e6;  // more than the weights of any node's neighbours
    struct Piece {
        Eigen::AlignedBox3d box;
        std::optional<HeldMotions> of_fine, of_coarse;
        bool is_held = false;  ///< as the fine nodes of its tets are
    };
    std::map<std::int32_t, Piece> pieces;
    const std::size_t coarse_nodes = coarse.places.size();
    for (std::size_t n = 0; n < coarse_nodes; ++n) pieces[coarse.piece_of[n]].box.extend(coarse.places[n]);
    for (auto& [first, piece] : pieces) piece.of_fine.emplace(piece.box.center(), piece.box.diagonal().norm() / 2);
    std::vector<double> total(coarse_nodes, 0);
    std::vector<std::array<double, 3>> held(coarse_nodes, {0, 0, 0});
    for (std::size_t i = 0; i < fine_in_coarse.size(); ++i) {
        Vector3 place = Vector3::Zero();
        for (int k = 0; k < 4; ++k) {
            const std::int32_t n = fine_in_coarse.nodes[i][k];
            const double w = fine_in_coarse.mean_weight(i, k);
            total[n] += w;
            place += fine_in_coarse.weights[i][k] * coarse.places[n];
            for (int c = 0; c < 3; ++c)
                if (fine[i] >> c & 1) held[n][c] += w > 0.999 ? total_of_one : w;  // the same node decides by itself
        }
        if (fine[i]) pieces.at(coarse.piece_of[fine_in_coarse.nodes[i][0]]).of_fine->hold(place, fine[i]);
    }
    std::vector<std::uint8_t> components(coarse_nodes, 0);
    bool more = true;
    for (const double share : {0.3, 0.1, 0.03, 0.01, 1e-6}) {
        if (!more) break;
        for (auto& [first, piece] : pieces) piece.of_coarse.emplace(piece.box.center(), piece.box.diagonal().norm() / 2);
        for (std::size_t n = 0; n < coarse_nodes; ++n) {
            Piece& piece = pieces.at(coarse.piece_of[n]);
            if (!piece.is_held)
                for (int c = 0; c < 3; ++c)
                    if (held[n][c] >= share * total[n]) components[n] |= 1 << c;
            piece.of_coarse->hold(coarse.places[n], components[n]);
        }
        more = false;
        for (auto& [first, piece] : pieces) {
            piece.is_held = piece.is_held || !piece.of_fine->all_held() || piece.of_coarse->all_held();
            more = more || !piece.is_held;
        }
    }
    return components;
}

namespace {

/// A quarter of each tet's volume at each of its corners.
std::vector<double> nodal_volumes(const TetMesh& mesh, std::span<const double> volumes) {
    std::vector<double> of_node(mesh.nodes.size(), 0);
    for (std::size_t e = 0; e < mesh.tets.size(); ++e)
        for (const std::int32_t n : mesh.tets[e]) of_node[n] += volumes[e] / 4;
    return of_node;
}

}  // namespace

std::vector<double> tet_volumes(const TetMesh& mesh) {
    std::vector<double> volumes;
    volumes.reserve(mesh.tets.size());
    for (const Tet& t : mesh.tets) volumes.push_back(signed_volume(mesh, t));
    return volumes;
}

std::vector<double> carried_volumes(const TetMesh& fine, std::span<const double> fine_volumes,
                                    const BarycentricMap& fine_in_coarse, const TetMesh& coarse) {
    std::vector<double> volumes = tet_volumes(coarse);
    const std::vector<double> given = nodal_volumes(fine, fine_volumes), own = nodal_volumes(coarse, volumes);
    std::vector<double> carried(coarse.nodes.size(), 0);
    for (std::size_t i = 0; i < given.size(); ++i)
        for (int k = 0; k < 4; ++k) carried[fine_in_coarse.nodes[i][k]] += fine_in_coarse.weights[i][k] * given[i];
    for (std::size_t e = 0; e < volumes.size(); ++e) {
        double ratio = 0;
        for (const std::int32_t n : coarse.tets[e]) ratio += std::clamp(carried[n] / own[n], 0.1, 10.0) / 4;
        volumes[e] *= ratio;
    }
    return volumes;
}

namespace {

/// Rows and columns of single numbers, owned as the shares' nodes are; `columns_of(row, visit)` visits the PETSc numbers of
/// the nodes that owned row number `row` has entries for, each once; it is called once for every row, in order. `width`
/// numbers a node.
template <class ColumnsOf>
PetscHandle<Mat> make_matrix(const MeshShare& rows, const MeshShare& columns, PetscInt width, ColumnsOf&& columns_of) {
    const PetscInt first = columns.owned ? columns.numbers.front() : 0, end = first + columns.owned;
    std::vector<PetscInt> own, others;
    for (std::int32_t i = 0; i < rows.owned; ++i) {
        PetscInt counts[2] = {0, 0};
        columns_of(i, [&](PetscInt n) { ++counts[n < first || n >= end]; });
        own.insert(own.end(), width, counts[0]);
        others.insert(others.end(), width, counts[1]);
    }
    PetscHandle<Mat> A;
    LIVETET_PETSC(MatCreateAIJ(rows.comm, width * rows.owned, width * columns.owned, PETSC_DETERMINE, PETSC_DETERMINE, 0,
                               own.data(), 0, others.data(), A.out()));
    LIVETET_PETSC(MatSetBlockSizes(A.get(), width, width));
    return A;
}

void finish(Mat A) {
    LIVETET_PETSC(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    LIVETET_PETSC(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
}

}  // namespace

Transfer::Transfer(const MeshShare& fine, const MeshShare& coarse, const BarycentricMap& fine_in_coarse)
    : map_(fine_in_coarse) {
    interpolation_ = make_matrix(fine, coarse, 3, [&](std::int32_t i, auto&& visit) {
        for (int k = 0; k < 4; ++k)
            if (map_.weights[fine.nodes[i]][k] != 0) visit(coarse.number_of_node[map_.nodes[fine.nodes[i]][k]]);
    });
    make_mean(fine, coarse);
}

void Transfer::make_mean(const MeshShare& fine, const MeshShare& coarse) {
    // Columns of the map, normalised. Every rank has the whole map, so each fills its own rows.
    struct Lent {
        std::int32_t row;  ///< owned node of the coarse mesh
        std::int32_t node;
        double weight;
    };
    std::vector<std::int32_t> owned_row(coarse.number_of_node.size(), -1);
    for (std::int32_t i = 0; i < coarse.owned; ++i) owned_row[coarse.nodes[i]] = i;
    std::vector<double> total(coarse.owned, 0);
    std::vector<Lent> lent;
    for (std::size_t i = 0; i < map_.size(); ++i)
        for (int k = 0; k < 4; ++k)
            if (const std::int32_t row = owned_row[map_.nodes[i][k]]; row >= 0 && map_.mean_weight(i, k) != 0) {
                lent.push_back({row, static_cast<std::int32_t>(i), map_.mean_weight(i, k)});
                total[row] += lent.back().weight;
            }
    std::stable_sort(lent.begin(), lent.end(), [](const Lent& a, const Lent& b) { return a.row < b.row; });
    auto next = lent.begin();
    mean_of_one_ = make_matrix(coarse, fine, 1, [&](std::int32_t i, auto&& visit) {
        for (; next != lent.end() && next->row == i; ++next) visit(fine.number_of_node[next->node]);
    });
    for (const Lent& l : lent)
        LIVETET_PETSC(MatSetValue(mean_of_one_.get(), coarse.numbers[l.row], fine.number_of_node[l.node],
                                  l.weight / total[l.row], ADD_VALUES));
    finish(mean_of_one_.get());
    LIVETET_PETSC(MatCreateMAIJ(mean_of_one_.get(), 3, mean_.out()));
}

void Transfer::restrict_displacement(Vec fine, Vec coarse) const { LIVETET_PETSC(MatMult(mean_.get(), fine, coarse)); }

void Transfer::set_constrained(const MeshShare& fine, const MeshShare& coarse,
                               std::span<const std::uint8_t> fine_components,
                               std::span<const std::uint8_t> coarse_components) {
    for (std::int32_t i = 0; i < fine.owned; ++i) {
        const std::int32_t node = fine.nodes[i];
        for (PetscInt c = 0; c < 3; ++c) {
            const PetscInt row = 3 * fine.numbers[i] + c;
            PetscInt columns[4], count = 0;
            PetscScalar values[4];
            for (int k = 0; k < 4; ++k) {
                if (map_.weights[node][k] == 0) continue;
                const std::int32_t n = map_.nodes[node][k];
                const bool held = (fine_components[node] >> c & 1) || (coarse_components[n] >> c & 1);
                columns[count] = 3 * coarse.number_of_node[n] + c;
                values[count++] = held ? 0 : map_.weights[node][k];
            }
            LIVETET_PETSC(MatSetValues(interpolation_.get(), 1, &row, count, columns, values, INSERT_VALUES));
        }
    }
    finish(interpolation_.get());
}

}  // namespace livetet
