#include "solvers/elastic_level.hpp"

#include <petscmat.h>

#include <algorithm>

#include "mechanics/rotation.hpp"

namespace livetet {

namespace {

using Nodal = Eigen::Matrix<double, 3, 4>;

Nodal values_at(const Tet& t, const double* values) {
    Nodal u;
    for (int i = 0; i < 4; ++i) u.col(i) = Eigen::Map<const Eigen::Vector3d>(values + 3 * t[i]);
    return u;
}

/// The arrays behind a PETSc matrix of either layout, of its diagonal and off-diagonal part.
class MatrixArrays {
  public:
    MatrixArrays(Mat matrix, MatrixLayout layout) : layout_(layout) {
        PetscBool parallel = PETSC_FALSE;
        LIVETET_PETSC(
            PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(matrix), &parallel, MATMPIBAIJ, MATMPIAIJ, ""));
        parts_[0] = matrix;
        if (parallel && layout == MatrixLayout::blocks)
            LIVETET_PETSC(MatMPIBAIJGetSeqBAIJ(matrix, &parts_[0], &parts_[1], nullptr));
        else if (parallel)
            LIVETET_PETSC(MatMPIAIJGetSeqAIJ(matrix, &parts_[0], &parts_[1], nullptr));
        for (int p = 0; p < 2; ++p)
            if (parts_[p])
                LIVETET_PETSC(layout == MatrixLayout::blocks ? MatSeqBAIJGetArray(parts_[p], &data[p])
                                                             : MatSeqAIJGetArray(parts_[p], &data[p]));
    }
    ~MatrixArrays() {
        for (int p = 0; p < 2; ++p)
            if (parts_[p])
                layout_ == MatrixLayout::blocks ? MatSeqBAIJRestoreArray(parts_[p], &data[p])
                                                : MatSeqAIJRestoreArray(parts_[p], &data[p]);
    }
    MatrixArrays(const MatrixArrays&) = delete;
    MatrixArrays& operator=(const MatrixArrays&) = delete;
    Mat part(int p) const { return parts_[p]; }

    PetscScalar* data[2] = {nullptr, nullptr};

  private:
    MatrixLayout layout_;
    Mat parts_[2] = {nullptr, nullptr};
};

}  // namespace

/// Both layouts hold the same rows of blocks. `blocks`: block k of row i starts at 9 (start_i + k), column-major.
/// `scalars`: scalar row a of node i starts at 9 start_i + 3 a (blocks in the row), and block k is at + 3 k.
struct ElasticLevel::BlockAdder {
    const BlockRows& rows;
    MatrixLayout layout;
    PetscScalar* data;

    /// Where entry (a, b) of block k of row i stands.
    PetscScalar& at(std::int32_t row, std::int32_t block, int a, int b) const {
        const std::size_t start = rows.start[row];
        if (layout == MatrixLayout::blocks) return data[9 * (start + block) + 3 * b + a];
        return data[9 * start + static_cast<std::size_t>(a) * 3 * (rows.start[row + 1] - start) + 3 * block + b];
    }
    void add(std::int32_t row, std::int32_t block, const Eigen::Matrix3d& K) const {
        if (layout == MatrixLayout::blocks) {
            Eigen::Map<Eigen::Matrix3d>(data + 9 * (rows.start[row] + static_cast<std::size_t>(block))) += K;
            return;
        }
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b) at(row, block, a, b) += K(a, b);
    }
};

ElasticLevel::ElasticLevel(const TetMesh& mesh, MeshShare share, std::span<const Material> materials,
                           StrainModel strain, MatrixLayout layout)
    : share_(std::move(share)), strain_(strain), layout_(layout), constrained_(share_.nodes.size(), 0) {
    make_elements(mesh, materials);
    make_pattern();
    make_matrix(mesh, layout);
    find_positions();
}

void ElasticLevel::make_elements(const TetMesh& mesh, std::span<const Material> materials) {
    elements_.reserve(share_.tets.size());
    node_mass_.assign(share_.owned, 0);
    for (std::size_t e = 0; e < share_.tets.size(); ++e) {
        const Tet& whole = mesh.tets[share_.tet_ids[e]];
        const Material& m = material_of(materials, mesh.regions.empty() ? 0 : mesh.regions[share_.tet_ids[e]]);
        elements_.push_back(
            make_element({mesh.nodes[whole[0]], mesh.nodes[whole[1]], mesh.nodes[whole[2]], mesh.nodes[whole[3]]},
                         m.lambda(), m.mu()));
        for (const std::int32_t n : share_.tets[e])
            if (n < share_.owned) node_mass_[n] += m.density_kg_per_m3 * elements_.back().volume / 4;
    }
    rotations_.assign(elements_.size(), Eigen::Matrix3d::Identity());
}

void ElasticLevel::make_pattern() {
    std::vector<std::vector<std::int32_t>> neighbours(share_.owned);
    for (const Tet& t : share_.tets)
        for (const std::int32_t i : t)
            if (i < share_.owned) neighbours[i].insert(neighbours[i].end(), t.begin(), t.end());
    for (auto& row : neighbours) {
        std::sort(row.begin(), row.end());
        row.erase(std::unique(row.begin(), row.end()), row.end());
        for (const std::int32_t j : row) {
            if (j < share_.owned)
                diagonal_.columns.push_back(j);
            else
                off_diagonal_.columns.push_back(j - share_.owned);
        }
        diagonal_.start.push_back(static_cast<std::int32_t>(diagonal_.columns.size()));
        off_diagonal_.start.push_back(static_cast<std::int32_t>(off_diagonal_.columns.size()));
    }
}

void ElasticLevel::make_matrix(const TetMesh& mesh, MatrixLayout layout) {
    int ranks = 1;
    MPI_Comm_size(share_.comm, &ranks);
    const int expand = layout == MatrixLayout::blocks ? 1 : 3;  // scalar rows a block row
    std::vector<PetscInt> nnz[2];
    for (std::int32_t i = 0; i < share_.owned; ++i)
        for (int a = 0; a < expand; ++a) {
            nnz[0].push_back(expand * (diagonal_.start[i + 1] - diagonal_.start[i]));
            nnz[1].push_back(expand * (off_diagonal_.start[i + 1] - off_diagonal_.start[i]));
        }
    LIVETET_PETSC(MatCreate(share_.comm, matrix_.out()));
    Mat A = matrix_.get();
    LIVETET_PETSC(MatSetSizes(A, 3 * share_.owned, 3 * share_.owned, PETSC_DETERMINE, PETSC_DETERMINE));
    LIVETET_PETSC(MatSetBlockSize(A, 3));
    const bool blocks = layout == MatrixLayout::blocks;
    LIVETET_PETSC(MatSetType(A, ranks > 1 ? (blocks ? MATMPIBAIJ : MATMPIAIJ) : (blocks ? MATSEQBAIJ : MATSEQAIJ)));
    LIVETET_PETSC(MatSeqBAIJSetPreallocation(A, 3, 0, nnz[0].data()));
    LIVETET_PETSC(MatMPIBAIJSetPreallocation(A, 3, 0, nnz[0].data(), 0, nnz[1].data()));
    LIVETET_PETSC(MatSeqAIJSetPreallocation(A, 0, nnz[0].data()));
    LIVETET_PETSC(MatMPIAIJSetPreallocation(A, 0, nnz[0].data(), 0, nnz[1].data()));
    std::vector<PetscInt> columns;
    const std::vector<PetscScalar> zeros(static_cast<std::size_t>(9) * 512, 0.0);
    for (std::int32_t i = 0; i < share_.owned; ++i) {
        columns.clear();
        for (std::int32_t k = diagonal_.start[i]; k < diagonal_.start[i + 1]; ++k)
            columns.push_back(share_.numbers[diagonal_.columns[k]]);
        for (std::int32_t k = off_diagonal_.start[i]; k < off_diagonal_.start[i + 1]; ++k)
            columns.push_back(share_.numbers[share_.owned + off_diagonal_.columns[k]]);
        for (std::size_t k = 0; k < columns.size(); k += 512)
            LIVETET_PETSC(MatSetValuesBlocked(A, 1, &share_.numbers[i],
                                              static_cast<PetscInt>(std::min<std::size_t>(512, columns.size() - k)),
                                              columns.data() + k, zeros.data(), INSERT_VALUES));
    }
    LIVETET_PETSC(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    LIVETET_PETSC(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
    if (!blocks) {  // for factorisations; parallel BAIJ does not take the option
        LIVETET_PETSC(MatSetOption(A, MAT_SPD, PETSC_TRUE));
        LIVETET_PETSC(MatSetOption(A, MAT_SPD_ETERNAL, PETSC_TRUE));
    }
    LIVETET_PETSC(MatSetOption(A, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_TRUE));

    // Algebraic multigrid wants the six rigid motions.
    const PetscHandle<Vec> x = make_vector(share_);
    fill(share_, mesh.nodes, x.get());
    LIVETET_PETSC(VecSetBlockSize(x.get(), 3));
    PetscHandle<MatNullSpace> rigid;
    LIVETET_PETSC(MatNullSpaceCreateRigidBody(x.get(), rigid.out()));
    LIVETET_PETSC(MatSetNearNullSpace(A, rigid.get()));
}

void ElasticLevel::find_positions() {
    const auto place_in = [](const BlockRows& rows, std::int32_t row, std::int32_t column) {
        const auto begin = rows.columns.begin() + rows.start[row], end = rows.columns.begin() + rows.start[row + 1];
        return static_cast<std::int32_t>(std::lower_bound(begin, end, column) - begin);
    };
    positions_.resize(share_.tets.size());
    for (std::size_t e = 0; e < share_.tets.size(); ++e)
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j) {
                const std::int32_t row = share_.tets[e][i], column = share_.tets[e][j];
                if (row >= share_.owned)
                    positions_[e][4 * i + j] = {-1, 0};
                else if (column < share_.owned)
                    positions_[e][4 * i + j] = {row, place_in(diagonal_, row, column)};
                else
                    positions_[e][4 * i + j] = {row, -1 - place_in(off_diagonal_, row, column - share_.owned)};
            }
    // PETSc must hold the very rows that were counted here, else the arrays are not what BlockAdder takes them for.
    const MatrixArrays arrays(matrix_.get(), layout_);
    const double expected[2] = {9.0 * diagonal_.columns.size(), 9.0 * off_diagonal_.columns.size()};
    for (int p = 0; p < 2; ++p) {
        if (!arrays.part(p)) continue;
        MatInfo info;
        LIVETET_PETSC(MatGetInfo(arrays.part(p), MAT_LOCAL, &info));
        if (info.nz_used != expected[p])
            throw std::logic_error("ElasticLevel: PETSc's pattern differs from the mesh's");
    }
}

void ElasticLevel::set_constrained(std::span<const std::uint8_t> components) {
    for (std::size_t i = 0; i < share_.nodes.size(); ++i) constrained_[i] = components[share_.nodes[i]];
    masked_.clear();
    for (std::int32_t i = 0; i < share_.owned; ++i) {
        for (std::int32_t k = diagonal_.start[i]; k < diagonal_.start[i + 1]; ++k) {
            const std::int32_t j = diagonal_.columns[k];
            if (constrained_[i] | constrained_[j])
                masked_.push_back({i, k - diagonal_.start[i], constrained_[i], constrained_[j], i == j});
        }
        for (std::int32_t k = off_diagonal_.start[i]; k < off_diagonal_.start[i + 1]; ++k) {
            const std::int32_t j = share_.owned + off_diagonal_.columns[k];
            if (constrained_[i] | constrained_[j])
                masked_.push_back({i, -1 - (k - off_diagonal_.start[i]), constrained_[i], constrained_[j], false});
        }
    }
}

void ElasticLevel::update_rotations(Vec u) {
    if (strain_ == StrainModel::linear) return;
    const LocalValues values(u);
    for (std::size_t e = 0; e < elements_.size(); ++e)
        rotations_[e] = rotation_of(Eigen::Matrix3d::Identity() +
                                    gradient_of(elements_[e], values_at(share_.tets[e], values.data())));
}

void ElasticLevel::assemble(double s, double m) {
    {
        const MatrixArrays arrays(matrix_.get(), layout_);
        const BlockAdder adders[2] = {{diagonal_, layout_, arrays.data[0]}, {off_diagonal_, layout_, arrays.data[1]}};
        std::fill_n(arrays.data[0], 9 * diagonal_.columns.size(), 0.0);
        if (arrays.data[1]) std::fill_n(arrays.data[1], 9 * off_diagonal_.columns.size(), 0.0);
        for (std::size_t e = 0; e < elements_.size(); ++e) {
            TetElement scaled = elements_[e];
            scaled.volume *= s;
            const Nodal h = rotations_[e] * scaled.gradients;
            for (int i = 0; i < 4; ++i) {
                if (positions_[e][4 * i].row < 0) continue;
                for (int j = 0; j < 4; ++j) {
                    const Position& p = positions_[e][4 * i + j];
                    adders[p.block < 0].add(p.row, p.block < 0 ? -1 - p.block : p.block,
                                            stiffness_block(scaled, h.col(i), h.col(j)));
                }
            }
        }
        double diagonal_sum = 0;
        for (std::int32_t i = 0; i < share_.owned; ++i) {
            const auto row_begin = diagonal_.columns.begin() + diagonal_.start[i];
            const auto k = static_cast<std::int32_t>(
                std::lower_bound(row_begin, diagonal_.columns.begin() + diagonal_.start[i + 1], i) - row_begin);
            for (int a = 0; a < 3; ++a) diagonal_sum += adders[0].at(i, k, a, a) += m * node_mass_[i];
        }
        identity_ = share_.owned ? diagonal_sum / (3 * share_.owned) : 1;
        for (const MaskedBlock& b : masked_) {
            const BlockAdder& adder = adders[b.block < 0];
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    if ((b.row_components >> i & 1) || (b.column_components >> j & 1))
                        adder.at(b.row, b.block < 0 ? -1 - b.block : b.block, i, j) =
                            b.on_diagonal && i == j ? identity_ : 0;
        }
    }
    LIVETET_PETSC(MatAssemblyBegin(matrix_.get(), MAT_FINAL_ASSEMBLY));
    LIVETET_PETSC(MatAssemblyEnd(matrix_.get(), MAT_FINAL_ASSEMBLY));
}

template <class StressOf>
void ElasticLevel::scatter_forces(const double* values, StressOf&& stress_of, Vec f) const {
    WriteArray forces(f);
    for (std::size_t e = 0; e < elements_.size(); ++e) {
        const Tet& t = share_.tets[e];
        const Nodal nodal = nodal_forces(elements_[e], stress_of(e, gradient_of(elements_[e], values_at(t, values))));
        for (int i = 0; i < 4; ++i)
            if (t[i] < share_.owned) Eigen::Map<Eigen::Vector3d>(forces.span().data() + 3 * t[i]) += nodal.col(i);
    }
}

void ElasticLevel::elastic_force(Vec u, Vec f) const {
    LIVETET_PETSC(VecSet(f, 0));
    const LocalValues values(u);
    scatter_forces(
        values.data(),
        [&](std::size_t e, const Eigen::Matrix3d& H) {
            return first_piola(elements_[e], rotations_[e], Eigen::Matrix3d::Identity() + H);
        },
        f);
}

void ElasticLevel::add_stiffness_times(double factor, Vec v, Vec f) const {
    const LocalValues values(v);
    scatter_forces(
        values.data(),
        [&](std::size_t e, const Eigen::Matrix3d& H) -> Eigen::Matrix3d {
            return factor * stress_increment(elements_[e], rotations_[e], H);
        },
        f);
}

double ElasticLevel::strain_energy(Vec u) const {
    const LocalValues values(u);
    double energy = 0;
    for (std::size_t e = 0; e < elements_.size(); ++e) {
        // Shared by the ranks that own its nodes, so that each tet counts once.
        const Tet& t = share_.tets[e];
        const auto owned = std::count_if(t.begin(), t.end(), [&](std::int32_t n) { return n < share_.owned; });
        const Eigen::Matrix3d F = Eigen::Matrix3d::Identity() + gradient_of(elements_[e], values_at(t, values.data()));
        energy += 0.25 * static_cast<double>(owned) * elements_[e].volume *
                  corotated_energy_density(elements_[e], rotations_[e], F);
    }
    MPI_Allreduce(MPI_IN_PLACE, &energy, 1, MPI_DOUBLE, MPI_SUM, share_.comm);
    return energy;
}

}  // namespace livetet
