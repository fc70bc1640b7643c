#include "solvers/transfer.hpp"

namespace livetet {

std::vector<std::uint8_t> coarse_components(const BarycentricMap& fine_in_coarse, std::span<const std::uint8_t> fine,
                                            std::size_t coarse_nodes) {
    constexpr double total_of_one = 1e6;  // more than the weights of any node's neighbours
    std::vector<double> total(coarse_nodes, 0);
    std::vector<std::array<double, 3>> held(coarse_nodes, {0, 0, 0});
    for (std::size_t i = 0; i < fine_in_coarse.size(); ++i)
        for (int k = 0; k < 4; ++k) {
            const std::int32_t n = fine_in_coarse.nodes[i][k];
            const double w = fine_in_coarse.mean_weight(i, k);
            total[n] += w;
            for (int c = 0; c < 3; ++c)
                if (fine[i] >> c & 1) held[n][c] += w > 0.999 ? total_of_one : w;  // the same node decides by itself
        }
    std::vector<std::uint8_t> components(coarse_nodes, 0);
    for (std::size_t n = 0; n < coarse_nodes; ++n)
        for (int c = 0; c < 3; ++c)
            if (held[n][c] >= 0.3 * total[n]) components[n] |= 1 << c;
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

PetscHandle<Mat> make_matrix(const MeshShare& rows, const MeshShare& columns, PetscInt per_row_diagonal,
                             PetscInt per_row_off) {
    PetscHandle<Mat> A;
    LIVETET_PETSC(MatCreateAIJ(rows.comm, 3 * rows.owned, 3 * columns.owned, PETSC_DETERMINE, PETSC_DETERMINE,
                               per_row_diagonal, nullptr, per_row_off, nullptr, A.out()));
    LIVETET_PETSC(MatSetBlockSizes(A.get(), 3, 3));
    return A;
}

void finish(Mat A) {
    LIVETET_PETSC(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    LIVETET_PETSC(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
}

}  // namespace

Transfer::Transfer(const MeshShare& fine, const MeshShare& coarse, const BarycentricMap& fine_in_coarse)
    : map_(fine_in_coarse) {
    int ranks = 1;
    MPI_Comm_size(fine.comm, &ranks);
    interpolation_ = make_matrix(fine, coarse, 4, ranks > 1 ? 4 : 0);
    const std::vector<std::uint8_t> free_fine(map_.size(), 0), free_coarse(coarse.number_of_node.size(), 0);
    set_constrained(fine, coarse, free_fine, free_coarse);

    // The mean: columns of the map, normalised. Every rank has the whole map, so each fills its own rows.
    std::vector<double> total(coarse.number_of_node.size(), 0);
    std::vector<PetscInt> lent(coarse.number_of_node.size(), 0);
    for (std::size_t i = 0; i < map_.size(); ++i)
        for (int k = 0; k < 4; ++k) {
            total[map_.nodes[i][k]] += map_.mean_weight(i, k);
            ++lent[map_.nodes[i][k]];
        }
    PetscInt most = 1;
    for (std::int32_t i = 0; i < coarse.owned; ++i) most = std::max(most, lent[coarse.nodes[i]]);
    mean_ = make_matrix(coarse, fine, most, ranks > 1 ? most : 0);
    std::vector<std::int32_t> owned_row(coarse.number_of_node.size(), -1);
    for (std::int32_t i = 0; i < coarse.owned; ++i) owned_row[coarse.nodes[i]] = i;
    for (std::size_t i = 0; i < map_.size(); ++i)
        for (int k = 0; k < 4; ++k) {
            const std::int32_t n = map_.nodes[i][k];
            if (owned_row[n] < 0 || map_.mean_weight(i, k) == 0) continue;
            for (PetscInt c = 0; c < 3; ++c)
                LIVETET_PETSC(MatSetValue(mean_.get(), 3 * coarse.number_of_node[n] + c, 3 * fine.number_of_node[i] + c,
                                          map_.mean_weight(i, k) / total[n], ADD_VALUES));
        }
    finish(mean_.get());
}

void Transfer::restrict_displacement(Vec fine, Vec coarse) const { LIVETET_PETSC(MatMult(mean_.get(), fine, coarse)); }

void Transfer::set_constrained(const MeshShare& fine, const MeshShare& coarse,
                               std::span<const std::uint8_t> fine_components,
                               std::span<const std::uint8_t> coarse_components) {
    for (std::int32_t i = 0; i < fine.owned; ++i) {
        const std::int32_t node = fine.nodes[i];
        for (PetscInt c = 0; c < 3; ++c) {
            const PetscInt row = 3 * fine.numbers[i] + c;
            PetscInt columns[4];
            PetscScalar values[4];
            for (int k = 0; k < 4; ++k) {
                const std::int32_t n = map_.nodes[node][k];
                columns[k] = 3 * coarse.number_of_node[n] + c;
                const bool held = (fine_components[node] >> c & 1) || (coarse_components[n] >> c & 1);
                values[k] = held ? 0 : map_.weights[node][k];
            }
            LIVETET_PETSC(MatSetValues(interpolation_.get(), 1, &row, 4, columns, values, INSERT_VALUES));
        }
    }
    finish(interpolation_.get());
}

}  // namespace livetet
