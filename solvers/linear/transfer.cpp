#include "solvers/linear/transfer.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "mechanics/rigid_motions.hpp"

namespace livetet {

CoarseBody::CoarseBody(const TetMesh& mesh, const TetMesh& fine,
                       const BarycentricMap& fine_in_coarse)
    : places(mesh.nodes), piece_of(connected_pieces(mesh)) {
    std::vector<Eigen::AlignedBox3d> boxes;
    for (std::size_t n = 0; n < places.size(); ++n) {
        // The lowest node of a piece comes first.
        if (piece_of[n] == static_cast<std::int32_t>(n)) {
            piece_of[n] = static_cast<std::int32_t>(boxes.size());
            boxes.emplace_back();
        } else {
            piece_of[n] = piece_of[piece_of[n]];
        }
        boxes[piece_of[n]].extend(places[n]);
    }
    for (const Eigen::AlignedBox3d& box : boxes)
        pieces.push_back({box.center(),
                          box.diagonal().norm() / 2,
                          static_cast<std::int32_t>(pieces.size()),
                          {}});
    for (const Tet& t : mesh.tets) pieces[piece_of[t[0]]].tet = t;
    const std::vector<std::int32_t> fine_piece_of = connected_pieces(fine);
    const auto whole_of = [&](std::int32_t p) {
        while (pieces[p].whole != p) p = pieces[p].whole;
        return p;
    };
    for (std::size_t i = 0; i < fine_in_coarse.size(); ++i) {
        const std::int32_t a = whole_of(piece_of[fine_in_coarse.nodes[i][0]]),
                           b = whole_of(piece_of[fine_in_coarse.nodes[fine_piece_of[i]][0]]);
        pieces[std::max(a, b)].whole = std::min(a, b);
    }
    for (Piece& piece : pieces) piece.whole = whole_of(piece.whole);
}

std::vector<std::uint8_t> coarse_components(const BarycentricMap& fine_in_coarse,
                                            std::span<const std::uint8_t> fine,
                                            const CoarseBody& coarse) {
    constexpr double total_of_one = 1e6;  // more than the weights of any node's neighbours
    // Of each piece, the rigid motions that are held: none; by the fine nodes in it; by those in
    // the whole that it is a part of.
    std::vector<RigidMotionConstraints> free, of_fine, of_whole;
    for (const CoarseBody::Piece& piece : coarse.pieces)
        free.emplace_back(piece.centre, piece.extent);
    of_fine = of_whole = free;
    const std::size_t coarse_nodes = coarse.places.size();
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
                if (fine[i] >> c & 1)
                    held[n][c] += w > 0.999 ? total_of_one : w;  // the same node decides alone
        }
        if (!fine[i]) continue;
        const std::int32_t p = coarse.piece_of[fine_in_coarse.nodes[i][0]];
        of_fine[p].constrain(place, fine[i]);
        of_whole[coarse.pieces[p].whole].constrain(place, fine[i]);
    }
    std::vector<std::uint8_t> components(coarse_nodes, 0);
    // done: a smaller share would change nothing.
    std::vector<bool> is_held(coarse.pieces.size(), false), done = is_held;
    for (const double share : {0.3, 0.1, 0.03, 0.01, 1e-6}) {
        std::vector<RigidMotionConstraints> of_coarse = free;
        for (std::size_t n = 0; n < coarse_nodes; ++n) {
            const std::int32_t p = coarse.piece_of[n];
            if (!done[p])
                for (int c = 0; c < 3; ++c)
                    if (held[n][c] >= share * total[n]) components[n] |= 1 << c;
            of_coarse[p].constrain(coarse.places[n], components[n]);
        }
        for (std::size_t p = 0; p < done.size(); ++p) {
            is_held[p] = of_coarse[p].constrains_all();
            done[p] = is_held[p] || !of_fine[p].constrains_all();
        }
        if (std::find(done.begin(), done.end(), false) == done.end()) break;
    }
    for (std::size_t p = 0; p < is_held.size(); ++p)
        if (!is_held[p] && of_whole[coarse.pieces[p].whole].constrains_all())
            for (const std::int32_t n : coarse.pieces[p].tet) components[n] = 7;
    return components;
}

namespace {

template <class VolumeOf>
std::vector<double> sums_at_nodes(const TetMesh& mesh, VolumeOf&& volume_of) {
    std::vector<double> of_node(mesh.nodes.size(), 0);
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
        const double quarter = volume_of(e) / 4;
        for (const std::int32_t n : mesh.tets[e]) of_node[n] += quarter;
    }
    return of_node;
}

}  // namespace

std::vector<double> nodal_volumes(const TetMesh& mesh) {
    return sums_at_nodes(mesh, [&](std::size_t e) { return signed_volume(mesh, mesh.tets[e]); });
}

std::vector<double> nodal_volumes(const TetMesh& mesh, std::span<const double> of_tets) {
    return sums_at_nodes(mesh, [&](std::size_t e) { return of_tets[e]; });
}

std::vector<double> tet_volumes(const TetMesh& mesh) {
    std::vector<double> volumes;
    volumes.reserve(mesh.tets.size());
    for (const Tet& t : mesh.tets) volumes.push_back(signed_volume(mesh, t));
    return volumes;
}

std::vector<double> carried_volumes(std::span<const double> of_fine_nodes,
                                    const BarycentricMap& fine_in_coarse, const TetMesh& coarse) {
    std::vector<double> volumes = tet_volumes(coarse);
    const std::vector<double> own = nodal_volumes(coarse, volumes);
    std::vector<double> carried(coarse.nodes.size(), 0);
    for (std::size_t i = 0; i < of_fine_nodes.size(); ++i)
        for (int k = 0; k < 4; ++k)
            carried[fine_in_coarse.nodes[i][k]] += fine_in_coarse.weights[i][k] * of_fine_nodes[i];
    for (std::size_t e = 0; e < volumes.size(); ++e) {
        double ratio = 0;
        for (const std::int32_t n : coarse.tets[e])
            ratio += std::clamp(carried[n] / own[n], 0.1, 10.0) / 4;
        volumes[e] *= ratio;
    }
    return volumes;
}

namespace {

/// An empty matrix with `width` numbers for each node, its rows and columns owned as the nodes are.
/// `columns_of(row, visit)` calls visit(PETSc's number of a node) once for each node in which the
/// owned row has entries; it is called once for each row, in order.
template <class ColumnsOf>
PetscHandle<Mat> make_matrix(const PartitionedMesh& rows, const PartitionedMesh& columns,
                             PetscInt width, ColumnsOf&& columns_of) {
    const PetscInt first = columns.owned ? columns.numbers.front() : 0, end = first + columns.owned;
    std::vector<PetscInt> own, others;
    for (std::int32_t i = 0; i < rows.owned; ++i) {
        PetscInt counts[2] = {0, 0};
        columns_of(i, [&](PetscInt n) { ++counts[n < first || n >= end]; });
        own.insert(own.end(), width, counts[0]);
        others.insert(others.end(), width, counts[1]);
    }
    PetscHandle<Mat> A;
    LIVETET_PETSC(MatCreateAIJ(rows.comm, width * rows.owned, width * columns.owned,
                               PETSC_DETERMINE, PETSC_DETERMINE, 0, own.data(), 0, others.data(),
                               A.out()));
    LIVETET_PETSC(MatSetBlockSizes(A.get(), width, width));
    return A;
}

void finish(Mat A) {
    LIVETET_PETSC(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    LIVETET_PETSC(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
}

}  // namespace

Transfer::Transfer(const PartitionedMesh& fine, const PartitionedMesh& coarse,
                   const BarycentricMap& fine_in_coarse)
    : map_(fine_in_coarse) {
    interpolation_ = make_matrix(fine, coarse, 3, [&](std::int32_t i, auto&& visit) {
        for (int k = 0; k < 4; ++k)
            if (map_.weights[fine.nodes[i]][k] != 0)
                visit(coarse.number_of_node[map_.nodes[fine.nodes[i]][k]]);
    });
    make_mean(fine, coarse);
}

void Transfer::make_mean(const PartitionedMesh& fine, const PartitionedMesh& coarse) {
    // Columns of the map, normalised. Every rank has the whole map, so each fills its own rows.
    struct TransposedEntry {
        std::int32_t row;  ///< owned node of the coarse mesh
        std::int32_t node;
        double weight;
    };
    std::vector<std::int32_t> owned_row(coarse.number_of_node.size(), -1);
    for (std::int32_t i = 0; i < coarse.owned; ++i) owned_row[coarse.nodes[i]] = i;
    std::vector<double> total(coarse.owned, 0);
    std::vector<TransposedEntry> entries;
    for (std::size_t i = 0; i < map_.size(); ++i)
        for (int k = 0; k < 4; ++k)
            if (const std::int32_t row = owned_row[map_.nodes[i][k]];
                row >= 0 && map_.mean_weight(i, k) != 0) {
                entries.push_back({row, static_cast<std::int32_t>(i), map_.mean_weight(i, k)});
                total[row] += entries.back().weight;
            }
    std::stable_sort(
        entries.begin(), entries.end(),
        [](const TransposedEntry& a, const TransposedEntry& b) { return a.row < b.row; });
    auto next = entries.begin();
    mean_of_one_ = make_matrix(coarse, fine, 1, [&](std::int32_t i, auto&& visit) {
        for (; next != entries.end() && next->row == i; ++next)
            visit(fine.number_of_node[next->node]);
    });
    for (const TransposedEntry& entry : entries)
        LIVETET_PETSC(MatSetValue(mean_of_one_.get(), coarse.numbers[entry.row],
                                  fine.number_of_node[entry.node], entry.weight / total[entry.row],
                                  ADD_VALUES));
    finish(mean_of_one_.get());
    LIVETET_PETSC(MatCreateMAIJ(mean_of_one_.get(), 3, mean_.out()));
}

void Transfer::restrict_displacement(Vec fine, Vec coarse) const {
    LIVETET_PETSC(MatMult(mean_.get(), fine, coarse));
}

void Transfer::set_constrained(const PartitionedMesh& fine, const PartitionedMesh& coarse,
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
                const bool held =
                    (fine_components[node] >> c & 1) || (coarse_components[n] >> c & 1);
                columns[count] = 3 * coarse.number_of_node[n] + c;
                values[count++] = held ? 0 : map_.weights[node][k];
            }
            LIVETET_PETSC(
                MatSetValues(interpolation_.get(), 1, &row, count, columns, values, INSERT_VALUES));
        }
    }
    finish(interpolation_.get());
}

}  // namespace livetet
