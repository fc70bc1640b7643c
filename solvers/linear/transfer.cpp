#include "solvers/linear/transfer.hpp"

#include <algorithm>

namespace livetet {

namespace {

template <class VolumeOf>
std::vector<double> sums_at_nodes(std::size_t nodes, std::span<const Tet> tets,
                                  VolumeOf&& volume_of) {
    std::vector<double> of_node(nodes, 0);
    for (std::size_t e = 0; e < tets.size(); ++e) {
        const double quarter = volume_of(e) / 4;
        for (const std::int32_t n : tets[e]) of_node[n] += quarter;
    }
    return of_node;
}

/// Without those of ghosts, around which other ranks have tets.
std::vector<double> at_own_nodes(const PartitionedMesh& share, std::span<const double> volumes) {
    std::vector<double> sums =
        sums_at_nodes(share.nodes.size(), share.tets, [&](std::size_t e) { return volumes[e]; });
    sums.resize(static_cast<std::size_t>(share.owned));
    return sums;
}

std::vector<double> tet_volumes(const PartitionedMesh& share) {
    std::vector<double> volumes;
    volumes.reserve(share.tets.size());
    for (const Tet& t : share.tets) volumes.push_back(signed_volume(share.rest, t));
    return volumes;
}

}  // namespace

std::vector<double> nodal_volumes(const TetMesh& mesh) {
    return sums_at_nodes(mesh.nodes.size(), mesh.tets,
                         [&](std::size_t e) { return signed_volume(mesh, mesh.tets[e]); });
}

std::vector<double> nodal_volumes(const PartitionedMesh& share) {
    return at_own_nodes(share, share.volumes.empty() ? tet_volumes(share) : share.volumes);
}

std::vector<double> carried_volumes(std::span<const double> of_fine_nodes, const TransferRows& rows,
                                    const PartitionedMesh& coarse) {
    const BarycentricMap& map = rows.map();
    std::vector<double> carried(rows.columns(), 0);
    for (std::size_t i = 0; i < of_fine_nodes.size(); ++i)
        for (int k = 0; k < 4; ++k)
            carried[map.nodes[i][k]] += map.weights[i][k] * of_fine_nodes[i];
    carried = rows.sum_to_owners(std::move(carried), 1);

    std::vector<double> volumes = tet_volumes(coarse), ratios;
    const std::vector<double> own = at_own_nodes(coarse, volumes);
    for (std::size_t n = 0; n < own.size(); ++n)
        ratios.push_back(std::clamp(carried[n] / own[n], 0.1, 10.0));
    ratios = with_ghosts<double>(coarse, ratios);
    for (std::size_t e = 0; e < volumes.size(); ++e) {
        double ratio = 0;
        for (const std::int32_t n : coarse.tets[e]) ratio += ratios[n] / 4;
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
                   const TransferRows& rows)
    : rows_(rows) {
    const BarycentricMap& map = rows.map();
    interpolation_ = make_matrix(fine, coarse, 3, [&](std::int32_t i, auto&& visit) {
        for (int k = 0; k < 4; ++k)
            if (map.weights[i][k] != 0) visit(rows.number(map.nodes[i][k]));
    });
    make_mean(fine, coarse);
}

void Transfer::make_mean(const PartitionedMesh& fine, const PartitionedMesh& coarse) {
    const BarycentricMap& map = rows_.map();
    const auto over_row = [&](std::int32_t i, auto&& visit) {
        for (int k = 0; k < 4; ++k)
            if (const double w = map.mean_weight(i, k); w != 0) visit(map.nodes[i][k], w);
    };
    PetscHandle<Mat> weights = make_matrix(fine, coarse, 1, [&](std::int32_t i, auto&& visit) {
        over_row(i, [&](std::int32_t n, double) { visit(rows_.number(n)); });
    });
    std::vector<double> totals(rows_.columns(), 0);
    for (std::int32_t i = 0; i < fine.owned; ++i)
        over_row(i, [&](std::int32_t n, double w) {
            totals[n] += w;
            LIVETET_PETSC(
                MatSetValue(weights.get(), fine.numbers[i], rows_.number(n), w, INSERT_VALUES));
        });
    finish(weights.get());
    LIVETET_PETSC(MatTranspose(weights.get(), MAT_INITIAL_MATRIX, mean_of_one_.out()));
    weights.reset();

    // A mean: the weights around a coarse node sum to one.
    totals = rows_.sum_to_owners(std::move(totals), 1);
    PetscHandle<Vec> scale;
    LIVETET_PETSC(MatCreateVecs(mean_of_one_.get(), nullptr, scale.out()));
    {
        WriteArray of_node(scale.get());
        for (std::int32_t i = 0; i < coarse.owned; ++i)
            of_node[i] = totals[i] > 0 ? 1 / totals[i] : 0;
    }
    LIVETET_PETSC(MatDiagonalScale(mean_of_one_.get(), scale.get(), nullptr));
    LIVETET_PETSC(MatCreateMAIJ(mean_of_one_.get(), 3, mean_.out()));
}

void Transfer::restrict_displacement(Vec fine, Vec coarse) const {
    LIVETET_PETSC(MatMult(mean_.get(), fine, coarse));
}

void Transfer::set_constrained(const PartitionedMesh& fine,
                               std::span<const std::uint8_t> fine_components,
                               std::span<const std::uint8_t> coarse_components) {
    const BarycentricMap& map = rows_.map();
    const std::vector<std::uint8_t> of_columns = rows_.to_columns(coarse_components);
    for (std::int32_t i = 0; i < fine.owned; ++i)
        for (PetscInt c = 0; c < 3; ++c) {
            const PetscInt row = 3 * fine.numbers[i] + c;
            PetscInt columns[4], count = 0;
            PetscScalar values[4];
            for (int k = 0; k < 4; ++k) {
                if (map.weights[i][k] == 0) continue;
                const std::int32_t n = map.nodes[i][k];
                const bool held = (fine_components[i] >> c & 1) || (of_columns[n] >> c & 1);
                columns[count] = 3 * rows_.number(n) + c;
                values[count++] = held ? 0 : map.weights[i][k];
            }
            LIVETET_PETSC(
                MatSetValues(interpolation_.get(), 1, &row, count, columns, values, INSERT_VALUES));
        }
    finish(interpolation_.get());
}

}  // namespace livetet
